"""The equilibrium of a chain: which one is taken, and cases without one."""

import math
from dataclasses import replace

import numpy as np
import pytest

from magsim.flight.tow import dynamics
from magsim.flight.tow.chain import Chain, Rope
from magsim.flight.tow.equilibrium import find_equilibrium
from magsim.units import G0
from tests.support.ropes import AIR, BIRD, ROPE, air_of, bird_chain, point_chain
from tests.support.tows import at_rest


def test_in_still_air_it_hangs_straight_down_from_its_bridle() -> None:
    """The bridle stands above the center of gravity: a tangent of 0.15 m over 0.22 m; the pulls are weights."""
    found = find_equilibrium(bird_chain(), 1.0, 0.0)
    assert found is not None
    assert math.tan(found.pitch) == pytest.approx(0.15 / 0.22, rel=1e-9)
    np.testing.assert_allclose(found.links, np.tile([0.0, 1.0], (10, 1)), atol=1e-12)
    below = 80.0 + ROPE.mass_per_m * (30.0 - 3.0 * (np.arange(10) + 0.5))
    np.testing.assert_allclose(found.tension_n, below * G0, rtol=1e-12)
    # the center of gravity hangs plumb below the hook: the bridle is tilted over it
    assert found.trail == pytest.approx(0.0, abs=1e-12)
    assert found.hang_m[1] == pytest.approx(30.0 + math.hypot(0.15, 0.22), rel=1e-12)


def test_pulls_are_proportional_to_gravity_and_its_balance_to_the_speed() -> None:
    """Air forces go with the density and the square of the speed: what gravity over both leaves equal hangs equally."""
    one, other = (
        find_equilibrium(bird_chain(), 30.0, AIR, G0),
        find_equilibrium(bird_chain(), 60.0, 0.5 * AIR, 2.0 * G0),
    )
    assert one is not None
    assert other is not None
    assert other.pitch == pytest.approx(one.pitch, abs=1e-12)
    assert other.trail == pytest.approx(one.trail, abs=1e-12)
    np.testing.assert_allclose(other.tension_n, 2.0 * one.tension_n, rtol=1e-12)


def test_a_bird_that_the_air_turns_over_has_none() -> None:
    """Without fins, tied at its center of gravity: the moment of its slender body has nothing against it."""
    bare = replace(BIRD, fin_area_m2=0.0, bridle_m=(0.0, 0.0, 0.0))
    assert find_equilibrium(Chain(ROPE, bare), 60.0, AIR) is None
    assert find_equilibrium(Chain(ROPE, replace(BIRD, bridle_m=(0.0, 0.0, 0.0))), 60.0, AIR) is not None


def test_a_ball_keeps_its_attitude_and_a_light_one_lies_flat() -> None:
    found = find_equilibrium(point_chain(), 40.0, AIR)
    assert found is not None
    assert found.pitch == 0.0
    assert found.upright
    light = find_equilibrium(point_chain(0.05, 1.0), 70.0, AIR)
    assert light is not None
    assert math.degrees(light.trail) > 80.0


def test_a_bird_that_flies_higher_than_its_hook_is_not_upright() -> None:
    """Very light, tied far ahead: its lift carries it up."""
    kite = replace(BIRD, mass_kg=3.0, inertia_kgm2=(0.06, 1.7, 1.7), bridle_m=(0.0, 0.0, 0.3))
    found = find_equilibrium(Chain(ROPE, kite), 60.0, AIR)
    assert found is not None
    assert not found.upright


@pytest.mark.parametrize(
    ("rope", "mass_kg", "links", "speed_mps"),
    [
        (Rope(22.7, 0.081, 0.2, 1.1, 0.02), 44.5, 3, 52.7),
        (Rope(150.0, 0.0094, 0.13, 1.1, 0.02), 5.4, 2, 59.0),
        (Rope(422.0, 0.056, 1.9, 1.1, 0.02), 3.9, 13, 61.5),
        (Rope(100.0, 0.064, 2.1, 1.1, 0.02), 17.9, 11, 37.3),
    ],
)
def test_a_rope_with_more_drag_than_its_body_weighs_is_at_rest_too(
    rope: Rope, mass_kg: float, links: int, speed_mps: float
) -> None:
    """By the equations of motion, which know nothing of how it was found."""
    inertia = tuple(mass_kg / 80.0 * value for value in BIRD.inertia_kgm2)
    chain = Chain(rope, replace(BIRD, mass_kg=mass_kg, inertia_kgm2=inertia), links)
    slope, tension = np.empty(chain.size), np.empty(links)
    dynamics.state_derivative(chain.constants, at_rest(chain, speed_mps), air_of(speed_mps), slope, tension)
    assert np.abs(slope).max() < 1e-9
    found = find_equilibrium(chain, speed_mps, AIR)
    assert found is not None
    np.testing.assert_allclose(tension, found.tension_n, rtol=1e-9)

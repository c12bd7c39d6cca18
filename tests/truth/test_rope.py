"""The chain against a dense system with multipliers, a continuous rope, closed forms of pendulums, and Foucault."""

import math

import numpy as np
import pytest

from magsim.flight.tow import dynamics
from magsim.flight.tow.chain import Chain, TowedBody, ball
from magsim.flight.tow.equilibrium import find_equilibrium
from magsim.planning import WHIP_G
from magsim.streams import stream
from magsim.units import G0
from tests.benchmarks.tow_rows.steady import trail_flown
from tests.benchmarks.tow_rows.steps import apart, is_stable, swayed
from tests.benchmarks.tow_rows.swings import (
    DECAY,
    DECAY_MPS,
    decays,
    energy_drift,
    foucault_error_pct,
    link_error_m,
    pendulum_s,
)
from tests.benchmarks.tow_rows.whip import whipped
from tests.support.ropes import (
    AIR,
    BIRD,
    ROPE,
    all_nodes,
    bird_chain,
    body_loads,
    compound_period,
    continuous_trail,
    dense,
    flexible_period,
    lengths_m,
    link_drag,
    masses,
    parts_of,
    point_chain,
)
from tests.support.tows import at_rest, level, states, tilted


def any_state(chain: Chain, rng: np.random.Generator) -> np.ndarray:
    """A crooked rope, links that are off their length, everything in motion."""
    n, link_m = chain.links, chain.rope.length_m / chain.links
    state, body = rng.normal(size=chain.size), 6 * (chain.links - 1)
    nodes = np.cumsum([0.0, 0.0, link_m] + 0.3 * link_m * rng.normal(size=(n, 3)), axis=0)
    state[: body // 2], state[body : body + 3] = nodes[:-1].ravel(), nodes[-1]
    state[body // 2 : body] *= 5.0
    state[body + 3 : body + 6] *= 5.0
    state[body + 9 :] /= np.linalg.norm(state[body + 9 :])
    return state


def any_air(rng: np.random.Generator) -> np.ndarray:
    """Apparent gravity and winds of any direction."""
    return np.concatenate([[0.0, 0.0, G0] + 2.0 * rng.normal(size=3), 20.0 * rng.normal(size=6), [AIR]])


def slope_of(chain: Chain, state: np.ndarray, air: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    slope, tension = np.empty(chain.size), np.empty(chain.links)
    dynamics.state_derivative(chain.constants, state, air, slope, tension)
    return slope, tension


@pytest.mark.parametrize("body", [BIRD, ball(20.0, 0.03)], ids=["bird", "ball"])
@pytest.mark.parametrize("spin", [0.0, 0.1])
def test_accelerations_and_tensions_are_those_of_newton_euler_with_multipliers(body: TowedBody, spin: float) -> None:
    rng = stream(5, f"rope/{spin}/{body.mass_kg}")
    for links in (2, 3, 6, 10, 13):
        chain = Chain(ROPE, body, links, tuple(spin * rng.normal(size=3)))
        state, air = any_state(chain, rng), any_air(rng)
        slope, tension = slope_of(chain, state, air)
        acceleration, pulls = dense(chain, state, air, dynamics.GAMMA)
        first = 6 * (links - 1)
        found = np.concatenate([slope[first // 2 : first], slope[first + 3 : first + 9]])
        np.testing.assert_allclose(found, acceleration, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(tension, pulls, rtol=0.0, atol=1e-8)
        # places change by the velocities, the attitude by the rate: q' = q (0, rate) / 2
        np.testing.assert_array_equal(slope[: first // 2], state[first // 2 : first])
        np.testing.assert_array_equal(slope[first : first + 3], state[first + 3 : first + 6])
        w, v, rate = state[first + 9], state[first + 10 :], state[first + 6 : first + 9]
        turned = 0.5 * np.concatenate([[-v @ rate], w * rate + np.cross(v, rate)])
        np.testing.assert_allclose(slope[first + 9 :], turned, atol=1e-14)


def test_pull_on_the_hook_is_what_accelerates_everything() -> None:
    """All forces from outside less the change of all momentum, for any state."""
    rng = stream(6, "rope/pull")
    for body in (BIRD, ball(20.0, 0.03)):
        chain = Chain(ROPE, body, 7)
        state, air = any_state(chain, rng), any_air(rng)
        parts, (link_kg, body_kg) = parts_of(chain, state), masses(chain)
        acceleration, _ = dense(chain, state, air, dynamics.GAMMA)
        moved = link_kg * acceleration[:18].reshape(6, 3).sum(axis=0) + body_kg * acceleration[18:21]
        own, _ = body_loads(body, parts.rot.T @ (air[6:9] - parts.velocity), parts.rate, air[9])
        drag = sum(link_drag(chain, air, i, *all_nodes(chain, parts)) for i in range(7))
        weight = (ROPE.mass_per_m * ROPE.length_m + body.mass_kg) * air[:3]
        pull = dynamics.pull_on_hook(chain.constants, state, air)
        np.testing.assert_allclose(pull, drag + parts.rot @ own + weight - moved, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize(("speed_mps", "mass_kg"), [(25.0, 80.0), (70.0, 80.0), (25.0, 20.0), (70.0, 20.0)])
def test_trail_is_that_of_a_continuous_rope(speed_mps: float, mass_kg: float) -> None:
    chain, exact = point_chain(mass_kg), continuous_trail(ROPE, mass_kg, 0.06, speed_mps)
    found = find_equilibrium(chain, speed_mps, AIR)
    assert found is not None
    assert math.degrees(found.trail) == pytest.approx(math.degrees(exact), abs=0.05)
    # let go off its shape it comes back to it
    pushed = tilted(chain, tilted(chain, at_rest(chain, speed_mps), 0.03), 0.03, "y")
    flown = trail_flown(chain, pushed, speed_mps, 400.0)
    assert math.degrees(flown) == pytest.approx(math.degrees(exact), abs=0.05)


def test_trail_comes_closer_to_the_continuous_rope_with_the_square_of_the_links() -> None:
    exact = continuous_trail(ROPE, 20.0, 0.06, 70.0)
    found = [find_equilibrium(point_chain(20.0, links=links), 70.0, AIR) for links in (5, 10, 20, 40)]
    errors = [abs(one.trail - exact) for one in found if one is not None]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 2.0, atol=0.2)


def test_small_swing_is_that_of_a_rope_that_bends() -> None:
    """Within 0.3 % of the compound pendulum; and 1 / N^2 from the Bessel functions of a rope that bends."""
    assert pendulum_s(point_chain()) == pytest.approx(compound_period(ROPE, 80.0), rel=3e-3)
    errors = [pendulum_s(point_chain(20.0, links=links)) / flexible_period(ROPE, 20.0) - 1.0 for links in (3, 6, 12)]
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 2.0, atol=0.02)
    assert errors[-1] < 1e-4


@pytest.mark.parametrize(
    ("body", "number", "expected"),
    [(body, k, expected) for body, table in DECAY.items() for k, expected in enumerate(table) if k in {0, 2, 4}],
)
def test_swing_to_the_side_dies_away(body: tuple[float, float], number: int, expected: tuple[float, float]) -> None:
    """Period and damping of another code, whose rope stretches, to one unit of their last digits."""
    period, damping = decays(*body, DECAY_MPS[number])
    assert period == pytest.approx(expected[0], abs=0.01)
    assert damping == pytest.approx(expected[1], abs=0.001)


@pytest.mark.parametrize("chain", [bird_chain(), point_chain()], ids=["bird", "ball"])
def test_links_keep_their_length_and_swings_their_energy(chain: Chain) -> None:
    assert link_error_m(chain) < 1e-6
    assert energy_drift(chain) < 1e-4


def test_error_of_a_link_dies_away_as_baumgarte_says() -> None:
    chain = point_chain(links=4)
    state = at_rest(chain, 1.0, 0.0)
    state[8] += 1e-4
    time, rows, _ = states(chain, state, level(0.0, 0.0), seconds=1.0, step_hz=240, log_hz=30)
    left = np.array([lengths_m(chain, row) - 7.5 for row in rows])
    dying = 1e-4 * (1.0 + dynamics.GAMMA * time) * np.exp(-dynamics.GAMMA * time)
    np.testing.assert_allclose(left, dying[:, None] * [0.0, 0.0, 1.0, -1.0], atol=1e-9)


def test_steps_converge_with_the_fourth_order() -> None:
    finest = swayed(10, 480)
    errors = [apart(swayed(10, step_hz), finest)[1] for step_hz in (60, 120)]
    assert math.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.3)
    assert errors[0] < 0.001


@pytest.mark.parametrize(("links", "step_hz"), [(5, 20), (10, 30), (20, 60)])
def test_steps_are_stable_up_to_the_tension_that_is_said(links: int, step_hz: int) -> None:
    assert point_chain(links=links).stable_tension_n(step_hz) == pytest.approx(
        2.0 * 0.12 * (30.0 / links * step_hz) ** 2, rel=1e-14
    )
    assert is_stable(links, step_hz, 0.8)
    assert not is_stable(links, step_hz, 1.3)


def test_plane_of_a_swing_at_the_pole_turns_against_the_earth() -> None:
    """Foucault: the fixed star's plane, clockwise from above, once in a sidereal day."""
    assert foucault_error_pct() < 1.0


def test_a_hook_that_swings_as_hard_as_is_allowed_makes_no_rope_slack() -> None:
    """Slow and fast; three and a half times as hard it does."""
    for speed in (28.0, 75.0):
        assert whipped(speed, WHIP_G)[0] > 100.0
        assert whipped(speed, 3.5 * WHIP_G)[0] < 0.0

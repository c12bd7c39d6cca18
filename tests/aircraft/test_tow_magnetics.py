"""The bird and the helicopter as magnetic bodies, against what is published and against their own facts."""

import numpy as np
import pytest

from magsim.aircraft import load_aircraft, load_bird
from magsim.field import load_response, outline
from magsim.field.response import response_at
from tests.benchmarks.aircraft_levels import (
    BELOW_M,
    EARTH_002_N,
    VIBRATION_DEG,
    scalar_change,
    steady_nt,
    swing_nt,
)


@pytest.fixture(scope="module")
def bird():
    return load_bird("bird")


@pytest.fixture(scope="module")
def helicopter():
    return load_aircraft("helicopter")


def test_the_nose_sees_what_paper_002_reports(bird):
    """The magnetic interference is about 5 nT."""
    _, swung, _, vibration = swing_nt(bird, load_response(bird))["nose"]
    assert swung == pytest.approx(5.0, abs=1.0)
    assert 0.05 < vibration / VIBRATION_DEG < 0.2  # some tenths of a nanotesla for a few degrees


def test_the_scalar_change_is_that_of_tolles_and_lawson(bird):
    """To first order p u + F u D u, with the direction from the angles themselves."""
    response = load_response(bird)
    steady, induced = steady_nt(bird, response)[0], response.induced[0]
    heading, pitch = np.radians([70.0, 12.0])
    north, east, down = EARTH_002_N
    ahead, right = north * np.cos(heading) + east * np.sin(heading), east * np.cos(heading) - north * np.sin(heading)
    field = np.array(
        [ahead * np.cos(pitch) - down * np.sin(pitch), right, ahead * np.sin(pitch) + down * np.cos(pitch)]
    )
    strength = np.linalg.norm(field)
    expected = steady @ field / strength + field @ induced @ field / strength
    assert scalar_change(steady, induced, np.array([0.0, 12.0, 70.0])) == pytest.approx(expected, abs=2e-3)


def test_the_helicopter_can_be_ignored_in_the_bird(bird, helicopter):
    """Paper 002. Whatever the heading: all that stays, the induced field at its largest, the rotors."""
    response = response_at(helicopter, BELOW_M)
    stays = np.linalg.norm(steady_nt(helicopter, response), axis=1)
    induced = np.linalg.norm(response.induced, ord=2, axis=(1, 2)) * np.linalg.norm(EARTH_002_N)
    arms = np.array(list(BELOW_M.values()))[:, None] - [dipole.position_m for dipole in helicopter.magnetics.rotating]
    moments = np.linalg.norm([dipole.moment_am2 for dipole in helicopter.magnetics.rotating], axis=1)
    turning = (200.0 * moments / np.linalg.norm(arms, axis=2) ** 3).sum(axis=1)  # 200 nT m^3 / (A m^2) on the axis
    assert np.all(stays + induced + turning < 1.0)
    assert np.all(stays > 0.05)  # and yet it is there


def test_the_bird_is_drawn_as_its_facts_say(bird):
    body, fins = bird.facts.body, bird.facts.fins
    shells = outline(bird.magnetics.outline)
    size = np.ptp(shells.of("body").vertices, axis=0)
    assert size[0] == pytest.approx(body.length.value, abs=1e-9)
    assert size[2] == pytest.approx(body.diameter.value, rel=0.01)  # sections are polygons
    for name, across in (("fins_side", 1), ("fins_up", 2)):
        corners = shells.of(name).vertices
        extent = np.ptp(corners, axis=0)
        assert extent[0] * extent[across] == pytest.approx(fins.area.value, rel=0.02)
        assert corners[:, 0].mean() == pytest.approx(fins.station.value, abs=0.01)
        assert 0.25 * extent[across] == pytest.approx(fins.radius.value, rel=0.02)


def test_rope_end_and_hook_lie_where_the_rope_is_tied(bird, helicopter):
    shackle = next(part for part in bird.magnetics.steel if part.name == "shackle")
    assert shackle.center_m == bird.facts.body.bridle.value
    hook = next(part for part in helicopter.magnetics.steel if part.name == "cargo_hook")
    assert hook.clearance_m(helicopter.facts.hook_b) < 0.0


def test_the_helicopter_is_as_long_as_published(helicopter):
    whole = outline(helicopter.magnetics.outline)
    assert np.ptp(whole.extent_m, axis=0)[0] == pytest.approx(10.9, abs=0.05)  # Airbus Helicopters, H125: facts.toml


def test_every_group_says_where_it_comes_from(bird, helicopter):
    for magnetics in (bird.magnetics, helicopter.magnetics):
        groups = (*magnetics.mounts.values(), *magnetics.permanent, *magnetics.rotors.values(), *magnetics.rotating)
        parts = (*magnetics.steel, *magnetics.coils, *magnetics.outline.parts, magnetics.memory)
        assert all(len(group.source) >= 10 for group in (*groups, *parts))

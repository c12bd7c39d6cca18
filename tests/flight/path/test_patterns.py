"""Paths: the plane, the shape of a turn, box and cloverleaf."""

import math
from itertools import pairwise

import numpy as np
import pytest

from magsim.earth import ecef_from_geodetic, rot_ne_at
from magsim.errors import RequestError
from magsim.flight.path.dubins import connect, displacement
from magsim.flight.path.elements import Element, PathLabel, PathPoint, TurnShape, length_of, turn_radius, turn_shape
from magsim.flight.path.patterns import path_of
from magsim.flight.path.plane import LocalPlane
from magsim.scenario import Box, Cloverleaf, Diamond, Fom, HeadingCross, PatternSequence, StraightLine
from magsim.units import G0


@pytest.mark.parametrize("lat_deg", [-60.0, 0.0, 16.72, 88.9])
def test_plane_is_the_tangent_of_the_ellipsoid(lat_deg: float) -> None:
    lat, lon, alt = math.radians(lat_deg), 2.0, 3000.0
    plane = LocalPlane(lat, lon, alt)
    there = lat + 1.1e-3, lon + 0.9e-3
    offset_n = rot_ne_at(lat, lon) @ (ecef_from_geodetic(*there, alt) - ecef_from_geodetic(lat, lon, alt))
    velocity_e = rot_ne_at(*there).T @ np.array([30.0, -60.0, 0.0])
    expected = (*offset_n[:2], *(rot_ne_at(lat, lon) @ velocity_e)[:2])
    np.testing.assert_allclose(plane.motion(*there, 30.0, -60.0), expected, atol=1e-6)


@pytest.mark.parametrize("lat_deg", [-89.0, -45.0, 0.0, 88.5])
def test_plane_there_and_back(lat_deg: float) -> None:
    plane = LocalPlane(math.radians(lat_deg), 3.1, 2000.0)
    for place in [(0.0, 0.0), (12000.0, -9000.0), (-5000.0, 30000.0)]:
        np.testing.assert_allclose(plane.place(*plane.geodetic(*place)), place, atol=1e-3)


def test_turn_radius_balances_the_bank() -> None:
    radius = turn_radius(75.0, 25.0)
    assert 75.0**2 / radius == pytest.approx(G0 * math.tan(math.radians(25.0)))
    assert radius == pytest.approx(1230.0, abs=1.0)


def test_a_turn_without_easing_is_an_arc() -> None:
    shape = TurnShape(1000.0, 1e-6)
    assert shape.length_m == pytest.approx(500.0 * math.pi)
    assert shape.offset_m == pytest.approx(1000.0, abs=1e-3)
    forward, right, turned, curvature = shape.at(250.0 * math.pi)
    np.testing.assert_allclose(
        [forward, right, turned, curvature],
        [1000.0 * math.sqrt(0.5), 1000.0 * (1.0 - math.sqrt(0.5)), math.pi / 4.0, 1e-3],
        rtol=1e-6,
    )


@pytest.mark.parametrize(("radius", "ease"), [(1230.0, 300.0), (400.0, 900.0)])
def test_an_eased_turn_is_smooth_and_turns_a_quarter(radius: float, ease: float) -> None:
    shape = TurnShape(radius, ease)
    along = np.linspace(-50.0, shape.length_m + 50.0, 4001)
    forward, right, turned, curvature = np.array([shape.at(s) for s in along]).T
    step = along[1] - along[0]
    np.testing.assert_allclose(np.hypot(np.diff(forward), np.diff(right)), step, rtol=2e-3)
    np.testing.assert_allclose(np.gradient(turned, step)[1:-1], curvature[1:-1], atol=2e-5)
    middle = 0.5 * (turned[1:] + turned[:-1])
    np.testing.assert_allclose(np.diff(forward), step * np.cos(middle), atol=2e-3)
    assert curvature.max() == pytest.approx(1.0 / radius)
    assert np.abs(np.diff(curvature)).max() < 2.0 * step / (radius * min(ease, 0.4 * math.pi * radius))
    # Both tangents meet in the corner: as far before it as behind it.
    assert shape.at(shape.length_m)[:2] == pytest.approx((shape.offset_m, shape.offset_m), abs=1e-6)
    assert turned[-1] == pytest.approx(0.5 * math.pi)


@pytest.mark.parametrize("side", ["right", "left"])
def test_a_box_closes(side: str) -> None:
    path = path_of(Box(circuits=2, leg_m=4000.0, turn=side), 30.0, 75.0, 4.0)
    legs = [element for element in path if not element.turn]
    sign = 1.0 if side == "right" else -1.0
    assert [leg.heading_deg for leg in legs] == [(30.0 + sign * 90.0 * i) % 360.0 for i in range(8)]
    assert [(leg.circuit, leg.leg) for leg in legs] == [(c, n) for c in (1, 2) for n in (1, 2, 3, 4)]
    assert all(leg.length_m == 4000.0 for leg in legs)
    for before, after in pairwise(path):
        end, begin = before.at(before.length_m), after.at(0.0)
        np.testing.assert_allclose(end[:2], begin[:2], atol=1e-6)
        assert end.course == pytest.approx(begin.course)
    np.testing.assert_allclose(path[-1].at(path[-1].length_m)[:2], (0.0, 0.0), atol=1e-6)
    assert length_of(path) == pytest.approx(8 * 4000.0 + 8 * path[1].length_m)


@pytest.mark.parametrize(("side", "headings"), [("right", [0, 270, 180, 90]), ("left", [0, 90, 180, 270])])
def test_a_cloverleaf_passes_its_center_on_four_headings(side: str, headings: list[float]) -> None:
    path = path_of(Cloverleaf(leaf_m=5000.0, turn=side), 0.0, 75.0, 4.0)
    passes = [element for element in path if not element.turn]
    assert [leg.heading_deg for leg in passes] == headings
    for leg in passes:
        assert leg.length_m == 10_000.0
        middle = leg.at(5000.0)
        np.testing.assert_allclose(middle[:2], (0.0, 0.0), atol=1e-6)
        assert math.degrees(middle.course) % 360.0 == pytest.approx(leg.heading_deg % 360.0, abs=1e-9)
    assert not path[-1].turn


def test_turns_must_fit_into_the_leaves() -> None:
    with pytest.raises(RequestError, match=r"pattern\.leaf_m: turns of 5 deg bank .* allowed: a leaf of at least"):
        path_of(Cloverleaf(leaf_m=5000.0, bank_deg=5.0), 0.0, 75.0, 4.0)


def assert_whole(path: tuple[Element, ...]) -> None:
    """Elements follow each other without a jump of place or course."""
    for before, after in pairwise(path):
        end, begin = before.at(before.length_m), after.at(0.0)
        np.testing.assert_allclose(end[:2], begin[:2], atol=1e-5)
        assert math.cos(end.course - begin.course) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("angle", [0.05, 0.5, 0.5 * math.pi, 2.5, 6.0])
def test_displacement_is_that_of_the_turn(angle: float) -> None:
    forward, right, length = displacement(1230.0, 300.0, angle)
    shape = turn_shape(max(1230.0, 300.0 / (0.8 * angle)), 300.0, angle)
    np.testing.assert_allclose(shape.at(shape.length_m)[:3], (forward, right, angle), atol=1e-6)
    assert shape.length_m == pytest.approx(length)
    # Behind its end a turn goes on straight.
    beyond = shape.at(shape.length_m + 100.0)
    assert beyond[0] == pytest.approx(forward + 100.0 * math.cos(angle), abs=1e-6)
    assert beyond[1] == pytest.approx(right + 100.0 * math.sin(angle), abs=1e-6)


def test_any_place_is_reached_on_any_course() -> None:
    rng = np.random.default_rng(3)
    label = PathLabel(1, 1, True, 0.0)
    for _ in range(20):
        north, east = rng.uniform(-5000.0, 5000.0, 2)
        start, stop = (
            PathPoint(0.0, 0.0, rng.uniform(-4.0, 4.0), 0.0),
            PathPoint(north, east, rng.uniform(-4.0, 4.0), 0.0),
        )
        way = connect(start, stop, 1230.0, 300.0, label)
        assert_whole(way)
        end = way[-1].at(way[-1].length_m)
        np.testing.assert_allclose(end[:2], (north, east), atol=1e-4)
        assert math.cos(end.course - stop.course) == pytest.approx(1.0, abs=1e-12)
        assert length_of(way) >= math.hypot(north, east)


def test_a_way_is_no_longer_than_it_must_be() -> None:
    label, start = PathLabel(1, 1, True, 0.0), PathPoint(0.0, 0.0, 0.0, 0.0)
    assert connect(start, start, 1000.0, 1.0, label) == ()
    assert length_of(connect(start, PathPoint(5000.0, 0.0, 0.0, 0.0), 1000.0, 1.0, label)) == 5000.0
    # Dubins' length of a turn by 180 degrees two radii and a little across: half a circle.
    across = connect(start, PathPoint(0.0, 2005.0, math.pi, 0.0), 1000.0, 1.0, label)
    assert length_of(across) == pytest.approx(math.pi * 1000.0 + 5.0, abs=3.0)
    # A quarter turn, a straight and a quarter turn.
    wide = connect(start, PathPoint(0.0, 7000.0, math.pi, 0.0), 1000.0, 1.0, label)
    assert length_of(wide) == pytest.approx(math.pi * 1000.0 + 5000.0, rel=2e-3)
    # Back over the same place: the shortest of all ways, three arcs, has 7/3 pi R; with two turns a quarter more.
    back = connect(start, PathPoint(0.0, 0.0, math.pi, 0.0), 1000.0, 1.0, label)
    assert 7.0 / 3.0 * math.pi * 1000.0 < length_of(back) < 1.25 * 7.0 / 3.0 * math.pi * 1000.0


def test_sides_are_flown_in_any_order() -> None:
    path = path_of(Box(circuits=2, leg_m=4000.0, order=(1, 3, 2, 4)), 0.0, 75.0, 4.0)
    assert_whole(path)
    legs = [element for element in path if not element.turn]
    plain = [element for element in path_of(Box(leg_m=4000.0), 0.0, 75.0, 4.0) if not element.turn]
    assert [leg.heading_deg for leg in legs] == [0.0, 180.0, 90.0, 270.0] * 2
    assert [(leg.circuit, leg.leg, leg.label.leg_index) for leg in legs][4:6] == [(2, 1, 4), (2, 2, 5)]
    for leg, side in zip(legs[:4], (plain[0], plain[2], plain[1], plain[3]), strict=True):
        np.testing.assert_allclose(leg.at(0.0)[:2], side.at(0.0)[:2], atol=1e-6)
    np.testing.assert_allclose(path[-1].at(path[-1].length_m)[:2], (0.0, 0.0), atol=1e-5)


def test_a_heading_cross_passes_its_center_on_every_heading() -> None:
    cross = HeadingCross(circuits=3, leg_m=4000.0, turned_deg=(0.0, 90.0, 225.0), north_m=500.0, east_m=-200.0)
    path = path_of(cross, 30.0, 75.0, 4.0)
    assert_whole(path)
    passes = [element for element in path if not element.turn]
    assert [leg.heading_deg for leg in passes] == [30.0, 120.0, 255.0] * 3
    assert [(leg.circuit, leg.leg) for leg in passes] == [(c, n) for c in (1, 2, 3) for n in (1, 2, 3)]
    for leg in passes:
        np.testing.assert_allclose(leg.at(2000.0)[:2], (500.0, -200.0), atol=1e-5)


def test_a_straight_is_one_line() -> None:
    (line,) = path_of(StraightLine(leg_m=7000.0), 60.0, 75.0, 4.0)
    assert (line.length_m, line.heading_deg, line.turn) == (7000.0, 60.0, False)
    np.testing.assert_allclose(line.at(7000.0)[:2], (3500.0, 7000.0 * math.sqrt(0.75)))


def test_a_sequence_is_joined_by_transits() -> None:
    parts = (
        Diamond(leg_m=3000.0, turn="left", heading_deg=45.0),
        Cloverleaf(leaf_m=3000.0, north_m=8000.0, east_m=2000.0, heading_deg=90.0),
        Fom(circuits=2, leg_m=10_000.0),
        StraightLine(east_m=-9000.0),
    )
    path = path_of(PatternSequence(parts=parts), 0.0, 75.0, 4.0)
    assert_whole(path)
    legs = [element for element in path if not element.turn]
    assert [leg.circuit for leg in legs] == [1] * 4 + [2] * 4 + [3] * 4 + [4] * 4 + [5]
    assert [leg.label.part for leg in legs] == [0] * 4 + [1] * 4 + [2] * 8 + [3]
    assert [leg.label.leg_index for leg in legs] == [*range(4), *range(4), *range(8), 0]
    assert [leg.heading_deg for leg in legs[:5]] == [45.0, 315.0, 225.0, 135.0, 90.0]
    transits = {element.circuit for element in path if element.label.transit}
    assert transits == {1, 2, 4}
    assert all(element.turn for element in path if element.label.transit)
    for leg in legs[4:8]:
        np.testing.assert_allclose(leg.at(3000.0)[:2], (8000.0, 2000.0), atol=1e-5)
    np.testing.assert_allclose(legs[-1].at(0.0)[:2], (0.0, -9000.0), atol=1e-9)

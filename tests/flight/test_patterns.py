"""Paths: the plane, the shape of a turn, box and cloverleaf."""

import math
from itertools import pairwise

import numpy as np
import pytest

from magsim.earth import ecef_from_geodetic, rot_ne_at
from magsim.errors import RequestError
from magsim.flight.patterns import LocalPlane, TurnShape, length_of, path_of, turn_radius
from magsim.scenario import Box, Cloverleaf
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

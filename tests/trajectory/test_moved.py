"""The motion of another point of the body, against its place in inertial or Earth-fixed axes."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.earth import ecef_from_geodetic, rot_ne_at
from magsim.frames import rot_nb_from_attitude
from tests.sensors.test_inertial import derivative, lively, trajectory

ARM = np.array([-6.0, 2.0, -1.5])


def place_e(t, arm=ARM):
    """Place of the moved point, Earth-fixed axes, from the formulas of the flight."""
    lat, lon, alt, attitude = lively(t)
    arm_n = np.einsum("nij,j->ni", rot_nb_from_attitude(attitude), arm)
    return ecef_from_geodetic(lat, lon, alt) + np.einsum("nji,nj->ni", rot_ne_at(lat, lon), arm_n)


def test_place_and_velocity_are_those_of_the_point():
    path = trajectory()
    moved = path.moved_to(ARM)
    np.testing.assert_allclose(
        ecef_from_geodetic(moved.lat_rad, moved.lon_rad, moved.alt_m), place_e(path.time_s), atol=1e-6
    )
    velocity_n = np.einsum("nij,nj->ni", rot_ne_at(moved.lat_rad, moved.lon_rad), derivative(place_e, path.time_s))
    np.testing.assert_allclose(moved.velocity_n, velocity_n, atol=1e-5)
    np.testing.assert_array_equal(moved.reference_b, ARM)


def test_the_body_is_turned_as_before():
    path = trajectory()
    moved = path.moved_to(ARM)
    before, after = (
        np.swapaxes(rot_ne_at(one.lat_rad, one.lon_rad), 1, 2) @ rot_nb_from_attitude(one.attitude)
        for one in (path, moved)
    )
    np.testing.assert_allclose(after, before, atol=1e-12)
    # Other local axes, a meter of the Earth's radius away: 1e-6 rad.
    assert 1e-8 < np.abs(moved.attitude - path.attitude).max() < 5e-6
    np.testing.assert_allclose(moved.rate_b, path.rate_b, atol=1e-6)


def test_there_and_back():
    path = trajectory()
    back = path.moved_to(ARM).moved_to(path.reference_b)
    np.testing.assert_allclose(back.alt_m, path.alt_m, atol=1e-7)
    np.testing.assert_allclose(back.lat_rad, path.lat_rad, atol=1e-14)
    np.testing.assert_allclose(back.velocity_n, path.velocity_n, atol=1e-9)
    np.testing.assert_allclose(back.attitude, path.attitude, atol=1e-12)


@pytest.mark.parametrize("lon", [np.pi - 1e-7, 3.0 * np.pi - 1e-7])
def test_longitude_and_heading_stay_continuous(lon):
    path = trajectory()
    turned = path.attitude + np.array([0.0, 0.0, 4.0 * np.pi])
    shifted = replace(path, lon_rad=path.lon_rad - path.lon_rad[0] + lon, attitude=turned)
    moved = shifted.moved_to(ARM)
    assert np.abs(moved.lon_rad - shifted.lon_rad).max() < 1e-5
    assert np.abs(moved.attitude - shifted.attitude).max() < 1e-5

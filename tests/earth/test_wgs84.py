import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from magsim.earth import (
    ecef_from_geodetic,
    geodetic_from_ecef,
    quaternion_en_at,
    radii_of_curvature,
    rot_ne_at,
    transport_rate,
)
from magsim.earth.wgs84 import SEMI_MAJOR_M, SEMI_MINOR_M


def test_defining_radii():
    # WGS 84: derived polar radius as NIMA TR8350.2, table 3.3 prints it.
    assert pytest.approx(6356752.3142, abs=5e-5) == SEMI_MINOR_M
    np.testing.assert_allclose(ecef_from_geodetic(0.0, 0.0, 10.0), [SEMI_MAJOR_M + 10.0, 0.0, 0.0])
    np.testing.assert_allclose(ecef_from_geodetic(np.pi / 2, 1.0, 5.0), [0.0, 0.0, SEMI_MINOR_M + 5.0], atol=1e-8)
    np.testing.assert_allclose(ecef_from_geodetic(0.0, np.pi / 2, 0.0), [0.0, SEMI_MAJOR_M, 0.0], atol=1e-8)


def test_height_is_along_the_normal():
    lat, lon = 0.6, -2.0
    step = ecef_from_geodetic(lat, lon, 1000.0) - ecef_from_geodetic(lat, lon, 0.0)
    np.testing.assert_allclose(rot_ne_at(lat, lon) @ step, [0.0, 0.0, -1000.0], atol=1e-8)


@given(
    st.floats(-np.pi / 2, np.pi / 2),
    st.floats(-np.pi + 1e-9, np.pi),
    st.floats(-500.0, 20e3),
)
def test_round_trip(lat, lon, alt):
    back_lat, back_lon, back_alt = geodetic_from_ecef(ecef_from_geodetic(lat, lon, alt))
    assert back_lat == pytest.approx(lat, abs=np.radians(1e-12))
    assert back_alt == pytest.approx(alt, abs=1e-7)
    assert np.cos(lat) * np.sin((back_lon - lon) / 2) == pytest.approx(0.0, abs=1e-15)


def test_round_trip_of_satellites():
    rng = np.random.default_rng(0)
    lat, lon, alt = np.arcsin(rng.uniform(-1, 1, 1000)), rng.uniform(-3, 3, 1000), rng.uniform(2e4, 3.6e7, 1000)
    back = geodetic_from_ecef(ecef_from_geodetic(lat, lon, alt))
    np.testing.assert_allclose(back[0], lat, rtol=0, atol=1e-13)
    np.testing.assert_allclose(back[2], alt, rtol=0, atol=1e-6)


def test_axes_are_a_rotation_of_known_directions():
    rot = rot_ne_at(np.array([0.0, 0.7]), np.array([0.0, 2.0]))
    np.testing.assert_allclose(rot @ np.swapaxes(rot, 1, 2), np.broadcast_to(np.eye(3), (2, 3, 3)), atol=1e-15)
    np.testing.assert_allclose(np.linalg.det(rot), 1.0)
    # At latitude 0, longitude 0: north is Z, east is Y, down is -X.
    np.testing.assert_allclose(rot[0], [[0, 0, 1], [0, 1, 0], [-1, 0, 0]], atol=1e-15)


@pytest.mark.parametrize("lat", [-1.2, 0.0, 0.3, 0.9])
def test_radii_are_those_of_small_steps(lat):
    meridian, normal = radii_of_curvature(lat)
    alt, step = 1500.0, 1e-5
    north = (ecef_from_geodetic(lat + step, 0.4, alt) - ecef_from_geodetic(lat - step, 0.4, alt)) / (2 * step)
    east = (ecef_from_geodetic(lat, 0.4 + step, alt) - ecef_from_geodetic(lat, 0.4 - step, alt)) / (2 * step)
    rot = rot_ne_at(lat, 0.4)
    np.testing.assert_allclose(rot @ north, [meridian + alt, 0, 0], atol=1e-2)
    np.testing.assert_allclose(rot @ east, [0, (normal + alt) * np.cos(lat), 0], atol=1e-2)


def test_quaternions_of_the_axes_are_their_matrices():
    rng = np.random.default_rng(0)
    lat, lon = np.arcsin(rng.uniform(-1, 1, 200)), rng.uniform(-4, 4, 200)
    turned = Rotation.from_quat(quaternion_en_at(lat, lon), scalar_first=True).as_matrix()
    np.testing.assert_allclose(np.swapaxes(turned, 1, 2), rot_ne_at(lat, lon), atol=1e-15)


def test_the_axes_turn_with_the_motion_over_the_earth():
    lat, lon, alt, velocity = np.array([0.9]), np.array([0.4]), np.array([1500.0]), np.array([[40.0, -60.0, 3.0]])
    meridian, normal = radii_of_curvature(lat)
    lat_rate, lon_rate = velocity[:, 0] / (meridian + alt), velocity[:, 1] / ((normal + alt) * np.cos(lat))
    step = 10.0
    before, after = (
        Rotation.from_matrix(rot_ne_at(lat + s * lat_rate, lon + s * lon_rate)).inv() for s in (-step, step)
    )
    # Turned from before to after, seen in the axes themselves.
    turned = (before.inv() * after).as_rotvec() / (2.0 * step)
    np.testing.assert_allclose(transport_rate(lat, alt, velocity), turned, rtol=1e-7)

"""UTM is the one conformal projection whose central meridian is straight and true to scale: both are tested."""

import numpy as np
import pytest
from scipy.integrate import quad

from magsim.earth import radii_of_curvature, utm, utm_zone


@pytest.mark.parametrize("lat_deg", [-80.0, -33.0, 0.0, 5.0, 45.3, 84.0])
def test_the_central_meridian_has_the_length_of_the_ellipsoid(lat_deg):
    length, _ = quad(lambda lat: float(radii_of_curvature(lat)[0]), 0.0, np.radians(lat_deg), epsabs=1e-9, epsrel=1e-13)
    east, north = utm(np.radians(lat_deg), np.radians(-75.0), zone=18, south=False)
    assert east == 500_000.0
    assert north == pytest.approx(0.9996 * length, abs=1e-6)


@pytest.mark.parametrize("lat_deg", [-70.0, -33.0, 0.0, 45.3, 80.0])
@pytest.mark.parametrize("offset_deg", [-3.0, 0.5, 3.0])
def test_angles_are_kept(lat_deg, offset_deg):
    lat, lon, step = np.radians(lat_deg), np.radians(-75.0 + offset_deg), 1e-5
    east, north = (
        np.array(side)
        for side in zip(
            *(utm(lat + a, lon + b, zone=18, south=False) for a, b in ((step, 0), (-step, 0), (0, step), (0, -step))),
            strict=True,
        )
    )
    meridian, normal = radii_of_curvature(lat)
    along_north = np.array([east[0] - east[1], north[0] - north[1]]) / (2.0 * step * meridian)
    along_east = np.array([east[2] - east[3], north[2] - north[3]]) / (2.0 * step * normal * np.cos(lat))
    np.testing.assert_allclose(along_east, [along_north[1], -along_north[0]], atol=2e-9)


def test_a_published_place():
    """CN Tower, 43 38 33.24 N 79 23 13.7 W: zone 17, 630084 m E, 4833438 m N (Wikipedia, UTM; rounded to 3 m)."""
    lat, lon = 43.0 + 38.0 / 60.0 + 33.24 / 3600.0, -(79.0 + 23.0 / 60.0 + 13.7 / 3600.0)
    assert utm_zone(lat, lon) == 17
    east, north = utm(np.radians(lat), np.radians(lon), zone=17, south=False)
    assert float(east) == pytest.approx(630_084.0, abs=1.5)
    assert float(north) == pytest.approx(4_833_438.0, abs=1.5)


def test_zones_and_the_southern_half():
    assert [utm_zone(0.0, lon) for lon in (-180.0, -75.5, 0.0, 179.99, 180.0)] == [1, 18, 31, 60, 1]
    assert [utm_zone(60.0, 5.0), utm_zone(60.0, 2.9), utm_zone(78.0, 8.0), utm_zone(78.0, 9.5)] == [32, 31, 31, 33]
    _, north = utm(np.radians(-33.0), np.radians(151.0), zone=56, south=True)
    _, mirrored = utm(np.radians(33.0), np.radians(151.0), zone=56, south=False)
    assert north == pytest.approx(10_000_000.0 - mirrored, abs=1e-6)

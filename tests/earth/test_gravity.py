"""Normal gravity against the gradient of the ellipsoid's potential in spherical harmonics."""

import numpy as np
import pytest

from magsim.earth.gravity import EQUATOR_MPS2, GM_M3PS2, POLE_MPS2, SPIN_RADPS, gravity_n
from magsim.earth.wgs84 import SEMI_MAJOR_M, ecef_from_geodetic, rot_ne_at

EVEN = {2: 1.082629821e-3, 4: -2.37091120e-6, 6: 6.08347e-9}
"""Zonal coefficients J2, J4, J6 of the WGS-84 ellipsoid (Moritz, Geodetic Reference System 1980, series for J2n)."""


def potential(place_e: np.ndarray) -> float:
    r = np.linalg.norm(place_e)
    s = place_e[2] / r
    legendre = {
        2: (3 * s**2 - 1) / 2,
        4: (35 * s**4 - 30 * s**2 + 3) / 8,
        6: (231 * s**6 - 315 * s**4 + 105 * s**2 - 5) / 16,
    }
    zonal = 1.0 - sum(j * (SEMI_MAJOR_M / r) ** n * legendre[n] for n, j in EVEN.items())
    return GM_M3PS2 / r * zonal + 0.5 * SPIN_RADPS**2 * (place_e[0] ** 2 + place_e[1] ** 2)


@pytest.mark.parametrize("lat_deg", [-70.0, 0.0, 30.0, 45.0, 89.0])
@pytest.mark.parametrize("alt_m", [0.0, 3000.0, 10_000.0])
def test_it_is_the_gradient_of_the_potential(lat_deg, alt_m):
    lat, lon, step = np.radians(lat_deg), 0.3, 20.0
    place_e = ecef_from_geodetic(lat, lon, alt_m)
    pull_e = [(potential(place_e + step * e) - potential(place_e - step * e)) / (2.0 * step) for e in np.eye(3)]
    assert gravity_n(lat, alt_m) == pytest.approx(rot_ne_at(lat, lon) @ pull_e, abs=1e-6)


def test_on_the_ellipsoid_it_is_the_standards():
    assert gravity_n(0.0, 0.0)[2] == pytest.approx(EQUATOR_MPS2, abs=1e-10)
    assert gravity_n(np.pi / 2.0, 0.0)[2] == pytest.approx(POLE_MPS2, abs=1e-10)
    assert gravity_n(np.radians([0.0, 45.0]), 1000.0).shape == (2, 3)

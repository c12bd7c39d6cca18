"""The standard atmosphere against the rows of its own table."""

import numpy as np
import pytest

from magsim.earth.atmosphere import geopotential_height, pressure_altitude, standard_density, standard_pressure

# ICAO Doc 7488 (1993), table 1: geometric height [m], geopotential height [m], pressure [Pa], density [kg/m^3].
DOC_7488 = """
-5000  -5004 177762 1.93113
-4996  -5000 177687 1.93047
-2500  -2501 135205 1.54731
    0      0 101325 1.22500
 1000   1000 89876.3 1.11166
 2000   1999 79501.4 1.00655
11000  10981 22699.9 0.364801
11019  11000 22632.0 0.363918
15000  14965 12111.8 0.194755
20000  19937 5529.29 0.0889097
20063  20000 5474.87 0.0880345
"""
ROWS = np.array([line.split() for line in DOC_7488.split("\n") if line], dtype=float)


def test_pressure_is_that_of_the_table_to_its_last_digit():
    """Six digits. The rows of whole geopotential heights tell their geometric height to a meter, so to 6e-5."""
    geometric, geopotential, pressure, _ = ROWS.T
    whole = np.isin(geopotential, [-5000.0, 11000.0, 20000.0])
    height = np.where(whole, geopotential, geopotential_height(geometric))
    np.testing.assert_allclose(standard_pressure(height), pressure, rtol=5e-6)
    np.testing.assert_allclose(geopotential_height(geometric), geopotential, rtol=0, atol=0.6)


def test_it_is_in_balance_with_its_own_weight():
    """Hydrostatics, ``dp = -rho g0 dH``, with the densities of the table."""
    below = ROWS[ROWS[:, 1] < 10_990.0]
    height, density = geopotential_height(below[:, 0]), below[:, 3]
    slope = (standard_pressure(height + 1.0) - standard_pressure(height - 1.0)) / 2.0
    np.testing.assert_allclose(-slope / 9.80665, density, rtol=1e-5)
    np.testing.assert_allclose(standard_density(height), density, rtol=1e-5)


def test_there_and_back():
    height = np.linspace(-5000.0, 20_000.0, 501)
    np.testing.assert_allclose(pressure_altitude(standard_pressure(height)), height, rtol=0, atol=1e-8)
    assert pressure_altitude(101_325.0) == pytest.approx(0.0, abs=1e-9)


def test_flight_levels():
    """One hectopascal more on the subscale is 27.3 feet more at the sea (ICAO Doc 7488, 8.32 m)."""
    assert pressure_altitude(101_225.0) == pytest.approx(8.325, abs=0.005)

"""Gusts of the Dryden form: strength and length by height, and the filters against the specification's spectra."""

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.signal import csd, welch

from magsim.flight.model.dryden import DrydenFilters, Gustiness, Strength
from magsim.units import FT

SPAN = 16.0
GUSTINESS = Gustiness(level_mps=1.5, vertical_mps=0.8, level_m=300.0, vertical_m=120.0)
WAY = 2.5
NODES = 120_000


@pytest.fixture(scope="module")
def gusts() -> np.ndarray:
    """Nodes of a long way, (n, 6); the first lengths, in which the smoothing settles, are left out."""
    rng = np.random.default_rng(4)
    filters = DrydenFilters(SPAN, rng.standard_normal(6))
    noise = rng.standard_normal((NODES, 6))
    return np.array([filters.advance(GUSTINESS, WAY, row) for row in noise])[1000:]


def specified(number: np.ndarray) -> np.ndarray:
    """One-sided spectra over the wave number [rad/m], (6, n): MIL-F-8785C, 3.7.2.1 and 3.7.2.2."""
    level, vertical, level_m, vertical_m = GUSTINESS
    x, y = level_m * number, vertical_m * number
    along = level**2 * 2.0 * level_m / math.pi / (1.0 + x**2)
    across = level**2 * level_m / math.pi * (1.0 + 3.0 * x**2) / (1.0 + x**2) ** 2
    down = vertical**2 * vertical_m / math.pi * (1.0 + 3.0 * y**2) / (1.0 + y**2) ** 2
    four, three = 4.0 * SPAN * number / math.pi, 3.0 * SPAN * number / math.pi
    share = 0.8 * (math.pi * vertical_m / (4.0 * SPAN)) ** (1.0 / 3.0)
    roll = vertical**2 / vertical_m * share / (1.0 + four**2)
    return np.array(
        [along, across, down, roll, number**2 / (1.0 + four**2) * down, number**2 / (1.0 + three**2) * across]
    )


def test_every_component_has_its_spectrum(gusts: np.ndarray) -> None:
    frequency, density = welch(gusts, 1.0 / WAY, nperseg=4096, axis=0)
    number = 2.0 * np.pi * frequency
    # Down to waves of 94 m, which nodes of 2.5 m do not alias.
    edges = np.geomspace(1.0 / 400.0, 1.0 / 15.0, 7)
    for low, high in pairwise(edges):
        band = (number >= low) & (number < high)
        expected = specified(number[band]).mean(axis=1)
        found = density[band].mean(axis=0) / (2.0 * np.pi)
        np.testing.assert_allclose(found, expected, rtol=0.15)


def test_every_component_has_its_strength(gusts: np.ndarray) -> None:
    # 1000 lengths along, 2500 down.
    np.testing.assert_allclose(gusts[:, :3].std(axis=0), [1.5, 1.5, 0.8], rtol=0.04)
    # Spectra of rotation are summed over all wave numbers.
    number = np.geomspace(1e-6, 1e3, 200_000)
    variance = np.trapezoid(specified(number), number, axis=1)
    np.testing.assert_allclose(variance[:3], [1.5**2, 1.5**2, 0.8**2], rtol=2e-3)
    np.testing.assert_allclose(gusts[:, 3].std(), math.sqrt(variance[3]), rtol=0.04)


def test_gusts_have_their_length(gusts: np.ndarray) -> None:
    lags = np.arange(1, 60)
    centered = gusts - gusts.mean(axis=0)
    found = np.array([(centered[k:] * centered[:-k]).mean(axis=0) for k in lags]) / gusts.var(axis=0)
    distance = WAY * lags
    # The inverse Fourier transforms of the spectra.
    np.testing.assert_allclose(found[:, 0], np.exp(-distance / 300.0), atol=0.04)
    for column, length in ((1, 300.0), (2, 120.0)):
        part = distance / length
        np.testing.assert_allclose(found[:, column], (1.0 - 0.5 * part) * np.exp(-part), atol=0.04)


def test_rotation_is_that_of_the_air_which_is_met(gusts: np.ndarray) -> None:
    # Over waves much longer than the aircraft: pitch is the slope of what rises, yaw that of what blows across.
    # A gust that grows downward along the way is air that pitches down: q = -dw/dx, r = dv/dx.
    frequency, both = csd(gusts[:, 2], gusts[:, 4], 1.0 / WAY, nperseg=4096)
    _, power = welch(gusts[:, 2], 1.0 / WAY, nperseg=4096)
    number = 2.0 * np.pi * frequency
    long = (number > 0.004) & (number < 0.008)
    np.testing.assert_allclose((both / power)[long].imag, -number[long], rtol=0.05)
    _, both = csd(gusts[:, 1], gusts[:, 5], 1.0 / WAY, nperseg=4096)
    _, power = welch(gusts[:, 1], 1.0 / WAY, nperseg=4096)
    np.testing.assert_allclose((both / power)[long].imag, number[long], rtol=0.05)
    # Roll has a noise of its own, and so have the three motions.
    mixed = np.corrcoef(gusts[:, :4].T) - np.eye(4)
    assert np.abs(mixed).max() < 0.05


def test_nodes_may_be_close_or_far() -> None:
    # The same statistics whatever the way between nodes: the step is exact.
    for way in (0.01, 40.0):
        rng = np.random.default_rng(5)
        runs = []
        for _ in range(3000):
            filters = DrydenFilters(SPAN, rng.standard_normal(6))
            rows = [filters.advance(GUSTINESS, way, row) for row in rng.standard_normal((3, 6))]
            runs.append([*rows[0][:3], *rows[2][:3]])
        found = np.array(runs)
        np.testing.assert_allclose(found.std(axis=0), [1.5, 1.5, 0.8] * 2, rtol=0.05)
        together = np.corrcoef(found.T)[:3, 3:].diagonal()
        level, vertical = 2.0 * way / 300.0, 2.0 * way / 120.0
        expected = [
            math.exp(-level),
            (1.0 - level / 2.0) * math.exp(-level),
            (1.0 - vertical / 2.0) * math.exp(-vertical),
        ]
        np.testing.assert_allclose(together, expected, atol=0.04)


def test_strength_in_the_free_air_is_read_from_figure_7() -> None:
    # MIL-F-8785C, figure 7, at its points and halfway between them.
    for severity, height_ft, fps in ((3, 7500.0, 6.7), (3, 11250.0, 5.65), (5, 15000.0, 11.6), (7, 90000.0, 7.2)):
        gustiness = Strength(severity).at(height_ft * FT)
        assert gustiness.level_mps == pytest.approx(fps * FT)
        assert gustiness[2:] == (1750.0 * FT, 1750.0 * FT)


def test_strength_and_length_near_the_ground() -> None:
    # MIL-F-8785C, figures 10 and 11, for light turbulence: 15 kt at 20 ft.
    height_ft = 400.0
    shape = 0.177 + 0.000823 * height_ft
    vertical = 1.5 * 1852.0 / 3600.0
    found = Strength(3).at(height_ft * FT)
    expected = (vertical / shape**0.4, vertical, height_ft * FT / shape**1.2, height_ft * FT)
    assert found == pytest.approx(expected)
    # At 1000 ft both lengths are 1000 ft; between 1000 and 2000 ft everything is straight.
    below, half, above = (Strength(3).at(feet * FT) for feet in (1000.0, 1500.0, 2000.0))
    assert below == pytest.approx((vertical, vertical, 1000.0 * FT, 1000.0 * FT))
    assert half == pytest.approx(np.add(below, above) / 2.0)
    assert Strength(3).at(0.0) == Strength(3).at(10.0 * FT)


@pytest.mark.parametrize("height_m", [5.0, 60.0, 305.0, 450.0, 1000.0, 3000.0, 4800.0, 9000.0, 15000.0, 25000.0])
def test_every_severity_is_stronger_than_the_one_before(height_m: float) -> None:
    strengths = [Strength(severity).at(height_m) for severity in range(1, 8)]
    assert strengths[0].vertical_mps > 0.1
    for weak, strong in pairwise(strengths):
        assert strong.vertical_mps >= 1.15 * weak.vertical_mps
        assert strong.level_mps >= 1.15 * weak.level_mps


def test_a_strength_in_mps_is_that_of_the_vertical_gusts_at_every_height() -> None:
    heights = (5.0, 100.0, 400.0, 3000.0, 20000.0)
    assert [Strength(vertical_mps=0.7).at(height).vertical_mps for height in heights] == pytest.approx([0.7] * 5)
    assert Strength(vertical_mps=0.7).at(100.0)[2:] == Strength(3).at(100.0)[2:]

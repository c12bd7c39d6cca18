"""The field of ocean waves against Weaver's figures, Lilley's formula, and the diffusion equation solved on a grid."""

import math

import numpy as np
import pytest
from scipy.linalg import solve_banded

from magsim.earth.sea import swell_rms_nt
from magsim.field.background.swell import SeaWaves, draw_waves
from magsim.scenario import Swell
from magsim.streams import stream

MU0, G = 4e-7 * math.pi, 9.80665


def one_wave(period_s: float, amplitude_m: float, toward_deg: float = 0.0) -> SeaWaves:
    angle = math.radians(toward_deg)
    return SeaWaves([2.0 * math.pi / period_s], [[math.cos(angle), math.sin(angle)]], [amplitude_m], [0.0])


def at_height(wave: SeaWaves, main_n: np.ndarray, height_m: float, conductivity: float = 4.4) -> np.ndarray:
    """The field over one period at a fixed place, (n, 3)."""
    time = np.linspace(0.0, 2.0 * math.pi / wave.rate[0], 400, endpoint=False)
    place = np.zeros((400, 3))
    return wave.field(wave.strength_nt(main_n, conductivity), place, np.full(400, height_m), time)


def test_the_figure_that_weaver_prints():
    """A swell of 20 s and 10 cm: 0.1 gamma 50 m above the sea (abstract)."""
    field = at_height(one_wave(20.0, 0.1), np.array([0.0, 0.0, 50_000.0]), 50.0, conductivity=4.0)
    largest = np.linalg.norm(field, axis=1).max()
    assert round(largest, 1) == 0.1


@pytest.mark.parametrize("period_s", [8.0, 13.0])
@pytest.mark.parametrize("toward_deg", [0.0, 35.0, 90.0, 200.0])
@pytest.mark.parametrize("height_m", [0.0, 40.0])
def test_the_scalar_anomaly_is_that_of_lilley(period_s, toward_deg, height_m):
    """Geophys. J. Int. 159 (2004) 565, equation 3, with W = T a g mu0 sigma F / 8 pi."""
    inclination, strength = math.radians(-68.4), 60_280.0
    main_n = strength * np.array([math.cos(inclination), 0.0, math.sin(inclination)])
    field = at_height(one_wave(period_s, 1.0, toward_deg), main_n, height_m)
    along = field @ (main_n / strength)
    shape = (math.cos(math.radians(toward_deg)) * math.cos(inclination)) ** 2 + math.sin(inclination) ** 2
    decay = math.exp(-4.0 * math.pi**2 * height_m / (G * period_s**2))
    expected = period_s * G * MU0 * 4.4 * strength / (8.0 * math.pi) * shape * decay
    # What the small currents leave out is of the order of omega mu0 sigma / 4 k^2.
    k, rate = (2.0 * math.pi / period_s) ** 2 / G, 2.0 * math.pi / period_s
    assert np.abs(along).max() == pytest.approx(expected, rel=rate * MU0 * 4.4 / k**2 + 1e-4)


@pytest.mark.parametrize(("period_s", "conductivity"), [(12.0, 4.4), (25.0, 5.5), (25.0, 500.0)])
def test_the_currents_diffuse_as_they_do_on_a_grid(period_s, conductivity):
    """The vector potential across the wave, A'' - (k^2 - i omega mu0 sigma) A = -mu0 sigma (u x B)_y, by differences.

    With 500 S/m the currents shield: the closed form must hold where the small-current formula is far off.
    """
    wave, main = one_wave(period_s, 1.0), np.array([20_000.0, 0.0, 35_000.0])
    rate, k = wave.rate[0], wave.wavenumber[0]
    diffusion = k**2 - 1j * rate * MU0 * conductivity
    depth, count = 14.0 / k, 40_001
    z = np.linspace(-depth, 0.0, count)
    step = z[1] - z[0]
    along, up = main[0], -main[2]
    # u = -i omega a (i, 1) exp(k z) along x and z; u x B is along y, to the left: u_z B_x - u_x B_z.
    drive = -1j * rate * np.exp(k * z) * (along - 1j * up) * -MU0 * conductivity
    band = np.zeros((3, count), dtype=complex)
    band[0, 1:], band[1], band[2, :-1] = 1.0, -2.0 - diffusion * step**2, 1.0
    right = drive * step**2
    band[2, -2] = 2.0  # ghost point: A' = -k A at the surface
    band[1, -1] -= 2.0 * step * k
    band[0, 1], band[1, 0], right[0] = 0.0, 1.0, 0.0
    surface = solve_banded((1, 1), band, right)[-1]
    up_field = 1j * k * surface
    # Upward field Re(D exp(i psi)), as the page of the module has it.
    got = wave.strength_nt(main, conductivity)[0]
    assert abs(got - up_field) < 2e-3 * abs(got)
    assert abs(got) > 0.1


def test_it_is_a_potential_field_above_the_sea():
    waves = draw_waves(stream(1, "swell/waves"), Swell(height_m=3.0))
    strength, step = waves.strength_nt(np.array([18_000.0, 2_000.0, 45_000.0]), 4.4), 0.01
    place = np.random.default_rng(2).uniform(-200.0, 200.0, (40, 3)) * [1.0, 1.0, 0.1] - [0.0, 0.0, 60.0]
    time = np.full(40, 12.5)

    def field(at: np.ndarray) -> np.ndarray:
        return waves.field(strength, at, -at[:, 2], time)

    slopes = np.stack([(field(place + step * e) - field(place - step * e)) / (2.0 * step) for e in np.eye(3)], axis=2)
    size = np.abs(slopes).max()
    assert np.abs(np.trace(slopes, axis1=1, axis2=2)).max() < 1e-7 * size
    assert np.abs(slopes - slopes.transpose(0, 2, 1)).max() < 1e-7 * size


def test_the_sea_has_the_height_period_and_direction_that_were_asked():
    """Many draws: variance height^2 / 16, peak at the period, mean direction and spread."""
    settings = Swell(height_m=2.5, period_s=11.0, heading_deg=75.0, spread=75.0)
    seas = [draw_waves(stream(seed, "swell/waves"), settings) for seed in range(100)]
    power = np.array([sea.amplitude_m**2 / 2.0 for sea in seas])
    np.testing.assert_allclose(4.0 * np.sqrt(power.sum(axis=1)), 2.5, rtol=1e-12)
    frequency = np.array([sea.rate for sea in seas]).ravel() / (2.0 * math.pi)
    bins = np.linspace(0.05, 0.2, 31)
    spectrum, _ = np.histogram(frequency, bins, weights=power.ravel())
    assert bins[spectrum.argmax()] <= 1.0 / 11.0 <= bins[spectrum.argmax() + 1] + 0.003
    mean = np.einsum("nk,nkc->c", power, np.array([sea.direction for sea in seas])) / power.sum()
    assert math.degrees(math.atan2(mean[1], mean[0])) == pytest.approx(75.0, abs=2.0)
    # The spread of cos^2s: the mean direction is s / (s + 1) long; s = 75 at the peak, less off it.
    assert 0.93 < np.linalg.norm(mean) < 75.0 / 76.0


@pytest.mark.parametrize("height_m", [0.0, 60.0, 800.0])
def test_what_is_left_at_a_height_is_that_of_the_waves_drawn(height_m):
    """The formula by which flights are refused, against many seas in a vertical main field."""
    settings, field_nt = Swell(height_m=3.0, period_s=14.0, waves=256), 50_000.0
    power = []
    for seed in range(60):
        waves = draw_waves(stream(seed, "swell/waves"), settings)
        size = np.abs(waves.strength_nt(np.array([0.0, 0.0, field_nt]), 4.4)) * np.exp(-waves.wavenumber * height_m)
        power.append(0.5 * np.sum(size**2))
    formula = swell_rms_nt(height_m, height_m=3.0, period_s=14.0, gamma=5.0, conductivity_spm=4.4, main_nt=field_nt)
    assert formula == pytest.approx(math.sqrt(np.mean(power)), rel=0.03)

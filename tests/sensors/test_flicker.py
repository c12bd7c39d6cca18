"""1/f noise: its spectrum against the analytic slope, and that it is a function of time alone."""

import numpy as np
import pytest
from scipy import signal

from magsim.scenario import FluxgateSensor, ScalarSensor
from magsim.sensors.fluxgate import fluxgate_columns
from magsim.sensors.noise import flicker_noise
from magsim.sensors.scalar import scalar_columns
from magsim.streams import stream


def at(time_s: np.ndarray, seed: int = 1, axes: int = 1, density: float = 0.01) -> np.ndarray:
    return flicker_noise(stream(seed, "flicker"), time_s, axes, density)


def test_the_power_density_is_that_at_1_hz_over_the_frequency():
    """Three decades and a half, by Welch's estimate over 4 channels of 10 000 s at the rate of the grid."""
    rate = 60.0
    time = np.arange(0, 10_000 * rate) / rate
    noise = at(time, axes=4, density=0.3)
    freq, density = signal.welch(noise, fs=rate, nperseg=1 << 17, axis=0)
    mean = density.mean(axis=1)
    for low, high in ((0.002, 0.006), (0.006, 0.02), (0.05, 0.2), (0.5, 2.0), (2.0, 5.0)):
        band = (freq >= low) & (freq < high)
        assert np.mean(mean[band] * freq[band]) == pytest.approx(0.3**2, rel=0.2 if low < 0.01 else 0.05), low
    band = (freq > 0.002) & (freq < 5.0)
    slope = np.polyfit(np.log(freq[band]), np.log(mean[band]), 1, w=freq[band] ** -0.5)[0]
    assert slope == pytest.approx(-1.0, abs=0.03)


def test_it_is_a_function_of_time_alone():
    """The same at any rate of samples, and in a longer flight."""
    fast, slow = np.arange(-480, 2400) / 120.0, np.arange(-60, 300) / 15.0
    np.testing.assert_allclose(at(fast)[::8], at(slow), rtol=0, atol=1e-12)
    longer = np.arange(-480, 12_000) / 120.0
    np.testing.assert_allclose(at(longer)[: len(fast)], at(fast), rtol=0, atol=1e-15)
    assert not np.allclose(at(fast, seed=2), at(fast), atol=1e-3)
    with pytest.raises(ValueError, match="asked for at -40 s"):
        at(np.array([-40.0, 0.0]))


def test_axes_are_independent():
    noise = np.diff(at(np.arange(0, 40_000) / 20.0, axes=3), axis=0)
    assert np.abs(np.corrcoef(noise.T) - np.eye(3)).max() < 0.03


def test_instruments_add_it_to_their_readings_alone(make_truth, acquisition):
    truth = make_truth(earth=lambda t: (3e4, 0.0, 4e4))
    keys = {"mount": "cabin", "noise_nt_rthz": 0.0}
    wanted = acquisition(at_samples(truth, "scalar/cabin/flicker", 1, 0.05)[:, 0])
    out = scalar_columns(ScalarSensor(name="cabin", flicker_nt_rthz=0.05, **keys), truth, acquisition, 1)
    np.testing.assert_allclose(out["error_cabin_nt"], wanted, rtol=0, atol=1e-9)
    assert np.std(wanted) > 0.005
    three = acquisition(at_samples(truth, "fluxgate/flux/flicker", 3, 0.02))
    flux = fluxgate_columns(FluxgateSensor(name="flux", flicker_nt_rthz=0.02, **keys), truth, acquisition, 1)
    for k, axis in enumerate("xyz"):
        np.testing.assert_allclose(flux[f"fluxerror_flux_{axis}_nt"], three[:, k], rtol=0, atol=1e-9)


def at_samples(truth, name, axes, density):
    return flicker_noise(stream(1, name), truth.time_s, axes, density)

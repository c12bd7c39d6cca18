import numpy as np
import pytest
from scipy import signal

from magsim import signals
from magsim.sensors.noise import white_noise
from magsim.signals import Decimator, gauss_markov
from magsim.streams import stream


@pytest.mark.parametrize("rate_hz", [60.0, 120.0, 240.0])
def test_white_noise_has_its_density_at_any_rate(rate_hz):
    noise = white_noise(stream(1, "n"), (200_000, 2), 0.004, rate_hz)
    freq, density = signal.welch(noise, fs=rate_hz, nperseg=1024, axis=0)
    low, high = freq < rate_hz / 8, freq > rate_hz / 4
    # 200 000 samples in segments of 1024: about 1 % for the mean over a part of the spectrum.
    for band in (low, high):
        np.testing.assert_allclose(np.sqrt(density[band][1:].mean(axis=0)), 0.004, rtol=0.01)
    assert noise.std() == pytest.approx(0.004 * np.sqrt(rate_hz / 2), rel=0.01)


def test_white_noise_in_the_compensation_band():
    """After the anti-alias filter and the band-pass: density times the root of the filter's noise bandwidth."""
    noise = white_noise(stream(2, "n"), (1_200_000,), 0.004, 120.0)
    rows = Decimator(120.0, 10.0)(noise)
    freq = np.linspace(0, 5, 20_001)
    gain = np.abs(signal.freqz_sos(signal.butter(4, signals.BAND_HZ, "band", fs=10, output="sos"), freq, fs=10)[1]) ** 2
    wanted = 0.004 * np.sqrt(np.sum(gain**2) * (freq[1] - freq[0]))
    # 10 000 s in a band of 0.5 Hz: about 1 % for the standard deviation.
    assert signals.band_pass(rows, 10.0).std() == pytest.approx(wanted, rel=0.03)


def test_gauss_markov_is_stationary_and_correlated_as_set():
    sigma, tau, rate = 2.0, 3.0, 10.0
    runs = gauss_markov(stream(3, "d"), (60, 40_000), sigma, tau, rate)
    # 40 000 runs: 0.35 % for a standard deviation, 0.5 % of the variance for a covariance.
    np.testing.assert_allclose(runs.std(axis=1), sigma, rtol=0.015)
    for lag in (1, 10, 40):
        covariance = np.mean(runs[5] * runs[5 + lag])
        assert covariance == pytest.approx(sigma**2 * np.exp(-lag / rate / tau), abs=0.025 * sigma**2)
    assert abs(runs.mean()) < 0.02


def test_gauss_markov_does_not_depend_on_the_rate():
    """Exact discretization: every tenth sample of a fast one has the correlation of a slow one."""
    fast = gauss_markov(stream(4, "d"), (41, 40_000), 1.0, 2.0, 20.0)[::10]
    slow = gauss_markov(stream(5, "d"), (5, 40_000), 1.0, 2.0, 2.0)
    np.testing.assert_allclose(np.cov(fast), np.cov(slow), rtol=0, atol=0.03)


def test_very_long_correlation_is_a_constant():
    drift = gauss_markov(stream(6, "d"), (100, 3), 1.0, 1e9, 10.0)
    assert np.ptp(drift, axis=0).max() < 1e-3
    assert np.abs(drift).max() > 0.1

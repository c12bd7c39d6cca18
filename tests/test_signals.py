import numpy as np
import pytest
from scipy import signal

from magsim import signals
from magsim.signals import Decimator

RATE = 10.0


def sine(freq_hz, rate_hz=RATE, seconds=400.0, phase=0.4):
    return np.sin(2 * np.pi * freq_hz * np.arange(0, seconds, 1 / rate_hz) + phase)


def middle(values):
    return values[len(values) // 4 : -len(values) // 4]


def amplitude(values, freq_hz, rate_hz=RATE):
    """Amplitude and phase [rad] of a sine by least squares."""
    t = np.arange(len(values)) / rate_hz
    basis = np.stack([np.sin(2 * np.pi * freq_hz * t), np.cos(2 * np.pi * freq_hz * t)], axis=1)
    a, b = np.linalg.lstsq(basis, values, rcond=None)[0]
    return np.hypot(a, b), np.arctan2(b, a)


@pytest.mark.parametrize(
    ("freq_hz", "gain", "tol"), [(0.1, 0.5, 1e-3), (0.6, 0.5, 1e-3), (0.25, 1.0, 1e-3), (0.02, 0, 1e-5), (2.0, 0, 1e-4)]
)
def test_band_pass_gain_and_phase(freq_hz, gain, tol):
    x = sine(freq_hz)
    out = middle(signals.band_pass(x, RATE))
    size, phase = amplitude(out, freq_hz)
    assert size == pytest.approx(gain, abs=tol)
    if gain:
        assert phase == pytest.approx(amplitude(middle(x), freq_hz)[1], abs=2e-3)


def test_band_pass_is_the_stated_filter():
    x = np.random.default_rng(0).normal(size=(3000, 2))
    sos = signal.butter(4, [0.1, 0.6], "band", fs=10, output="sos")
    np.testing.assert_array_equal(signals.band_pass(x, 10), signal.sosfiltfilt(sos, x, axis=0))
    sos = signal.butter(4, 0.03, "high", fs=10, output="sos")
    np.testing.assert_array_equal(signals.high_pass(x, 10), signal.sosfiltfilt(sos, x, axis=0))


def test_white_noise_in_band():
    """White noise of 0.01 nT at 10 Hz is 0.0030 nT in band (an ideal band: 0.0032)."""
    x = np.random.default_rng(3).normal(scale=0.01, size=400_000)
    assert np.std(signals.band_pass(x, RATE)) == pytest.approx(0.0030, abs=0.0001)


@pytest.mark.parametrize(("freq_hz", "gain"), [(0.03, 0.5), (0.3, 1.0), (0.003, 0.0)])
def test_high_pass_gain(freq_hz, gain):
    out = middle(signals.high_pass(sine(freq_hz, seconds=2000.0), RATE))
    assert amplitude(out, freq_hz)[0] == pytest.approx(gain, abs=2e-3)


def test_short_signals_can_be_filtered():
    assert signals.band_pass(np.arange(5.0), RATE).shape == (5,)


@pytest.mark.parametrize("freq_hz", [0.2, 0.6, 1.0])
def test_derivatives(freq_hz):
    omega = 2 * np.pi * freq_hz
    x, exact = sine(freq_hz), omega * sine(freq_hz, phase=0.4 + np.pi / 2)
    step = omega / RATE
    central = middle(signals.derivative(x, RATE))
    np.testing.assert_allclose(central, middle(exact) * np.sin(step) / step, atol=1e-9 * omega)
    # The error of the spline's slope at the knots, h^4/180 f^(5), and as much again for higher orders.
    spline = middle(signals.spline_derivative(x, RATE))
    assert np.abs(spline - middle(exact)).max() < 1.5 * omega * step**4 / 180.0
    both = signals.spline_derivative(np.stack([x, 2 * x], axis=1), RATE)
    np.testing.assert_allclose(both[:, 1], 2 * both[:, 0], atol=1e-12)


def test_derivatives_are_per_second():
    ramp = 3.0 * np.arange(20) / 5.0
    np.testing.assert_allclose(signals.derivative(ramp, 5.0), 3.0)
    np.testing.assert_allclose(signals.spline_derivative(ramp, 5.0), 3.0)


RATES = [(120.0, 10.0), (60.0, 5.0), (60.0, 20.0), (480.0, 10.0), (240.0, 20.0), (30.0, 10.0)]


@pytest.mark.parametrize(("rate_in", "rate_out"), RATES)
def test_decimator_response(rate_in, rate_out):
    decimator = Decimator(rate_in, rate_out)
    assert decimator.taps.sum() == pytest.approx(1.0, abs=1e-15)
    np.testing.assert_array_equal(decimator.taps, decimator.taps[::-1])
    freq = np.linspace(0.0, rate_in / 2, 40_001)
    gain = np.abs(signal.freqz(decimator.taps, worN=freq, fs=rate_in)[1])
    assert np.abs(gain[freq <= 0.25 * rate_out] - 1.0).max() < 1e-4
    assert gain[freq >= 0.5 * rate_out].max() < 1e-4
    assert decimator.half / rate_in <= signals.run_in_s(rate_out)
    assert f"{len(decimator.taps)} taps" in decimator.description


@pytest.mark.parametrize(("rate_in", "rate_out"), RATES)
def test_decimator_rows_are_centered(rate_in, rate_out):
    """A slow sine comes out at the instants of the rows, without delay."""
    decimator = Decimator(rate_in, rate_out)
    t = np.arange(0.0, 60.0, 1 / rate_in)
    first = decimator.half + 5
    out = decimator(np.sin(2 * np.pi * 0.3 * t), first)
    at = t[first] + np.arange(len(out)) / rate_out
    np.testing.assert_allclose(out, np.sin(2 * np.pi * 0.3 * at), rtol=0, atol=1e-4)
    assert at[-1] + decimator.half / rate_in <= t[-1] + 1e-9


def test_decimator_matches_plain_convolution():
    decimator = Decimator(120.0, 10.0)
    x = np.random.default_rng(1).normal(size=(4000, 2, 3)) + 50_000.0
    out = decimator(x, first=200, rows=100)
    whole = np.apply_along_axis(np.convolve, 0, x, decimator.taps, "same")
    assert out.shape == (100, 2, 3)
    np.testing.assert_allclose(out, whole[200 : 200 + 1200 : 12], rtol=0, atol=1e-9)
    # Each column by itself, and in any layout, gives the same bits.
    np.testing.assert_array_equal(out[:, 1, 2], decimator(np.asfortranarray(x)[:, 1, 2], 200, 100))


def test_decimator_keeps_a_constant_and_stops_an_alias():
    decimator = Decimator(120.0, 10.0)
    t = np.arange(0, 60, 1 / 120)
    np.testing.assert_allclose(decimator(np.full(len(t), 43_000.0)), 43_000.0, rtol=0, atol=1e-9)
    # 9.7 Hz would fold to 0.3 Hz.
    assert np.abs(decimator(np.sin(2 * np.pi * 9.7 * t))).max() < 1e-4


def test_decimator_refuses():
    with pytest.raises(ValueError, match="7 Hz out does not divide 120 Hz in"):
        Decimator(120.0, 7.0)
    decimator = Decimator(120.0, 10.0)
    x = np.zeros(1000)
    with pytest.raises(ValueError, match=f"need {decimator.half} samples of run-in"):
        decimator(x, first=decimator.half - 1)
    rows = decimator.rows_of(len(x), decimator.half)
    assert decimator(x, decimator.half, rows).shape == (rows,)
    with pytest.raises(ValueError, match="run-out"):
        decimator(x, decimator.half, rows + 1)

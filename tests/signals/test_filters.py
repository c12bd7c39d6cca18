"""Zero-phase filters, against their stated gains and scipy's own."""

import numpy as np
import pytest
from scipy import signal

from magsim import signals
from tests.support.waves import RATE, amplitude, middle, sine


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


@pytest.mark.parametrize("shape", [(1,), (2,), (5,), (26,), (27,), (28,), (400,), (400, 3), (400, 2, 2), (40, 0)])
@pytest.mark.parametrize("order", ["C", "F"])
def test_filters_of_any_shape_are_scipys_to_the_last_bit(shape, order):
    """Where a signal is shorter than scipy's extension of its ends, that is cut to all but one of its samples."""
    x = np.asarray(np.random.default_rng(1).normal(size=shape) + 45_000.0, order=order)
    for function, edges, kind in ((signals.band_pass, [0.1, 0.6], "band"), (signals.high_pass, 0.03, "high")):
        sos = signal.butter(4, edges, kind, fs=10, output="sos")
        pad = min(3 * (2 * len(sos) + 1), shape[0] - 1)
        kept = x.copy()
        if x.size:
            np.testing.assert_array_equal(function(x, 10.0), signal.sosfiltfilt(sos, x, axis=0, padlen=pad))
        assert function(x, 10.0).shape == shape
        np.testing.assert_array_equal(x, kept)


def test_rate_and_edges_are_those_that_are_asked_for():
    x = np.random.default_rng(2).normal(size=3000)
    sos = signal.butter(4, [0.2, 1.0], "band", fs=20, output="sos")
    np.testing.assert_array_equal(signals.band_pass(x, 20, (0.2, 1.0)), signal.sosfiltfilt(sos, x))
    sos = signal.butter(4, 0.1, "high", fs=20, output="sos")
    np.testing.assert_array_equal(signals.high_pass(x, 20, 0.1), signal.sosfiltfilt(sos, x))


def test_the_slow_part_is_the_stated_filter_after_a_line():
    x = np.random.default_rng(4).normal(size=3000)
    line = np.polynomial.Polynomial([45_000.0, 0.3])(np.arange(3000))
    level = x - np.polynomial.Polynomial.fit(np.arange(3000), x, 1)(np.arange(3000))
    sos = signal.butter(2, [0.005, 0.1], "band", fs=10, output="sos")
    np.testing.assert_allclose(signals.slow_part(x + line, 10.0), signal.sosfiltfilt(sos, level), rtol=0, atol=1e-9)


@pytest.mark.parametrize(("seconds", "at_the_edge"), [(150.0, (0.34, 0.47)), (600.0, (0.46, 0.48))])
def test_the_slow_part_of_sines_is_as_good_as_its_docstring_says(seconds, at_the_edge):
    t = np.arange(round(10.0 * seconds) + 1) / 10.0
    kept = signals.off_ends(t)

    def shares(freq_hz):
        waves = [np.sin(2.0 * np.pi * freq_hz * t + phase) for phase in np.linspace(0.0, 2.0 * np.pi, 24)]
        return [np.std(signals.slow_part(wave, 10.0)[kept]) / np.std(wave[kept]) for wave in waves]

    for freq_hz in (0.01, 0.02, 0.05):
        assert shares(freq_hz) == pytest.approx(np.ones(24), abs=0.06)
    assert at_the_edge[0] - 0.005 < min(shares(0.005))
    assert max(shares(0.005)) < at_the_edge[1] + 0.005


def test_what_is_too_short_has_no_slow_part():
    assert np.isnan(signals.slow_part(np.ones(1500), 10.0)).all()
    assert np.isfinite(signals.slow_part(np.ones(1501), 10.0)).all()


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


def rms(values):
    return np.sqrt(np.mean(values**2))


def test_the_ends_that_scores_leave_out_are_what_the_band_pass_spoils():
    """The band-passed middle depends on nothing outside by more than 1 % of it."""
    rng = np.random.default_rng(0)
    x = signals.band_pass(rng.normal(size=6000), RATE)
    cut = slice(2000, 4000)
    inside = signals.band_pass(x[cut], RATE)
    kept = signals.off_ends(np.arange(2000) / RATE)
    assert rms((inside - signals.band_pass(x, RATE)[cut])[kept]) < 0.01 * rms(x)


def test_the_high_pass_needs_longer_ends():
    """The same for the high-pass, with 0.1 nT on a field of 3 nT/km flown at 70 m/s: 60 s are enough, 30 s are not."""
    noise = signals.band_pass(np.random.default_rng(0).normal(size=12000), RATE)
    x = 0.1 * noise / np.std(noise) + 0.21 * np.arange(12000) / RATE
    whole = signals.high_pass(x, RATE)
    cut = slice(4000, 8000)
    spoilt = signals.high_pass(x[cut], RATE) - whole[cut]
    t = np.arange(4000) / RATE
    share = {edge: rms(spoilt[signals.off_ends(t, edge)]) / rms(whole[cut]) for edge in (30.0, 60.0)}
    assert share[signals.HIGH_PASS_EDGE_S] < 0.01
    assert 0.02 < share[signals.EDGE_S] < 0.1

"""The anti-alias filter and its decimation, against its stated response and plain convolution."""

import numpy as np
import pytest
from scipy import signal

from magsim import signals
from magsim.signals import Decimator

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


def test_a_repeated_constant_is_filtered_as_any_other_signal():
    decimator, table = Decimator(120.0, 10.0), np.array([[2.5, -1.0]])
    lazy = decimator(np.broadcast_to(table, (1000, 2)))
    np.testing.assert_allclose(lazy, decimator(np.repeat(table, 1000, axis=0)), rtol=1e-14)
    assert lazy.shape[1] == 2

"""The anomaly that is injected."""

import numpy as np
import pytest

from magsim import signals
from magsim.benchmark.anomaly import anomaly


def test_one_gaussian_of_20_nt_every_minute_in_turn_narrow_and_wide():
    time_s = 500.0 + np.arange(6000) / 10.0
    values = anomaly(time_s)
    expected = np.zeros(6000)
    for number in range(10):
        width = (1.0, 3.0)[number % 2]
        expected += 20.0 * np.exp(-((time_s - 530.0 - 60.0 * number) ** 2) / (2.0 * width**2))
    np.testing.assert_allclose(values, expected, rtol=0, atol=1e-12)
    assert values.max() == pytest.approx(20.0, rel=1e-3)


def test_it_has_much_in_band():
    assert np.std(signals.band_pass(anomaly(np.arange(6000) / 10.0), 10.0)) > 0.5

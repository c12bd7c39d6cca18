"""Derivatives by time, against the exact ones of sines and ramps."""

import numpy as np
import pytest

from magsim import signals
from tests.support.waves import RATE, middle, sine


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

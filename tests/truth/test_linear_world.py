"""A world in which Tolles and Lawson's model is exact: their 18 terms must leave nothing of the interference.

Uniform field, no noise, no moving dipoles, eddy currents without lag; the label is the projection on the background.
What is left is made by sampling and by the anti-alias filter alone.
"""

import numpy as np
import pytest

from magsim import columns, signals
from magsim.loading import load_scenario
from magsim.simulation import simulate

LINEAR = (
    "pattern.circuits=1",
    "field.earth.along_path=false",
    "field.hinged.enabled=false",
    "field.memory.enabled=false",
    "field.eddy.lag=false",
    "field.electronics.enabled=false",
    "sensors.scalar[0].noise_nt_rthz=0.0",
)


@pytest.fixture(scope="module")
def flight():
    return simulate(load_scenario("calibration_c208b_calm", LINEAR))


def terms(direction, rate):
    """3 permanent, 6 induced and 9 eddy terms from direction cosines and their derivatives."""
    induced = [direction[:, i] * direction[:, j] for i in range(3) for j in range(i, 3)]
    eddy = [direction[:, i] * rate[:, j] for i in range(3) for j in range(3)]
    return np.column_stack([direction, *induced, *eddy])


def left_in_band(flight, derivative, label="projection_cabin_nt"):
    """STD in band of the label, and of what a least-squares fit leaves of it [nT]."""
    background = flight.vector(columns.PART, component="earth", sensor="cabin")
    direction = background / np.linalg.norm(background, axis=1)[:, None]
    rows = signals.off_ends(flight.time_s)
    x = signals.band_pass(terms(direction, derivative(direction, flight.rate_hz)), flight.rate_hz)[rows]
    y = signals.band_pass(flight[label], flight.rate_hz)[rows]
    scale = x.std(axis=0)
    weights = np.linalg.lstsq(x / scale, y, rcond=1e-12)[0]
    return np.std(y), np.std(y - (x / scale) @ weights)


@pytest.mark.parametrize(("derivative", "limit_nt"), [(signals.spline_derivative, 0.002), (signals.derivative, 0.02)])
def test_the_projection_is_linear(flight, derivative, limit_nt):
    raw, left = left_in_band(flight, derivative)
    assert raw > 5.0
    assert left < limit_nt


def test_the_norm_is_not(flight):
    """The exact length of the sum has a part of second order, which no linear term can hold."""
    _, projection = left_in_band(flight, signals.spline_derivative)
    raw, norm = left_in_band(flight, signals.spline_derivative, "interference_cabin_nt")
    assert 3.0 * projection < norm < 0.02 * raw

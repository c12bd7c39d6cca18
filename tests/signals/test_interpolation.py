"""Values and means between samples, against polynomials and sines."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.interpolate import BarycentricInterpolator

from magsim import signals

PLACES = np.array([7.0, 7.3, 12.5, 20.0, 31.99, 32.0])


def test_the_polynomial_through_the_16_samples_around_each_place():
    values = np.random.default_rng(0).normal(size=40)
    got = signals.between(values, PLACES)
    for place, value in zip(PLACES, got, strict=True):
        first = min(int(np.floor(place)), 31) - 7
        nodes = np.arange(first, first + signals.POINTS)
        expected = BarycentricInterpolator(nodes, values[nodes])(place)
        assert value == pytest.approx(float(expected), rel=1e-9, abs=1e-9)


def test_polynomials_of_degree_15_are_exact():
    line = Polynomial(np.random.default_rng(1).normal(size=16), domain=[0, 39])
    values = line(np.arange(40.0))
    np.testing.assert_allclose(signals.between(values, PLACES), line(PLACES), rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize(("per_sample", "error"), [(0.1, 1e-7), (0.25, 3e-3)])
def test_sines(per_sample, error):
    omega = 2.0 * np.pi * per_sample
    places = np.arange(8, 90) + 0.5
    got = signals.between(np.sin(omega * np.arange(100)), places)
    assert np.abs(got - np.sin(omega * places)).max() < error


def test_columns_are_interpolated_alike_and_samples_are_kept():
    values = np.random.default_rng(2).normal(size=(40, 3))
    got = signals.between(values, PLACES)
    assert got.shape == (6, 3)
    np.testing.assert_allclose(got[:, 1], signals.between(values[:, 1], PLACES), rtol=1e-14)
    np.testing.assert_allclose(got[[0, 3, 5]], values[[7, 20, 32]], rtol=1e-12)


@pytest.mark.parametrize("place", [6.99, 32.01])
def test_places_too_near_an_end_are_refused(place):
    with pytest.raises(ValueError, match="need 8 of 40 samples around each"):
        signals.between(np.zeros(40), np.array([20.0, place]))
    assert signals.between(np.zeros(40), np.array([])).shape == (0,)


def test_means_of_whole_steps_are_means_of_samples():
    values = 45_000.0 + np.random.default_rng(3).normal(size=(60, 2))
    start = np.array([10.5, 20.5, 9.5])
    got = signals.window_mean(values, start, start + np.array([1.0, 5.0, 30.0]))
    expected = [values[11], values[21:26].mean(axis=0), values[10:40].mean(axis=0)]
    np.testing.assert_allclose(got, expected, rtol=1e-13)
    assert signals.window_mean(values[:, 0], start, start + 1.0) == pytest.approx(
        signals.window_mean(values, start, start + 1.0)[:, 0]
    )


def test_means_of_a_sine_over_any_window():
    """Samples are means over their steps, as the integral of the sine has them."""
    omega = 2.0 * np.pi * 0.05
    integral = lambda at: -np.cos(omega * at) / omega  # noqa: E731
    samples = np.arange(80.0)
    values = integral(samples + 0.5) - integral(samples - 0.5)
    start, stop = np.array([10.2, 30.0, 40.7]), np.array([13.9, 31.37, 60.11])
    got = signals.window_mean(values, start, stop)
    np.testing.assert_allclose(got, (integral(stop) - integral(start)) / (stop - start), rtol=0, atol=1e-9)


def test_the_mean_of_a_constant_is_exact():
    got = signals.window_mean(np.full(40, 45_000.123), np.array([10.2, 11.0]), np.array([13.77, 25.5]))
    np.testing.assert_array_equal(got, 45_000.123)

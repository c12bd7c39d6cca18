"""The prior of the gradient terms: its size from the slow course, and the solution against normal equations by hand."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.columns import FLUX
from magsim.compensation import create
from magsim.compensation.columns import TollesLawsonColumns, position_columns
from magsim.compensation.field_prior import rows_as_one, sizes_of_terms, solve_with_prior
from magsim.compensation.solvers import least_squares
from magsim.signals import band_pass
from tests.support.birds import COEFFICIENTS, bird, moved
from tests.support.worlds import FIELD_NT, World, calibration

RATE_HZ = 10.0


def test_ten_rows_at_10_hz_count_as_one():
    """White noise in band: the mean of n rows has the variance of n / 10 independent ones; by its autocorrelation."""
    assert rows_as_one(RATE_HZ) == pytest.approx(10.0)
    assert rows_as_one(50.0) == pytest.approx(50.0)
    assert rows_as_one(0.5) == 1.0
    rng = np.random.default_rng(0)
    noise = band_pass(rng.standard_normal(200_000), RATE_HZ)[1000:-1000]
    power = np.abs(np.fft.rfft(noise)) ** 2
    lagged = np.fft.irfft(power)[:300] / np.fft.irfft(power)[0]
    # sum of the squared autocorrelation: rows that count as one where the column has the same band
    assert rows_as_one(RATE_HZ) == pytest.approx(1.0 + 2.0 * np.sum(lagged[1:] ** 2), rel=0.25)


def test_the_prior_is_that_of_the_normal_equations():
    rng = np.random.default_rng(1)
    matrix = rng.normal(size=(400, 4)) * [1.0, 1e3, 1e-3, 1e-2]
    target = matrix @ [1.0, 2e-3, 50.0, 300.0] + rng.normal(size=400)
    sizes = np.array([np.inf, np.inf, 20.0, np.inf])
    found = solve_with_prior(least_squares, matrix, target, sizes, RATE_HZ)
    spread = least_squares(matrix, target).residual_std
    weights = np.diag([0.0, 0.0, 10.0 * spread**2 / 20.0**2, 0.0])
    expected = np.linalg.solve(matrix.T @ matrix + weights, matrix.T @ target)
    np.testing.assert_allclose(found.coefficients, expected, rtol=1e-9)
    assert found.residual_std == pytest.approx(np.sqrt(np.mean((target - matrix @ expected) ** 2)), rel=1e-12)
    assert abs(found.coefficients[2]) < 0.8 * abs(least_squares(matrix, target).coefficients[2])


def test_the_size_of_the_terms_is_that_of_the_field_at_each_place():
    """Two places with fields of their own; the coefficients of the platform may be a little wrong."""
    flights = [bird(2), moved(bird(2, seed=1), lat_deg=5.0)]
    columns = TollesLawsonColumns(16, "cabin", strength_nt=FIELD_NT)
    field = position_columns(flights, 2, vertical=True)
    wrong = COEFFICIENTS * 1.001
    targets = [flight["mag_cabin_nt"] for flight in flights]
    sizes = sizes_of_terms(field, [columns(flight) for flight in flights], targets, wrong)
    np.testing.assert_array_equal(field.horizontal, [0, 0, 0, 0, 0, -1, 1, 1, 1, 1, 1, -1])
    assert np.isinf(sizes[field.horizontal < 0]).all()
    for place, flight in enumerate(flights):
        matrix = field.designs[place].matrix[:, field.horizontal == place]
        height = flight["ins_alt_m"]
        known = np.column_stack([matrix, height - height.mean(), np.ones(len(height))])
        true = np.linalg.lstsq(known, flight["clean_cabin_nt"])[0][:5]
        np.testing.assert_allclose(sizes[field.horizontal == place], np.sqrt(np.mean(true**2)), rtol=0.05)
    assert len(np.unique(sizes[np.isfinite(sizes)])) == 2


def test_a_fitted_gradient_is_of_physical_size():
    """3 nT/km north and -0.5 east, and 0.3 nT in band that no term explains: free terms are 10 to 20 times that."""
    report = create("tl16_gradient").fit(calibration(World(eddy_tau_s=0.3))).report_
    gradient = {term.name: term.value for term in report.gradient}
    assert abs(gradient["lat"]) < 3.0 * 333.0
    assert abs(gradient["lon"]) < 333.0


def test_what_the_field_lacks_costs_nothing():
    """Order 3 in a field of the first order is as good as order 1, and better than none."""
    recording = calibration(World())
    test = recording.where(split="test")
    left = {
        order: np.std(
            band_pass(
                test["interference_cabin_nt"] - create("tl16_gradient", order=order).fit(recording).interference(test),
                RATE_HZ,
            )[300:-300]
        )
        for order in (0, 1, 3)
    }
    assert left[3] < 1.01 * left[1]
    assert left[1] < 1.01 * left[0]


@pytest.mark.parametrize(("order", "eddy"), [(0, "direction"), (3, "direction"), (0, "field")])
def test_an_anomaly_that_the_fluxgate_sees_too_passes_whole(order, eddy):
    """With columns of the reading's own length, 18 terms took a share of it; the bump lies on the test rows."""
    recording = calibration(World())
    method = create("tl18_measured", scale="sample", order=order, vertical=True, eddy=eddy).fit(recording)
    test = recording.where(split="test")
    bump = 100.0 * np.exp(-0.5 * ((test.time_s - test.time_s.mean()) / 20.0) ** 2)
    flux = test.vector(FLUX, sensor="cabin")
    grown = flux * (1.0 + bump / np.linalg.norm(flux, axis=1))[:, None]
    names = [f"flux_cabin_{axis}_nt" for axis in "xyz"]
    raised = replace(
        test, data={**test.data, "mag_cabin_nt": test["mag_cabin_nt"] + bump, **dict(zip(names, grown.T, strict=True))}
    )
    passed = method.compensate(raised) - method.compensate(test)
    assert passed @ bump / (bump @ bump) == pytest.approx(1.0, abs=0.01)

"""Vector Tolles-Lawson: exact worlds, Jacobian, other solvers, and the guard against its collapse."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.optimize import least_squares

from magsim import signals
from magsim.benchmark import evaluate
from magsim.compensation import create, load, vector_fit
from magsim.compensation.vector_fit import VectorProblem, VectorRows, fit_vector
from magsim.errors import DataError, RequestError
from tests.support import scores
from tests.support.surveys import model
from tests.support.worlds import EDDY_S, INDUCED, PERMANENT_NT, VECTOR, World, calibration, parts

QUIET = replace(VECTOR, mag_noise_nt=0.0, flux_noise_nt=0.0)
LAGGED = World(eddy_tau_s=0.5, mag_noise_nt=0.0, flux_noise_nt=0.0)
"""A world with a gradient that the model cannot express."""


@cache
def fitted(world, **params):
    """A method fitted on the training rows, the test rows, and the error there."""
    recording = calibration(world)
    method = create("vector_tl", **params).fit(recording)
    test = recording.where(split="test")
    return method, test, test["interference_cabin_nt"] - method.interference(test)


def ratio(test, error):
    return scores.improvement_ratio(test["interference_cabin_nt"], error, 10.0)


def small_rows(second=False):
    """Rows of one training flight, every third, as the fit gets them."""
    train = calibration(QUIET).where(split="train").take(slice(0, 2400))
    flux = np.column_stack([train[f"flux_cabin_{axis}_nt"] for axis in "xyz"])
    vector = flux / np.linalg.norm(flux, axis=1)[:, None] * train["mag_cabin_nt"][:, None]
    rate = np.gradient(vector, 0.1, axis=0)
    vectors = (vector, rate, np.gradient(rate, 0.1, axis=0))[: 3 if second else 2]
    return [VectorRows(train.time_s, vectors, train["clean_cabin_nt"])]


def test_a_vector_world_is_compensated_a_hundred_times_better_than_by_projection():
    """No noise: what is left is the derivative and the model's disturbed field for the clean one; reference: 6000."""
    _, test, error = fitted(QUIET)
    assert ratio(test, error) > 5000.0
    tl = create("tl16", derivative="spline").fit(calibration(QUIET))
    assert ratio(test, error) > 15.0 * ratio(test, test["interference_cabin_nt"] - tl.interference(test))
    assert scores.rmse(error) < 0.05


def test_coefficients_are_those_of_the_law_turned_to_the_disturbed_field():
    """a' = (E + b)^-1 a, b' = E - (E + b)^-1, c' = (E + b)^-1 c (E + b)^-1, as far as c^2 is small.

    Of b the symmetric part, since turned by a small angle a field keeps its length; of c all but the trace, since the
    rate of a field of constant length is across it.
    """
    method, _, _ = fitted(QUIET)
    inverse = np.linalg.inv(np.eye(3) + INDUCED)
    induced, expected = method.fit_.matrices[0], np.eye(3) - inverse
    np.testing.assert_allclose(method.fit_.permanent_nt, inverse @ PERMANENT_NT, atol=1.0)
    np.testing.assert_allclose(induced + induced.T, expected + expected.T, atol=2e-5)
    eddy = method.fit_.matrices[1] - inverse @ EDDY_S @ inverse
    np.testing.assert_allclose(eddy - np.eye(3) * np.trace(eddy) / 3.0, 0.0, atol=1e-4)


def test_the_second_derivative_takes_up_a_lag_of_eddy_currents():
    lag = replace(QUIET, eddy_tau_s=0.05)
    _, test, without = fitted(lag)
    _, _, error = fitted(lag, second_derivative=True)
    assert ratio(test, error) > 5.0 * ratio(test, without)


def test_without_labels_a_uniform_field_is_as_good():
    _, test, label = fitted(QUIET)
    _, _, measured = fitted(QUIET, target="measured")
    assert ratio(test, measured) > 0.8 * ratio(test, label)


def test_without_labels_the_model_field_stands_in_for_the_clean_one():
    """The strength of IGRF in place of the world's constant one: in band it changes with the height."""
    world = calibration(QUIET)
    recording = replace(
        world, data={**world.data, "mag_cabin_nt": world["mag_cabin_nt"] - world["clean_cabin_nt"] + model(world)}
    )
    test = recording.where(split="test")
    ratios = {}
    for target in ("measured", "model"):
        method = create("vector_tl", target=target).fit(recording)
        ratios[target] = ratio(test, test["interference_cabin_nt"] - method.interference(test))
    assert ratios["model"] > 3000.0
    assert ratios["measured"] < 0.5 * ratios["model"]


@pytest.mark.parametrize("second", [False, True])
def test_the_jacobian_is_that_of_finite_differences(second):
    problem = VectorProblem(small_rows(second), 0.02)
    rng = np.random.default_rng(0)
    unknowns = rng.normal(size=problem.unknowns)
    got = problem.jacobian(unknowns)
    step = 1e-4
    for column in range(problem.unknowns):
        moved = step * (np.arange(problem.unknowns) == column)
        difference = (problem.residuals(unknowns + moved) - problem.residuals(unknowns - moved)) / (2.0 * step)
        np.testing.assert_allclose(got[:, column], difference, rtol=0, atol=1e-5 * np.abs(got[:, column]).max() + 1e-7)


def unknowns_of(fit):
    """Scaled as the problem scales them."""
    return np.concatenate([fit.permanent_nt / 100.0, fit.matrices[0].ravel() / 1e-3, fit.matrices[1].ravel() / 1e-3])


def test_the_answer_is_that_of_a_trust_region_with_a_numerical_jacobian():
    rows = small_rows()
    problem = VectorProblem(rows, 0.02)
    other = least_squares(problem.residuals, np.zeros(21), "3-point", xtol=1e-12, ftol=1e-12, gtol=1e-12)
    fit, expected = fit_vector(rows, 0.02), problem.fit_of(other.x)
    cost = 0.5 * np.sum(problem.residuals(unknowns_of(fit)) ** 2)
    assert cost <= other.cost * (1.0 + 1e-6)
    np.testing.assert_allclose(fit.permanent_nt, expected.permanent_nt, atol=0.01)
    np.testing.assert_allclose(fit.clean(rows[0].vectors), expected.clean(rows[0].vectors), rtol=0, atol=1e-4)


def test_residuals_are_the_equations_by_hand():
    rows = small_rows()
    fit = fit_vector(rows, 0.02)
    field, rate = rows[0].vectors
    own = fit.permanent_nt + field @ fit.matrices[0].T + rate @ fit.matrices[1].T
    clean = np.linalg.norm(field - own, axis=1)
    np.testing.assert_allclose(fit.clean(rows[0].vectors), clean, rtol=1e-12)
    band = signals.band_pass(clean - rows[0].reference_nt, 10.0)[300:-300]
    assert fit.residual_nt == pytest.approx(np.sqrt(np.mean(band**2)), rel=1e-9)


@pytest.mark.parametrize("target", ["interference", "measured"])
def test_what_the_model_cannot_express_does_not_make_the_field_vanish(target):
    _, test, error = fitted(LAGGED, target=target)
    compensated = test["clean_cabin_nt"] + error
    assert compensated.mean() == pytest.approx(test["mag_cabin_nt"].mean(), rel=0.02)
    assert 30.0 < ratio(test, error) < 120.0


@pytest.mark.parametrize("name", ["LABEL_WEIGHT", "READING_WEIGHT"])
def test_without_the_broadband_term_it_collapses_and_is_refused(monkeypatch, name):
    """Residual small, all of the field taken for interference."""
    monkeypatch.setattr(f"magsim.compensation.vector_tl.{name}", 0.0)
    monkeypatch.setattr(vector_fit, "REGULAR", 1e-4)
    target = "interference" if name == "LABEL_WEIGHT" else "measured"
    with pytest.raises(DataError, match=r"takes \d+% of the field itself for interference, more than 2%.*Remedy"):
        create("vector_tl", target=target).fit(calibration(LAGGED))


def test_an_anomaly_passes_whole_and_the_reading_is_declared():
    recording = calibration(VECTOR)
    report = evaluate(recording, [create("vector_tl")])
    assert report.value("vector_tl", "gain") == pytest.approx(1.0, abs=0.02)
    assert "mag_{sensor}_nt" in create("vector_tl").requires


def test_noise_of_the_reading_stays_in_the_compensated_reading():
    """The estimate of the interference does not follow the noise: |B - Ba| does."""
    loud = replace(VECTOR, mag_noise_nt=0.5)
    _, _, error = fitted(loud)
    assert np.std(error) < 0.1 * 0.5


def test_saved_and_loaded_estimates_the_same(tmp_path):
    method, test, _ = fitted(VECTOR, second_derivative=True)
    method.save(tmp_path)
    back = load(tmp_path)
    np.testing.assert_array_equal(back.interference(test), method.interference(test))
    assert back.fit_.residual_nt == method.fit_.residual_nt


def test_what_cannot_be_fitted_is_refused():
    train, _, _ = parts(calibration(VECTOR))
    with pytest.raises(DataError, match=r"21 coefficients needs at least 210 training rows after 30 s.*has 201"):
        create("vector_tl").fit(train.take(slice(900, 1701)))
    bare = replace(train, data={k: v for k, v in train.data.items() if "interference" not in k})
    with pytest.raises(RequestError, match="no label 'interference_cabin_nt'"):
        create("vector_tl").fit(bare)
    create("vector_tl", target="measured").fit(bare)
    blind = replace(train, data={k: v for k, v in train.data.items() if not k.startswith("flux")})
    with pytest.raises(RequestError, match="no column flux_"):
        create("vector_tl").fit(blind)

"""Standard errors of linear fits: against the scatter of fits to many draws of the noise, and closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.signal import lfilter

from magsim.compensation import TollesLawson, create, load
from magsim.compensation.covariance import autocovariance, middle, runs_of, spread_of
from magsim.compensation.solvers import SOLVERS, least_squares
from magsim.errors import DataError, RequestError
from magsim.recording import Recording
from magsim.signals import in_band, in_band_rows
from tests.support.birds import COEFFICIENTS, bird, terms
from tests.support.methods import stub
from tests.support.worlds import World, calibration

DRAWS = 60
NOISE = {
    "white": lambda rng, n: 0.05 * rng.standard_normal(n),
    "red": lambda rng, n: lfilter([1.0], [1.0, -0.97], 0.05 * rng.standard_normal(n)),
}


def flown() -> Recording:
    """One circuit of an airplane that is exactly Tolles-Lawson, without labels."""
    one = bird(0, vertical=0.0).take(slice(0, 6400))
    return replace(one, data={name: values for name, values in one.data.items() if not name.startswith("interference")})


@pytest.mark.parametrize(("noise", "solver"), [("white", "ridge"), ("red", "least_squares")])
def test_errors_agree_with_the_scatter_of_many_fits(noise, solver):
    clean, off, stated, in_reading = flown(), [], [], []
    band = in_band(terms(clean), clean.time_s)
    for draw in range(DRAWS):
        error = NOISE[noise](np.random.default_rng(draw), len(clean))
        noisy = replace(clean, data={**clean.data, "mag_cabin_nt": clean["mag_cabin_nt"] + error})
        fitted = TollesLawson(target="measured", solver=solver).fit(noisy)
        off.append(fitted.coefficients_ - COEFFICIENTS)
        stated.append([term.error for term in fitted.coefficients()[:-1]])
        expected = np.mean(fitted.uncertainty(noisy)[300:-300] ** 2)
        in_reading.append(np.mean((band @ off[-1]) ** 2) / expected)
    scaled = np.array(off) / np.array(stated)
    # of 60 draws a variance is known to 18 %, the mean over 16 correlated coefficients to 9 % (scatter of four halves)
    assert np.mean(scaled**2) == pytest.approx(1.0, abs=0.25)
    assert 0.90 <= np.mean(np.abs(scaled) < 1.96) <= 0.98
    assert np.mean(in_reading) == pytest.approx(1.0, abs=0.2)


def test_independent_rows_have_the_errors_of_the_textbook():
    rng = np.random.default_rng(1)
    matrix = rng.standard_normal((4000, 3)) * [1.0, 10.0, 0.1]
    matrix -= matrix.mean(axis=0)
    target = matrix @ [1.0, 2.0, 3.0] + 0.3 * rng.standard_normal(4000)
    found = spread_of(least_squares(matrix, target), matrix, target, [slice(0, 4000)], 1.0)
    expected = np.sqrt(np.diag(0.3**2 * np.linalg.inv(matrix.T @ matrix)))
    np.testing.assert_allclose(np.sqrt(np.diag(found.covariance)), expected, rtol=0.15)
    assert found.effective_rows == pytest.approx(4000.0, rel=0.25)


def test_ten_rows_of_white_noise_in_band_count_as_about_one():
    clean = flown()
    error = NOISE["white"](np.random.default_rng(0), len(clean))
    noisy = replace(clean, data={**clean.data, "mag_cabin_nt": clean["mag_cabin_nt"] + error})
    fitted = TollesLawson(target="measured").fit(noisy)
    assert 7.0 < in_band_rows(clean.time_s).sum() / fitted._fit.effective_rows < 13.0


def test_products_of_rows_are_those_of_the_whole_matrix_and_never_run_across_a_gap():
    rng = np.random.default_rng(0)
    matrix, noise = rng.standard_normal((50, 3)), np.array([2.0, 0.7, -0.1])
    runs = [slice(0, 30), slice(30, 50)]
    whole = toeplitz(np.concatenate([noise, np.zeros(47)]))
    whole[:30, 30:] = whole[30:, :30] = 0.0
    np.testing.assert_allclose(middle(matrix, runs, noise), matrix.T @ whole @ matrix, rtol=1e-12)
    sums = [sum(float(part[k:] @ part[: len(part) - k]) for part in (matrix[:30, 0], matrix[30:, 0])) for k in range(5)]
    taper = np.minimum(1.0, 2.0 - 2.0 * np.arange(5) / 5.0)
    np.testing.assert_allclose(autocovariance(matrix[:, :1], runs, 4), np.array(sums) / 50.0 * taper, rtol=1e-12)


def test_runs_end_at_gaps_and_between_recordings():
    time_s = np.concatenate([np.arange(5.0), np.arange(8.0, 10.0)])
    assert runs_of([time_s, np.arange(3.0)]) == [slice(0, 5), slice(5, 7), slice(7, 10)]


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_dependent_column_is_uncertain_and_the_reading_is_not(solver):
    """With 18 terms u1^2 + u2^2 + u3^2 = 1 leaves one direction of the induced coefficients open."""
    noisy = calibration(World(gradient=False))
    sixteen, eighteen = (TollesLawson(terms=n, solver=solver).fit(noisy) for n in (16, 18))
    open_, known = (
        max(t.error / abs(t.value) for t in m.coefficients() if t.group == "induced") for m in (eighteen, sixteen)
    )
    assert open_ > 3.0 * known
    ratio = eighteen.uncertainty(noisy).mean() / sixteen.uncertainty(noisy).mean()
    assert ratio == pytest.approx(1.0, abs=0.2)


@pytest.mark.parametrize("settings", [{}, {"terms": 9, "band": "broad"}, {"target": "measured", "vertical": True}])
def test_shares_add_up_to_the_interference(settings, tmp_path):
    recording = calibration(World())
    fitted = TollesLawson(**settings).fit(recording)
    shares = fitted.shares(recording)
    assert set(shares) == {term.group for term in fitted.coefficients()}
    np.testing.assert_allclose(sum(shares.values()), fitted.interference(recording), rtol=0, atol=1e-9)
    assert np.isfinite(fitted.uncertainty(recording)).all()
    assert all(term.error > 0.0 for term in fitted.coefficients()[:-1])
    named = create("tolles_lawson", **settings).fit(recording)
    named.save(tmp_path)
    again = load(tmp_path)
    assert again.coefficients() == named.coefficients()
    np.testing.assert_array_equal(again.uncertainty(recording), named.uncertainty(recording))


def test_a_method_without_terms_says_so():
    recording = calibration(World())
    fitted = stub().fit(recording)
    for call in (fitted.coefficients, lambda: fitted.shares(recording), lambda: fitted.uncertainty(recording)):
        with pytest.raises(RequestError, match="has no coefficients, shares or errors"):
            call()
    with pytest.raises(RequestError, match="is not fitted yet"):
        TollesLawson().coefficients()
    assert create("none").fit(recording).coefficients() == ()
    assert create("none").fit(recording).shares(recording) == {}


@pytest.fixture(scope="module")
def together() -> Recording:
    """One circuit with fluxgate and scalar sensor in one place, without noise: vector Tolles-Lawson is exact."""
    return calibration(World(gradient=False, mag_noise_nt=0.0, flux_noise_nt=0.0, circuits=1))


def test_errors_of_the_vector_fit_agree_with_the_scatter_of_many_fits(together):
    estimates, stated = [], []
    for draw in range(14):
        error = 0.05 * np.random.default_rng(draw).standard_normal(len(together))
        noisy = replace(together, data={**together.data, "mag_cabin_nt": together["mag_cabin_nt"] + error})
        fitted = create("vector_tl", target="measured").fit(noisy)
        estimates.append(in_band(fitted.interference(together), together.time_s))
        stated.append(np.mean(fitted.uncertainty(together)[300:-300] ** 2))
    scatter = np.mean(np.var(estimates, axis=0, ddof=1))
    # 14 draws of some 20 coefficients: the mean variance is known to 10 %
    assert scatter == pytest.approx(np.mean(stated), rel=0.3)


def test_vector_terms_add_up_and_are_kept(together, tmp_path):
    fitted = create("vector_tl").fit(together)
    shares = fitted.shares(together)
    np.testing.assert_allclose(sum(shares.values()), fitted.interference(together), rtol=0, atol=1e-9)
    terms_ = {term.name: term for term in fitted.coefficients()}
    assert len(terms_) == 21
    assert set(shares) == {term.group for term in terms_.values()} == {"permanent", "induced", "eddy"}
    assert terms_["b12"].value == fitted.fit_.matrices[0, 0, 1]
    assert all(term.error > 0.0 for term in terms_.values())
    fitted.save(tmp_path)
    assert load(tmp_path).coefficients() == fitted.coefficients()


def test_the_vector_fit_refuses_a_line_that_does_not_turn(together):
    leg = together.take(slice(0, 1200))
    still = {f"flux_cabin_{axis}_nt": leg[f"flux_cabin_{axis}_nt"] * 1e-3 + 2e4 for axis in "xyz"}
    with pytest.raises(DataError, match="a fit needs 15"):
        create("vector_tl").fit(replace(leg, data={**leg.data, **still}))
    dead = {"flux_cabin_x_nt": np.full(len(together), 5.0)}
    with pytest.raises(DataError, match="flux_cabin_x_nt never changes"):
        create("vector_tl").fit(replace(together, data={**together.data, **dead}))

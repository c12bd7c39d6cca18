"""Linear fits: filtered columns, a solver, a target, and the Earth's field beside the platform."""

from dataclasses import replace

import numpy as np
import pytest

from magsim import signals
from magsim.compensation.columns import TollesLawsonColumns
from magsim.compensation.linear import Band, LinearFit, LinearModel, fit_linear
from magsim.compensation.solvers import SOLVERS
from magsim.compensation.targets import Label, Reading
from magsim.errors import DataError, RequestError
from magsim.recording import Recording
from tests.support.birds import COEFFICIENTS, PAIRS, VERTICAL_NT_M, bird, moved, off_nt, terms
from tests.support.worlds import EXACT, FIELD_NT, VECTOR, calibration, parts

COLUMNS = TollesLawsonColumns(16, "cabin", strength_nt=FIELD_NT)


def fit(
    *recordings: Recording,
    order: int = 0,
    vertical: bool = False,
    target: str = "measured",
    solver: str = "ridge",
    band: Band = "in",
    columns: TollesLawsonColumns = COLUMNS,
) -> LinearFit:
    model = LinearModel(
        columns, {"interference": Label(), "measured": Reading()}[target], SOLVERS[solver], band, order, vertical
    )
    return fit_linear(model, [recording.labeled() for recording in recordings], "cabin")


@pytest.mark.parametrize("solver", SOLVERS)
def test_all_solvers_find_the_coefficients_of_an_exact_world(solver):
    found = fit(bird(0), vertical=True, solver=solver)
    assert off_nt(found.coefficients, bird(0)) < 1e-9
    assert found.names == COLUMNS(bird(0)).names
    np.testing.assert_allclose(found.estimate(COLUMNS(bird(0))), bird(0)["interference_cabin_nt"], rtol=0, atol=1e-6)


@pytest.mark.parametrize("order", PAIRS)
def test_terms_are_recovered_exactly_with_the_right_order_and_biased_below_it(order):
    r = bird(order)
    assert off_nt(fit(r, order=order, vertical=True).coefficients, r) < 1e-9
    assert off_nt(fit(r, order=4, vertical=True).coefficients, r) < 1e-9
    assert off_nt(fit(r, order=order).coefficients, r) > 1e-2
    if order:
        assert off_nt(fit(r, order=order - 1, vertical=True).coefficients, r) > 3e-4


@pytest.mark.parametrize("order", [1, 3])
def test_the_field_is_reported_in_physical_units(order):
    """Summed up by hand, the terms beside the platform are the field but for its constant."""
    r = bird(order)
    found = fit(r, order=order, vertical=True)
    ((lat0, lon0),) = found.origins_deg
    north, east = r["ins_lat_deg"] - lat0, r["ins_lon_deg"] - lon0
    exponents = [(n - k, k) for n in range(1, order + 1) for k in range(n + 1)]
    *horizontal, height = found.gradient
    field = sum(term.value * north**a * east**b for term, (a, b) in zip(horizontal, exponents, strict=True))
    assert height.value == pytest.approx(VERTICAL_NT_M, rel=1e-6)
    rest = r["clean_cabin_nt"] - field - height.value * r["ins_alt_m"]
    assert np.std(r["clean_cabin_nt"]) > 2.0
    assert np.std(rest) < 1e-3


@pytest.mark.parametrize("shift", [(0.0, 180.0 - 112.75, 0.0), (0.0, -112.75, 180.0), (55.0, 20.0, 0.0)])
def test_place_does_not_matter(shift):
    assert off_nt(fit(moved(bird(3), *shift), order=3, vertical=True).coefficients, bird(3)) < 1e-9


@pytest.mark.parametrize("lon_deg", [3.0, 180.0 - 112.75])
def test_another_place_has_its_own_field(lon_deg):
    """Two flights in different fields, 300 km apart and on the date line: no common polynomial fits both."""
    here, there = bird(2), moved(bird(2, seed=1, vertical=0.03), lon_deg=lon_deg)
    found = fit(here, there, order=2, vertical=True)
    assert off_nt(found.coefficients, here) < 1e-9
    gradients = {term.name: term.value for term in found.gradient}
    assert len(gradients) == 12
    assert gradients["height [1]"] == pytest.approx(0.02, rel=1e-6)
    assert gradients["height [2]"] == pytest.approx(0.03, rel=1e-6)
    assert len(found.origins_deg) == 2
    swapped = fit(there, here, order=2, vertical=True)
    np.testing.assert_allclose(swapped.coefficients, found.coefficients, rtol=1e-8)


def test_height_alone_reads_no_position():
    r = bird(0)
    bare = replace(r, data={k: v for k, v in r.data.items() if k not in ("ins_lat_deg", "ins_lon_deg")})
    found = fit(bare, bare, vertical=True)
    assert off_nt(found.coefficients, r) < 1e-9
    assert [term.name for term in found.gradient] == ["height"]
    assert found.origins_deg == ()


def test_a_height_that_never_changes_changes_nothing():
    r = bird(1)
    level = replace(r, data={**r.data, "ins_alt_m": np.full(len(r), 3000.0)})
    both, without = (fit(level, order=1, vertical=vertical) for vertical in (True, False))
    np.testing.assert_allclose(both.coefficients, without.coefficients, rtol=1e-12)
    assert both.gradient[-1].value == 0.0


def test_labels_leave_nothing_for_the_gradient():
    r = bird(2)
    plain, beside = (fit(r, target="interference", order=n, vertical=bool(n)) for n in (0, 2))
    assert off_nt(plain.coefficients, r) < 1e-9
    assert off_nt(beside.coefficients, r) < 1e-9
    gradients = {term.name: term.value for term in beside.gradient}
    assert abs(gradients["height"]) < 1e-9
    assert abs(gradients["lat"]) < 1e-5


def test_the_offset_is_the_mean_of_what_the_labels_leave():
    r = bird(0)
    shifted = replace(r, data={**r.data, "interference_cabin_nt": r["interference_cabin_nt"] + 7.0})
    for target in ("interference", "measured"):
        found = fit(shifted, target=target, vertical=True)
        assert found.offset_nt == pytest.approx(7.0 + np.mean(terms(r) @ (COEFFICIENTS - found.coefficients)), abs=1e-9)
        assert found.offset_nt == pytest.approx(7.0, abs=1e-4)
    bare = replace(r, data={k: v for k, v in r.data.items() if not k.startswith("interference")})
    assert fit(bare, vertical=True).offset_nt == 0.0
    # one recording without labels is enough
    assert fit(shifted, bare, vertical=True).offset_nt == 0.0


def test_a_gap_is_not_filtered_across():
    """Rows are removed from the middle; the pieces must be filtered separately."""
    columns = TollesLawsonColumns(16, "cabin", "spline", FIELD_NT)
    r = calibration(EXACT)
    rows = np.ones(len(r), dtype=bool)
    rows[5000:5600] = False
    holed = r.take(rows)
    found = fit(holed, target="interference", columns=columns)
    whole = fit(r, target="interference", columns=columns)
    assert off_nt_between(found.coefficients, whole.coefficients, r) < 1e-4

    # by hand, in band, each piece cropped by 30 s
    made = columns(holed).matrix
    table = np.column_stack([made, holed["interference_cabin_nt"]])
    pieces = [signals.band_pass(table[part], 10.0)[300:-300] for part in (slice(0, 5000), slice(5000, None))]
    both = np.concatenate(pieces)
    by_hand = np.linalg.lstsq(both[:, :-1], both[:, -1])[0]
    plain = fit(holed, target="interference", columns=columns, solver="least_squares")
    assert off_nt_between(plain.coefficients, by_hand, r) < 1e-9


def off_nt_between(one, other, recording):
    """Largest in-band RMS that a difference of one coefficient makes."""
    size = np.sqrt(np.mean(signals.in_band(terms(recording), recording.time_s) ** 2, axis=0))
    return float(np.abs((one - other) * size).max())


@pytest.mark.parametrize("band", ["in", "broad"])
def test_dropouts_are_left_out_of_a_fit_to_labels_without_their_neighbors(band):
    """The filter runs through, since labels are right in a dropout; by hand with plain least squares."""
    train, _, test = parts(calibration(VECTOR))
    read = (np.arange(len(train)) % 170) > 60
    holed = replace(
        train, data={**train.data, "mag_cabin_nt": 0.0 * train.time_s, "mag_cabin_valid": read.astype(float)}
    )
    found = fit(holed, target="interference", band=band, solver="least_squares")
    matrix, label = COLUMNS(train).matrix, train["interference_cabin_nt"]
    if band == "in":
        both = signals.band_pass(np.column_stack([matrix, label]), 10.0)[300:-300][read[300:-300]]
        by_hand = np.linalg.lstsq(both[:, :-1], both[:, -1])[0]
    else:
        centered = matrix[read] - matrix[read].mean(axis=0)
        by_hand = np.linalg.lstsq(centered, label[read] - label[read].mean())[0]
    wanted = np.einsum("nc,c->n", COLUMNS(test).matrix, by_hand) + (label - matrix @ by_hand)[read].mean()
    np.testing.assert_allclose(found.estimate(COLUMNS(test)), wanted, rtol=0, atol=1e-5)

    error = test["interference_cabin_nt"] - wanted
    ridge, all_rows = (fit(r, target="interference", band=band).estimate(COLUMNS(test)) for r in (holed, train))
    np.testing.assert_allclose(ridge, wanted, rtol=0, atol=0.02 * error.std())
    assert np.std(all_rows - wanted) > 0.05 * error.std()


def test_settings_that_contradict_each_other_are_refused():
    r = bird(1)
    for settings in ({"order": 1}, {"vertical": True}):
        with pytest.raises(RequestError, match="order and vertical need band 'in'"):
            fit(r, target="interference", band="broad", **settings)
    with pytest.raises(RequestError, match="target 'measured' needs band 'in'"):
        fit(r, band="broad")


def test_too_few_rows_are_refused():
    """Ten for each column, after 30 s at each end of each piece."""
    r = bird(0).take(slice(1330, None))  # from a turn on: a shorter stretch of a leg is unobservable
    with pytest.raises(DataError, match=r"a fit of 31 columns needs at least 310 training rows after 30 s.*has 301"):
        fit(r.take(slice(0, 901)), order=4, vertical=True)
    with pytest.raises(DataError, match=r"16 columns needs at least 160 .* has 0; the longest piece .* lasts 49\.9 s"):
        fit(r.take(slice(0, 500)))
    with pytest.raises(DataError, match="has 101"):
        fit(r.take(slice(0, 701)))
    with pytest.raises(DataError, match=r"16 columns needs at least 160 training rows, and has 159"):
        fit(r.take(slice(0, 159)), target="interference", band="broad")
    fit(r.take(slice(0, 160)), target="interference", band="broad")
    fit(r.take(slice(0, 760)))
    with pytest.raises(DataError, match=r"has 159"):
        fit(r.take(slice(0, 759)))

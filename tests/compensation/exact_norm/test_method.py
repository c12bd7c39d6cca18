"""The exact norm in a known world: how close it comes, with labels and without, files, and what it tells."""

from dataclasses import replace

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from magsim.benchmark.twins import twin_of
from magsim.compensation import create, load
from magsim.compensation.exact_norm import estimation
from magsim.errors import DataError, RequestError
from magsim.signals import in_band
from tests.support.inertial import CURRENT_NT, PERMANENT_NT, Inertial, flown
from tests.support.methods import without


def train_of(recording):
    return recording.take(recording["split"] < 2).labeled()


def missed_pt(method, recording):
    """In-band deviation of the estimate from the label [pT]."""
    error = recording["interference_cabin_nt"] - method.interference(recording)
    return 1e3 * float(in_band(error, recording.time_s).std())


@pytest.fixture(scope="module")
def method():
    return create("exact_norm").fit(train_of(flown()))


@pytest.fixture(scope="module")
def test_rows():
    return flown().where(split="test")


def test_it_comes_to_a_picotesla_where_tolles_lawson_misses_hundreds(method, test_rows):
    tolles_lawson = create("tl16").fit(train_of(flown()))
    assert missed_pt(tolles_lawson, test_rows) > 100.0
    assert missed_pt(method, test_rows) < 3.0


@pytest.mark.parametrize("name", ["exact_norm_model", "exact_norm_measured"])
def test_without_labels_the_noise_of_the_reading_is_what_it_costs(name, test_rows):
    train = without(train_of(flown()), "interference_", "projection_")
    found = create(name).fit(train)
    assert missed_pt(found, test_rows) < 6.0


def test_labels_are_not_read_where_the_target_is_another(test_rows):
    train = train_of(flown())
    wrong = replace(train, data={**train.data, "interference_cabin_nt": 7.0 * train["interference_cabin_nt"]})
    blind, seeing = (create("exact_norm_model").fit(rows) for rows in (train, wrong))
    np.testing.assert_array_equal(blind.interference(test_rows), seeing.interference(test_rows))


def test_the_reading_is_not_an_input(method, test_rows):
    assert "mag_{sensor}_nt" not in method.requires
    assert "ins_{angle}_deg" not in method.requires
    shifted = replace(test_rows, data={**test_rows.data, "mag_cabin_nt": test_rows["mag_cabin_nt"] + 50.0})
    np.testing.assert_array_equal(method.interference(shifted), method.interference(test_rows))


def test_coefficients_are_those_of_the_aircraft(method):
    terms = {term.name: term for term in method.coefficients()}
    for axis, expected in zip("xyz", CURRENT_NT, strict=True):
        found = terms[f"current pump -> {axis}"]
        assert found.value == pytest.approx(expected, abs=4.0 * found.error + 0.01)
        assert found.unit == "nT/A"
    permanent = np.array([terms[f"permanent -> {axis}"].value for axis in "xyz"])
    # steel along the mean field is told from magnets by turns alone
    np.testing.assert_allclose(permanent, PERMANENT_NT, rtol=0.1, atol=30.0)


def test_shares_add_up_to_the_estimate(method, test_rows):
    shares = method.shares(test_rows)
    assert {"permanent", "induced", "eddy", "current pump", "surface aileron"} <= set(shares)
    np.testing.assert_allclose(sum(shares.values()), method.interference(test_rows), atol=1e-9)
    assert method.uncertainty(test_rows).shape == (len(test_rows),)


def test_an_aircraft_without_channels_is_compensated_too(test_rows):
    bare = without(train_of(flown()), "cur_", "surface_")
    found = create("exact_norm").fit(bare)
    assert found.requires == ("flux_{sensor}_{axis}_nt",)
    assert found.interference(without(test_rows, "cur_", "surface_")).shape == (len(test_rows),)


def test_the_ins_and_the_model_field_do_for_a_background(test_rows):
    found = create("exact_norm", direction="ins").fit(train_of(flown()))
    assert "ins_{angle}_deg" in found.requires
    assert missed_pt(found, test_rows) < 60.0


def test_it_comes_back_from_a_file(method, test_rows, tmp_path):
    method.save(tmp_path / "model")
    np.testing.assert_array_equal(load(tmp_path / "model").interference(test_rows), method.interference(test_rows))


def test_a_fit_has_the_same_bits_whatever_the_threads(method, test_rows):
    with threadpool_limits(limits=2, user_api="blas"):
        other = create("exact_norm").fit(train_of(flown()))
        estimate = other.interference(test_rows)
    np.testing.assert_array_equal(other.found_.root, method.found_.root)
    np.testing.assert_array_equal(estimate, method.interference(test_rows))


def test_no_row_beyond_the_look_ahead_counts(method, test_rows):
    changed = {name: values.copy() for name, values in test_rows.data.items()}
    for axis in "xyz":
        changed[f"flux_nose_{axis}_nt"][3000:] += 900.0
    before, after = method.interference(test_rows), method.interference(replace(test_rows, data=changed))
    first = 3000 - method.lookahead_rows
    np.testing.assert_array_equal(before[:first], after[:first])
    assert not np.array_equal(before[:3000], after[:3000])


def test_without_look_ahead_it_is_still_better_than_tolles_lawson(test_rows):
    causal = create("exact_norm_causal").fit(train_of(flown()))
    assert causal.lookahead_rows == 0
    late = create("tl16").fit(train_of(flown()))
    assert missed_pt(causal, test_rows) < 0.5 * missed_pt(late, test_rows)


def test_a_missing_fluxgate_or_date_is_named():
    train = train_of(flown())
    with pytest.raises(RequestError, match="flux_"):
        create("exact_norm").fit(without(train, "flux_"))
    with pytest.raises(RequestError, match="does not say when it was flown"):
        create("exact_norm").fit(replace(train, meta={}))
    with pytest.raises(RequestError, match="ins_"):
        create("exact_norm").fit(without(train, "ins_"))


def test_level_flight_and_dead_channels_are_refused():
    train = train_of(flown())
    level = train.take(slice(20, 90))
    with pytest.raises(DataError, match="unobservable; fly pitch"):
        create("exact_norm").fit(level)
    dead = replace(train, data={**train.data, "flux_nose_y_nt": np.full(len(train), 12_345.0)})
    with pytest.raises(DataError, match="flux_nose_y_nt"):
        create("exact_norm").fit(dead)


def test_two_flights_are_fitted_together(test_rows):
    other = flown(Inertial(offset_n=(40.0, -30.0, 20.0)), seed=3)
    found = create("exact_norm").fit([train_of(flown()), train_of(other)])
    assert missed_pt(found, test_rows) < 3.0


@pytest.mark.parametrize("name", ["exact_norm_model", "exact_norm_measured"])
def test_without_labels_geology_makes_no_share_of_the_field(name, monkeypatch):
    """Anomalies in the reading and in the fluxgate: matrices with a trace would answer with a share of them."""
    recording = train_of(flown())
    rough = twin_of(recording, "cabin", np.random.default_rng(3), 20.0).recording

    def share():
        fitted = create(name).fit(rough)
        rows = [number for number, signal in enumerate(fitted._sources.table) if signal.group == "induced"]
        return abs(np.trace(fitted._found.coefficients[rows])) / 3.0

    held = share()
    monkeypatch.setattr(estimation, "TRACE", 1.0)
    assert held < 0.005
    assert held < 0.5 * share()

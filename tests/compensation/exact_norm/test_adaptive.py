"""The exact norm that follows the magnets of the day: another day, and no anomaly eaten."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.benchmark import judge
from magsim.benchmark.formulas import anomaly_gain
from magsim.compensation import create
from magsim.signals import in_band
from tests.support.inertial import flown

CHANGE_NT = np.array([6.0, -4.0, 9.0])


def another_day(recording):
    """The same flight with other magnets: 2 % of what they are."""
    earth = np.column_stack([recording[f"earth_cabin_{axis}_nt"] for axis in "xyz"])
    more = (earth / recording["clean_cabin_nt"][:, None]) @ CHANGE_NT
    changed = {name: recording[name] + more for name in ("mag_cabin_nt", "interference_cabin_nt")}
    return replace(recording, data={**recording.data, **changed})


def missed_pt(method, recording):
    error = recording["interference_cabin_nt"] - method.interference(recording)
    return 1e3 * float(in_band(error, recording.time_s).std())


@pytest.fixture(scope="module")
def methods():
    train = flown().take(flown()["split"] < 2).labeled()
    return {name: create(name).fit(train) for name in ("exact_norm", "exact_norm_adaptive")}


def test_the_magnets_of_another_day_are_learned_in_flight(methods):
    later = another_day(flown()).where(split="test")
    fixed, adaptive = (missed_pt(method, later) for method in methods.values())
    assert fixed > 100.0
    assert adaptive < 0.9 * fixed
    eager = create("exact_norm_adaptive", anchor_s=60.0).fit(flown().take(flown()["split"] < 2).labeled())
    # the first half minute is the filter's, and then it learns
    assert missed_pt(eager, later) < 0.5 * fixed


def test_what_has_not_changed_costs_little(methods):
    rows = flown().where(split="test")
    assert missed_pt(methods["exact_norm_adaptive"], rows) < 60.0


def test_it_eats_no_anomaly(methods):
    found = judge(methods["exact_norm_adaptive"], flown(), sensor="cabin")
    assert anomaly_gain(found) == pytest.approx(1.0, abs=0.05)


def test_it_declares_the_reading(methods):
    assert "mag_{sensor}_nt" in methods["exact_norm_adaptive"].requires
    assert "mag_{sensor}_nt" not in methods["exact_norm"].requires


def test_shares_add_up_with_what_was_learned(methods):
    rows = flown().where(split="test").take(slice(0, 900))
    method = methods["exact_norm_adaptive"]
    shares = method.shares(rows)
    assert "learned in flight" in shares
    np.testing.assert_allclose(sum(shares.values()), method.interference(rows), atol=1e-9)

"""Statistics and scores of ``tests/benchmarks/physics_methods.py``."""

import math
from dataclasses import replace

import numpy as np
import pytest

from magsim.recording import Recording
from magsim.signals import band_pass, off_ends
from tests.benchmarks.physics_rows.intervals import geometric_mean
from tests.benchmarks.physics_rows.scoring import Score, coverage, score
from tests.support.methods import Stub


def test_the_interval_of_a_mean_is_students():
    # t of 4 degrees of freedom at 97.5 %: 2.7764; logs 0 to 4 have a standard deviation of 1.5811
    mean = geometric_mean(np.exp([0.0, 1.0, 2.0, 3.0, 4.0]))
    assert mean.value == pytest.approx(math.exp(2.0))
    assert math.log(mean.high / mean.value) == pytest.approx(2.7764 * 1.5811 / math.sqrt(5), rel=1e-4)
    assert math.log(mean.value / mean.low) == pytest.approx(2.7764 * 1.5811 / math.sqrt(5), rel=1e-4)


def test_it_covers_what_it_says_at_twelve_sets():
    random = np.random.default_rng(1)
    means = [geometric_mean(np.exp(0.3 * random.standard_normal(12))) for _ in range(2000)]
    held = np.mean([mean.low <= 1.0 <= mean.high for mean in means])
    assert held == pytest.approx(0.95, abs=0.015)


def test_one_set_has_no_interval_and_proves_nothing():
    mean = geometric_mean([3.0])
    assert mean.value == pytest.approx(3.0)
    assert not mean.low >= 1.0


def test_what_is_left_beyond_the_floor_is_counted_in_picotesla():
    assert Score(0.005, 15.0, 0.003, 0.003, 1.0, 0.1).excess_pt == pytest.approx(4.0)
    assert Score(0.0029, 15.0, 0.003, 0.003, 1.0, 0.1).excess_pt == 0.0
    assert Score(0.005, 15.0, 0.003, 0.003, 1.0, 0.1).ir == pytest.approx(3000.0)


@pytest.fixture(scope="module")
def judged() -> Recording:
    """Ten minutes of noise of a known size in band, on a clean field of zero."""
    random, time_s = np.random.default_rng(3), np.arange(6000) / 10.0
    label = band_pass(random.standard_normal(len(time_s)), 10.0)
    noise = 0.1 * band_pass(random.standard_normal(len(time_s)), 10.0)
    nothing = np.zeros(len(time_s))
    data = {
        "mag_cabin_nt": label + noise,
        "interference_cabin_nt": label,
        "clean_cabin_nt": nothing,
        "split": nothing + 2.0,
    }
    return Recording("judged", time_s, data)


class Half(Stub):
    """Estimates half of the reading, and says how large its error is."""

    stated_nt: float = 0.0

    def _uncertainty(self, recording: Recording) -> np.ndarray:
        return np.full(len(recording), self.stated_nt)


def _half(recording: Recording, share: float = 0.5) -> Half:
    method = Half(function=lambda one: share * one["mag_cabin_nt"])
    return method.fit(replace(recording, data={**recording.data, "split": np.zeros(len(recording))}))


def test_a_score_is_that_of_the_judge(judged):
    found = score(_half(judged), judged, 0.5)
    assert found.std_nt == pytest.approx(found.raw_nt / 2.0)
    assert found.floor_nt == pytest.approx(found.raw_nt / 10.0, rel=0.1)
    assert found.gain == pytest.approx(0.5)
    assert math.isnan(found.covered)
    assert found.people_nt == found.floor_nt


def test_people_who_move_add_to_the_floor_what_they_add_to_the_length(judged):
    field = np.outer(np.ones(len(judged)), [30000.0, 0.0, 40000.0])
    swayed = band_pass(np.random.default_rng(5).standard_normal(len(judged)), 10.0)
    moved = np.outer(swayed, [0.6, 5.0, 0.8])  # along the field, and across it, which the length does not see
    parts = {"earth": field, "crew": moved}
    data = {f"{name}_cabin_{axis}_nt": parts[name][:, i] for name in parts for i, axis in enumerate("xyz")}
    reading = judged["mag_cabin_nt"] + swayed
    label = judged["interference_cabin_nt"] + swayed
    whole = replace(judged, data={**judged.data, **data, "mag_cabin_nt": reading, "interference_cabin_nt": label})
    noise = judged["mag_cabin_nt"] - judged["interference_cabin_nt"]
    expected = np.std(band_pass(noise + swayed, 10.0)[off_ends(judged.time_s)])
    assert score(_half(whole), whole).people_nt == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize(("times", "share"), [(1.0, 0.95), (0.5, 0.67)])
def test_coverage_is_the_share_of_errors_within_two_standard_errors(judged, times, share):
    method = _half(judged)
    error = judged["interference_cabin_nt"] - 0.5 * judged["mag_cabin_nt"]
    method.stated_nt = times * float(np.std(band_pass(error, 10.0)))
    assert coverage(method, judged) == pytest.approx(share, abs=0.03)

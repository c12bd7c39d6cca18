"""Which rows of the calibration judge a network that has not learned from them."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.compensation.networks.folds import everything, folds_of, runs
from magsim.dataset import training_rows
from magsim.errors import RequestError
from tests.support.worlds import World, calibration


@pytest.fixture(scope="module")
def recording():
    return calibration(World())


def judged(folds, recording):
    """How often each row of a recording judges."""
    count = np.zeros(len(recording), dtype=int)
    for fold in folds:
        for watched in fold.watched:
            count += watched.rows
    return count


@pytest.mark.parametrize(("hold_out", "count"), [("legs", 4), ("legs", 2), ("blocks", 4), ("blocks", 3)])
def test_every_row_judges_once_and_is_apart_from_what_its_fold_learned(recording, hold_out, count):
    training = training_rows([recording.where(split="train")])
    folds = folds_of(training, hold_out, count)
    assert len(folds) == min(count, 3 if hold_out == "legs" else count)  # leg 4 is for validation
    assert set(judged(folds, training.recordings[0])) == {1}
    time_s = training.recordings[0].time_s
    for fold in folds:
        held = np.concatenate([w.recording.time_s[w.rows] for w in fold.watched])
        (learned,) = fold.learned
        assert learned.mean() > 0.3
        assert np.abs(held[:, None] - time_s[learned][None, ::7]).min() > 2.9


def test_a_leg_is_left_out_with_its_turn_and_in_both_circuits(recording):
    whole_flight = replace(recording, data={n: v for n, v in recording.data.items() if n != "split"})
    first, *_ = folds_of(training_rows([whole_flight]), "legs", 4)
    (watched,) = first.watched
    np.testing.assert_array_equal(watched.rows, recording["leg"] == 1.0)
    assert len(runs(watched.rows)) == 2


def test_the_split_is_one_fold_of_the_validation_rows(recording):
    training = training_rows([recording, recording.where(split="train"), recording.where(split="test")])
    (fold,) = folds_of(training, "split", 4)
    np.testing.assert_array_equal(fold.learned[0], training.recordings[0]["split"] == 0.0)
    assert fold.learned[1].all()
    # judged in the whole recording, so that the filter runs through
    (only,) = fold.watched
    assert only.recording is training.recordings[0]
    np.testing.assert_array_equal(only.rows, training.recordings[0]["split"] == 1.0)
    bare = replace(recording, data={n: v for n, v in recording.data.items() if n != "split"})
    assert folds_of(training_rows([bare]), "split", 4) == []
    both = everything(training_rows([bare]))
    assert both.learned[0].all()
    assert both.watched[0].rows.all()


def test_blocks_take_the_place_of_legs_that_are_not_numbered(recording):
    bare = replace(recording, data={n: v for n, v in recording.data.items() if n != "leg"})
    by_legs, by_blocks = (folds_of(training_rows([bare]), hold_out, 4) for hold_out in ("legs", "blocks"))
    for one, other in zip(by_legs, by_blocks, strict=True):
        np.testing.assert_array_equal(one.watched[0].rows, other.watched[0].rows)


def flights(recording, *metas):
    return training_rows([replace(recording.where(split="train"), meta=meta) for meta in metas])


def test_flights_days_and_aircraft_are_left_out_whole(recording):
    day, next_day = "2025-03-13T02:00:00+00:00", "2025-03-14T02:00:00+00:00"
    known = {"aircraft": "c208b", "individual": 1, "start_utc": day}
    training = flights(recording, known, known | {"start_utc": next_day}, known | {"individual": 2})
    for hold_out, first_fold in (("flights", [0]), ("days", [0, 2]), ("individuals", [0, 1])):
        folds = folds_of(training, hold_out, 5)
        assert len(folds) == {"flights": 3, "days": 2, "individuals": 2}[hold_out]
        assert [w.recording for w in folds[0].watched] == [training.recordings[i] for i in first_fold]
        assert [i for i, rows in enumerate(folds[0].learned) if not rows.any()] == first_fold


def test_what_cannot_be_divided_is_refused(recording):
    with pytest.raises(RequestError, match="hold_out 'flights' needs recordings of two flights or more"):
        folds_of(flights(recording, {}), "flights", 4)
    with pytest.raises(RequestError, match="hold_out 'days' needs recordings of two days or more"):
        folds_of(flights(recording, *[{"start_utc": "2025-03-13T02:00:00"}] * 2), "days", 4)
    with pytest.raises(RequestError, match="does not tell its aircraft and individual"):
        folds_of(flights(recording, {}, {}), "individuals", 4)
    with pytest.raises(RequestError, match=r"hold_out 'blocks': there are too few blocks \(1\) for two folds"):
        folds_of(training_rows([recording.take(slice(0, 100))]), "blocks", 4)

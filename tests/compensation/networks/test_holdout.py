"""Which rows of the calibration decide how long to train."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.compensation.networks.holdout import blocks, legs, whole
from magsim.dataset import training_rows
from tests.support.worlds import World, calibration, parts


@pytest.fixture(scope="module")
def recording():
    return calibration(World())


def test_blocks_cover_a_quarter_and_are_apart_from_what_is_learned(recording):
    train, valid, _ = parts(recording)
    learned, watched = blocks([train, valid])
    held = np.concatenate([w.recording.time_s[w.rows] for w in watched])
    kept = np.concatenate([r.time_s for r in learned])
    assert 0.2 < len(held) / (len(train) + len(valid)) < 0.3
    distance = np.abs(held[:, None] - kept[None, ::7]).min()
    assert distance > 5.9
    flown = np.concatenate([w.recording["leg"][w.rows] for w in watched])
    assert set(flown) == {1.0, 2.0, 3.0, 4.0}


def test_legs_hold_the_validation_rows_out(recording):
    training = training_rows([recording, recording.where(split="train"), recording.where(split="test")])
    learned, watched = legs(training)
    train, _, _ = parts(recording)
    assert learned == [train, train]
    # judged in the whole recording, so that the filter runs through
    (only,) = watched
    assert only.recording is training.recordings[0]
    np.testing.assert_array_equal(only.rows, training.recordings[0]["split"] == 1.0)


def test_a_recording_of_validation_rows_alone_is_not_learned(recording):
    train, valid, _ = parts(recording)
    training = training_rows([train, valid])
    learned, watched = legs(training)
    assert learned == [train]
    assert watched[0].recording == valid
    assert watched[0].rows.all()


def test_without_validation_rows_nothing_is_watched(recording):
    bare = replace(recording, data={n: v for n, v in recording.data.items() if n != "split"})
    learned, watched = legs(training_rows([bare]))
    assert learned == [bare.labeled()]
    assert watched == []
    (all_rows,) = whole(learned)
    assert all_rows.rows.all()

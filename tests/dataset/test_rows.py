"""Training rows and test rows."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.dataset import pick_sensor, pieces_to_judge, training_rows
from magsim.errors import RequestError
from magsim.recording import Recording


def flight(split=None, *, name="r", time_s=None, **columns):
    n = len(split) if split is not None else len(time_s)
    data = {"mag_cabin_nt": np.arange(n) + 0.5, "clean_cabin_nt": np.zeros(n), **columns}
    if split is not None:
        data["split"] = np.array(split, dtype=float)
    return Recording(name, np.arange(n) / 10.0 if time_s is None else time_s, data, {"seed": 1, "rate_hz": 10.0})


SPLIT = [0] * 10 + [1] * 5 + [2] * 8


def test_training_and_validation_rows_that_touch_stay_one_piece():
    training = training_rows([flight(SPLIT)])
    (recording,) = training.recordings
    np.testing.assert_array_equal(recording.time_s, np.arange(15) / 10.0)
    assert recording.pieces() == (recording,)
    np.testing.assert_array_equal(training.valid[0], [False] * 10 + [True] * 5)
    assert training.rows == {"train": 10, "valid": 5}
    assert training.sensor == "cabin"


def test_rows_stay_in_the_order_of_time_and_test_rows_leave_a_gap():
    (recording,) = training_rows([flight([1, 1, 0, 0, 2, 2, 0, 0, 1, 0])]).recordings
    np.testing.assert_array_equal(recording["split"], [1, 1, 0, 0, 0, 0, 1, 0])
    assert [piece.time_s.tolist() for piece in recording.pieces()] == [
        [0.0, 0.1, 0.2, 0.3],
        pytest.approx([0.6, 0.7, 0.8, 0.9]),
    ]


def test_copies_are_labeled():
    """Without truth, scenario and seed."""
    (recording,) = training_rows([flight(SPLIT, interference_cabin_nt=np.ones(23))]).recordings
    assert set(recording.data) == {"mag_cabin_nt", "interference_cabin_nt", "split"}
    assert dict(recording.meta) == {"rate_hz": 10.0}


def test_without_a_split_all_rows_are_for_training():
    training = training_rows([flight(time_s=np.arange(7.0)), flight(SPLIT)])
    assert [len(recording) for recording in training.recordings] == [7, 15]
    assert not training.valid[0].any()
    assert training.rows == {"train": 17, "valid": 5}


def test_recordings_with_fewer_than_two_rows_are_left_out():
    training = training_rows([flight([0, 2, 2]), flight(SPLIT, name="kept"), flight([2, 2])])
    assert [recording.name for recording in training.recordings] == ["kept"]


def test_masks_cannot_be_changed():
    (mask,) = training_rows([flight(SPLIT)]).valid
    with pytest.raises(ValueError, match="read-only"):
        mask[0] = True


def test_what_cannot_be_learned_is_refused():
    with pytest.raises(RequestError, match="nothing to fit: no recording was given"):
        training_rows([])
    with pytest.raises(RequestError, match="no training rows: no row of 'r', 's' has split = train"):
        training_rows([flight([2, 2, 2]), flight([1, 1, 2], name="s")])
    with pytest.raises(RequestError, match="recording 'r' has no scalar magnetometer 'wing'; it has cabin"):
        training_rows([flight(SPLIT)], "wing")
    two = flight(SPLIT, name="two", mag_wing_nt=np.zeros(23))
    assert training_rows([two, two], "wing").sensor == "wing"
    with pytest.raises(RequestError, match="recording 'r' has no scalar magnetometer 'wing'"):
        training_rows([two, flight(SPLIT)], "wing")


def test_the_first_sensor_of_the_first_recording():
    two = flight(SPLIT, mag_wing_nt=np.zeros(23))
    assert pick_sensor([two]) == "cabin"
    assert pick_sensor([two], "wing") == "wing"
    bare = replace(two, data={"split": two["split"]})
    with pytest.raises(RequestError, match="recording 'r' has no scalar magnetometer"):
        pick_sensor([bare])


def test_a_test_piece_keeps_its_lead_in():
    (piece,) = pieces_to_judge(flight([0, 0, 1, 1, 2, 2, 2, 0, 0]), "cabin")
    # all that was flown before the last test row, and nothing after it
    np.testing.assert_allclose(piece.whole.time_s, np.arange(7) / 10.0)
    np.testing.assert_array_equal(piece.judged, [False] * 4 + [True] * 3)
    assert piece.reads.all()


def test_a_gap_ends_a_lead_in():
    time_s = np.r_[np.arange(6), np.arange(20, 26)] / 10.0
    split = [0, 0, 2, 2, 0, 0, 0, 0, 2, 2, 2, 0]
    first, second = pieces_to_judge(flight(split, time_s=time_s), "cabin")
    np.testing.assert_array_equal(first.whole.time_s, time_s[:4])
    np.testing.assert_array_equal(second.whole.time_s, time_s[6:11])
    np.testing.assert_array_equal(second.judged, [False, False, True, True, True])


def test_stretches_without_two_test_rows_are_left_out():
    time_s = np.r_[np.arange(6), np.arange(20, 26)] / 10.0
    assert len(pieces_to_judge(flight([0] * 5 + [2] + [0, 0, 2, 2, 0, 0], time_s=time_s), "cabin")) == 1
    assert pieces_to_judge(flight([0, 0, 1]), "cabin") == ()


def test_dropouts_are_not_judged_but_stay_in_the_piece():
    read = np.array([1, 0, 1, 1, 1, 0, 1, 0], dtype=float)
    (piece,) = pieces_to_judge(flight([0, 0, 0, 2, 2, 2, 2, 2], mag_cabin_valid=read), "cabin")
    # it ends with the last row that is judged
    np.testing.assert_array_equal(piece.judged, [False, False, False, True, True, False, True])
    np.testing.assert_array_equal(piece.reads, read[:7] == 1.0)
    assert len(piece.whole) == 7
    silent = flight([2] * 4, mag_cabin_valid=np.zeros(4))
    assert pieces_to_judge(silent, "cabin") == ()


def test_what_cannot_be_judged_is_refused():
    with pytest.raises(RequestError, match="recording 'r' has no column 'split', which marks training and test rows"):
        pieces_to_judge(flight(time_s=np.arange(4.0)), "cabin")
    with pytest.raises(RequestError, match="no scalar magnetometer 'wing'; it has cabin"):
        pieces_to_judge(flight(SPLIT), "wing")

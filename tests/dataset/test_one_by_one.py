"""Training rows that are read flight by flight."""

import gc
import weakref

import numpy as np
import pytest

from magsim.dataset import flights_of, open_training, read_training
from magsim.errors import RequestError
from magsim.recording import Recording, file, write_recordings
from tests.dataset.test_rows import SPLIT, flight

SPLITS = {"a": SPLIT, "b": [2] * 5, "c": [0, 2, 2], "d": [1] * 4, "e": SPLIT[::-1]}
"""``b`` and ``c`` have no two rows to learn from."""


@pytest.fixture
def folder(tmp_path):
    for name, split in SPLITS.items():
        flight(split, name=name).write(tmp_path / f"{name}.h5")
    write_recordings(tmp_path / "f.h5", [flight(SPLIT, name="f"), flight(time_s=np.arange(9.0), name="g")])
    return tmp_path


def test_the_rows_are_those_that_would_be_in_memory(folder):
    whole, opened = read_training(flights_of(folder)), open_training(flights_of(folder))
    assert [recording.name for recording in whole.recordings] == ["a", "d", "e", "f", "g"]
    assert tuple(opened.recordings) == whole.recordings
    assert all(np.array_equal(*masks) for masks in zip(opened.valid, whole.valid, strict=True))
    assert opened.rows == whole.rows == {"train": 39, "valid": 19}
    assert opened.sensor == whole.sensor == "cabin"
    assert opened.recordings[-1] == whole.recordings[-1]
    assert tuple(opened.recordings[1:3]) == whole.recordings[1:3]


def test_each_is_read_once_in_turn_and_forgotten_before_the_next(folder, monkeypatch):
    read, alive = [], []
    original = file.read_number

    def spy(path, number):
        gc.collect()
        assert not any(reference() is not None for reference in alive)
        read.append((path.name, number))
        return original(path, number)

    training = open_training(flights_of(folder), "cabin")
    monkeypatch.setattr(file, "read_number", spy)
    for number in range(len(training.recordings)):
        recording, valid = training.recordings[number], training.valid[number]
        assert len(recording) == len(valid)
        alive.append(weakref.ref(recording))
        del recording
    assert read == [("a.h5", 0), ("d.h5", 0), ("e.h5", 0), ("f.h5", 0), ("f.h5", 1)]


def test_checks_see_every_recording_when_it_is_read(folder):
    seen = []
    training = open_training(flights_of(folder)).checked(lambda recording: seen.append(recording.name))
    assert not seen
    assert [r.name for r in training.recordings] == seen == ["a", "d", "e", "f", "g"]
    assert training.rows == {"train": 39, "valid": 19}


def test_what_cannot_be_learned_is_refused(folder, tmp_path):
    for name in ("a.h5", "e.h5", "f.h5"):
        (folder / name).unlink()
    with pytest.raises(RequestError, match="no training rows: no row of 'b', 'c', 'd' has split = train"):
        open_training([info for info in flights_of(folder) if info.name != "c" or info.splits.pop("train")])
    bare = Recording("bare", np.arange(5.0), {"ins_roll_deg": np.zeros(5)})
    flight(SPLIT).write(tmp_path / "0.h5")
    bare.write(tmp_path / "1.h5")
    training = open_training(flights_of([tmp_path / "0.h5", tmp_path / "1.h5"]))
    with pytest.raises(RequestError, match="recording 'bare' has no scalar magnetometer 'cabin'; it has none"):
        list(training.recordings)

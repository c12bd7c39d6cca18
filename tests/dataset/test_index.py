"""What is known of flights before their values are read."""

import numpy as np
import pytest

from magsim.dataset import FlightInfo, split_rows
from magsim.dataset.index import index_file, recording_files
from magsim.errors import DataError, RequestError
from magsim.recording import write_recordings
from tests.support.folders import flight

FLIGHTS = (flight("one", [0] * 5 + [1] * 3), flight("plain", None, rows=4), flight("two", [2, 2, 0, 9]))


def test_an_index_has_names_rows_splits_and_places(tmp_path):
    path = tmp_path / "a.h5"
    write_recordings(path, FLIGHTS)
    infos = list(index_file(path))
    assert infos == [
        FlightInfo("one", 8, {"train": 5, "valid": 3}, path, 0),
        FlightInfo("plain", 4, {}, path, 1),
        FlightInfo("two", 4, {"train": 1, "test": 2}, path, 2),
    ]
    assert [info.file_name for info in infos] == ["a.h5"] * 3
    assert [info.read() for info in infos] == list(FLIGHTS)


@pytest.mark.parametrize("recording", FLIGHTS, ids=lambda recording: recording.name)
def test_a_recording_in_memory_has_the_same_index_without_a_file(tmp_path, recording):
    recording.write(tmp_path / "a.h5")
    (stored,) = index_file(tmp_path / "a.h5")
    info = FlightInfo.of(recording)
    assert (info.name, info.rows, info.splits) == (stored.name, stored.rows, stored.splits)
    assert info.read() is recording
    assert (info.file, info.file_name) == (None, "")


def test_splits_are_counted_in_their_order():
    assert split_rows(np.array([2.0, 0.0, 0.0, 1.0, 7.0])) == {"train": 2, "valid": 1, "test": 1}
    assert list(split_rows(np.array([2.0, 1.0]))) == ["valid", "test"]


def test_files_of_a_folder_come_by_their_names_without_hidden_ones(tmp_path):
    for name in ("b.h5", "a.h5", ".c.h5", "d.txt"):
        (tmp_path / name).write_text("")
    assert [path.name for path in recording_files(tmp_path)] == ["a.h5", "b.h5"]
    with pytest.raises(RequestError, match="there is no such folder"):
        recording_files(tmp_path / "a.h5")


def test_files_that_are_no_recordings(tmp_path):
    (tmp_path / "a.h5").write_bytes(b"no recording")
    with pytest.raises(DataError, match=r"a\.h5"):
        list(index_file(tmp_path / "a.h5"))
    with pytest.raises(RequestError):
        list(index_file(tmp_path / "b.h5"))

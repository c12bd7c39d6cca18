"""Folders of recordings as data sets: index, splits, checksums."""

from pathlib import Path

import pytest

from magsim import Dataset
from magsim.dataset import MANIFEST
from magsim.errors import DataError, RequestError
from magsim.recording import write_recordings
from tests.support.folders import flight, manifest_of


@pytest.fixture
def folder(tmp_path) -> Path:
    write_recordings(tmp_path / "b.h5", [flight("three", [2] * 6)])
    write_recordings(tmp_path / "a.h5", [flight("one", [0] * 5 + [1] * 3), flight("two", [2] * 4)])
    (tmp_path / MANIFEST).write_text(manifest_of(tmp_path).to_json())
    (tmp_path / ".half.part.h5").write_text("being written")
    return tmp_path


def test_the_index_has_files_rows_and_splits(folder):
    dataset = Dataset(folder, check=True)
    assert [path.name for path in dataset.files] == ["a.h5", "b.h5"]
    found = [(info.name, info.file.name, info.rows, dict(info.splits)) for info in dataset.flights.values()]
    assert found == [
        ("one", "a.h5", 8, {"train": 5, "valid": 3}),
        ("two", "a.h5", 4, {"test": 4}),
        ("three", "b.h5", 6, {"test": 6}),
    ]
    assert len(dataset) == 3
    assert [recording.name for recording in dataset] == ["one", "two", "three"]
    assert dataset["two"] == flight("two", [2] * 4)
    with pytest.raises(KeyError, match="there is no flight 'four'; it has one, two, three"):
        dataset["four"]
    assert [entry.name for entry in dataset.manifest.files] == ["a.h5", "b.h5"]


def test_splits_are_taken_over_all_flights(folder):
    dataset = Dataset(folder)
    assert [(part.name, len(part)) for part in dataset.split("train")] == [("one", 5)]
    assert [(part.name, len(part)) for part in dataset.split("test")] == [("two", 4), ("three", 6)]
    with pytest.raises(ValueError, match="there is no split 'tset'; allowed: train, valid, test"):
        dataset.split("tset")


def test_windows_of_all_files_or_of_some(folder):
    dataset = Dataset(folder)
    windows = dataset.windows(4)
    assert windows.flights == ("one", "two", "three")
    assert len(windows) == 5 + 1 + 3
    some = dataset.windows(4, role="segment", files=("b.h5",))
    assert some.take([0])[0, :, 0].tolist() == [2.0] * 4


def test_flights_without_splits_have_none(tmp_path):
    flight("plain", None, rows=4).write(tmp_path / "a.h5")
    assert dict(Dataset(tmp_path).flights["plain"].splits) == {}
    assert Dataset(tmp_path).split("train") == []


def test_checksums_that_differ_are_reported(folder):
    write_recordings(folder / "b.h5", [flight("three", [2] * 7)], force=True)
    write_recordings(folder / "c.h5", [flight("four", [2] * 7)])
    (folder / "a.h5").unlink()
    Dataset(folder)
    with pytest.raises(DataError) as caught:
        Dataset(folder, check=True)
    assert str(caught.value).splitlines() == [
        f"{folder / 'a.h5'}: is missing, manifest.json lists it",
        f"{folder / 'c.h5'}: manifest.json does not list it",
        f"{folder / 'b.h5'}: is not the file that manifest.json lists: its sha256 differs",
    ]


def test_names_of_flights_are_unique(folder):
    write_recordings(folder / "c.h5", [flight("one", [2] * 4)])
    with pytest.raises(DataError, match=r"c\.h5: flight 'one' is in a\.h5 already"):
        Dataset(folder)


@pytest.mark.parametrize(("name", "text"), [("no", "there is no such folder"), ("empty", "has no recording")])
def test_folders_that_are_none(tmp_path, name, text):
    (tmp_path / "empty").mkdir()
    with pytest.raises(RequestError, match=text):
        Dataset(tmp_path / name)


def test_a_folder_without_manifest_cannot_be_checked(folder):
    (folder / MANIFEST).unlink()
    with pytest.raises(RequestError, match=r"manifest\.json: there is no such file"):
        Dataset(folder, check=True)

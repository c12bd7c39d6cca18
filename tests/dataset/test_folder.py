"""Folders of recordings as data sets: index, splits, manifest."""

import json
from pathlib import Path

import numpy as np
import pytest

from magsim import Dataset
from magsim.dataset import MANIFEST, FileEntry, FlightEntry, Manifest, read_manifest
from magsim.errors import DataError, RequestError
from magsim.recording import Recording, write_recordings
from magsim.storage import checksum


def flight(name: str, splits: list[float], *, extra: bool = False) -> Recording:
    n = len(splits)
    data = {"mag_cabin_nt": np.arange(n) + 0.5, "split": np.array(splits, dtype=float)}
    if extra:
        data["ins_alt_m"] = np.zeros(n)
    return Recording(name, np.arange(n) * 0.1, data, {"seed": 1})


def manifest_of(folder: Path) -> Manifest:
    files = tuple(
        FileEntry(name=path.name, sha256=checksum.checksum_state(path).digest, size=path.stat().st_size, flights=())
        for path in sorted(folder.glob("*.h5"))
    )
    return Manifest(manifest=1, dataset="some", made_on={}, files=files)


@pytest.fixture
def folder(tmp_path) -> Path:
    write_recordings(tmp_path / "b.h5", [flight("three", [2] * 6)])
    write_recordings(tmp_path / "a.h5", [flight("one", [0] * 5 + [1] * 3), flight("two", [2] * 4)])
    (tmp_path / MANIFEST).write_text(manifest_of(tmp_path).to_json())
    (tmp_path / ".half.part.h5").write_text("being written")
    return tmp_path


def test_index_tells_files_rows_and_splits(folder):
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
    assert len(dataset["two"]) == 4
    with pytest.raises(KeyError, match="there is no flight 'four'; it has one, two, three"):
        dataset["four"]


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
    plain = Recording("plain", np.arange(4.0), {"mag_cabin_nt": np.zeros(4)})
    plain.write(tmp_path / "a.h5")
    assert dict(Dataset(tmp_path).flights["plain"].splits) == {}
    assert Dataset(tmp_path).split("train") == []


def test_checksums_that_differ_are_told(folder):
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


GOOD = {
    "manifest": 1,
    "dataset": "some",
    "made_on": {"numpy": "2"},
    "files": [
        {
            "name": "a.h5",
            "sha256": "0" * 64,
            "size": 5,
            "flights": [{"name": "one", "rows": 8, "digest": "d", "splits": {"train": 8}}],
        }
    ],
}


def test_a_manifest_is_read_as_it_is_written(tmp_path):
    path = tmp_path / MANIFEST
    path.write_text(json.dumps(GOOD))
    manifest = read_manifest(path)
    assert manifest.flights["one"] == FlightEntry(name="one", rows=8, digest="d", splits={"train": 8})
    assert manifest.size == 5
    path.write_text(manifest.to_json())
    assert read_manifest(path) == manifest


@pytest.mark.parametrize(
    ("change", "where"),
    [
        ({"manifest": 2}, "manifest"),
        ({"more": 1}, "more"),
        ({"files": [{**GOOD["files"][0], "name": "../a.h5"}]}, "files.0.name"),
        ({"files": [{**GOOD["files"][0], "name": "/etc/x.h5"}]}, "files.0.name"),
        ({"files": [{**GOOD["files"][0], "sha256": "z"}]}, "files.0.sha256"),
        ({"files": [{**GOOD["files"][0], "size": -1}]}, "files.0.size"),
        ({"made_on": {"numpy": "x" * 2000}}, "made_on.numpy"),
    ],
)
def test_manifests_that_are_none(tmp_path, change, where):
    path = tmp_path / MANIFEST
    path.write_text(json.dumps(GOOD | change))
    with pytest.raises(DataError, match=f"is no manifest of a data set: {where}"):
        read_manifest(path)


@pytest.mark.parametrize("text", ["", "{", "[" * 100_000, "\x00", "null"])
def test_text_that_is_no_manifest(tmp_path, text):
    path = tmp_path / MANIFEST
    path.write_text(text)
    with pytest.raises(DataError, match="is no manifest of a data set"):
        read_manifest(path)

"""Manifests: read as written, and refused where they are none."""

import json

import pytest

from magsim.dataset import MANIFEST, FlightEntry, read_bounded, read_manifest
from magsim.dataset import manifest as module
from magsim.errors import DataError, RequestError

FILE = {
    "name": "a.h5",
    "sha256": "0" * 64,
    "size": 5,
    "flights": [{"name": "one", "rows": 8, "digest": "d", "splits": {"train": 8}}],
}
GOOD = {"manifest": 1, "dataset": "some", "made_on": {"numpy": "2"}, "files": [FILE]}


@pytest.fixture
def path(tmp_path):
    return tmp_path / MANIFEST


def test_a_manifest_is_read_as_it_is_written(path):
    path.write_text(json.dumps(GOOD))
    manifest = read_manifest(path)
    assert manifest.flights["one"] == FlightEntry(name="one", rows=8, digest="d", splits={"train": 8})
    assert manifest.size == 5
    path.write_text(manifest.to_json())
    assert read_manifest(path) == manifest


def test_files_may_name_a_group_and_a_level(path):
    path.write_text(json.dumps(GOOD | {"files": [FILE | {"group": "world_1", "level": 3}]}))
    manifest = read_manifest(path)
    assert (manifest.files[0].group, manifest.files[0].level) == ("world_1", 3)
    text = manifest.to_json()
    path.write_text(text)
    assert read_manifest(path) == manifest
    assert json.loads(text)["files"][0] == FILE | {"group": "world_1", "level": 3}


def test_manifests_from_before_groups_are_read_and_written_without_them(path):
    path.write_text(json.dumps(GOOD))
    manifest = read_manifest(path)
    assert (manifest.files[0].group, manifest.files[0].level) == (None, None)
    assert json.loads(manifest.to_json()) == GOOD


@pytest.mark.parametrize(
    ("change", "where"),
    [
        ({"manifest": 2}, "manifest"),
        ({"more": 1}, "more"),
        ({"files": [FILE | {"name": "../a.h5"}]}, "files.0.name"),
        ({"files": [FILE | {"name": "/etc/x.h5"}]}, "files.0.name"),
        ({"files": [FILE | {"sha256": "z"}]}, "files.0.sha256"),
        ({"files": [FILE | {"size": -1}]}, "files.0.size"),
        ({"files": [FILE | {"group": "No Group"}]}, "files.0.group"),
        ({"files": [FILE | {"group": "../x"}]}, "files.0.group"),
        ({"files": [FILE | {"level": -1}]}, "files.0.level"),
        ({"files": [FILE | {"level": 1001}]}, "files.0.level"),
        ({"files": [FILE | {"level": "1"}]}, "files.0.level"),
        ({"made_on": {"numpy": "x" * 2000}}, "made_on.numpy"),
    ],
)
def test_manifests_that_are_none(path, change, where):
    path.write_text(json.dumps(GOOD | change))
    with pytest.raises(DataError, match=f"is no manifest of a data set: {where}"):
        read_manifest(path)


@pytest.mark.parametrize("text", ["", "{", "[" * 100_000, "\x00", "null"])
def test_text_that_is_no_manifest(path, text):
    path.write_text(text)
    with pytest.raises(DataError, match="is no manifest of a data set"):
        read_manifest(path)


def test_files_that_are_missing_or_too_large(path, monkeypatch):
    with pytest.raises(RequestError, match="there is no such file"):
        read_bounded(path)
    monkeypatch.setattr(module, "MAX_BYTES", 10)
    path.write_bytes(b"x" * 10)
    assert read_bounded(path) == b"x" * 10
    path.write_bytes(b"x" * 11)
    with pytest.raises(DataError, match="so it describes no data set"):
        read_manifest(path)

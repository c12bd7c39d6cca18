"""Verification of recording files: every difference is found and named."""

import hashlib
from pathlib import Path

import h5py
import numpy as np
import pytest

from magsim.errors import DataError
from magsim.recording import write_recordings
from magsim.recording.verify import verify
from magsim.storage import hdf5, inspection
from magsim.storage.checksum import CHECKSUM_BYTES
from tests.support.boxes import N, make


def test_a_sound_file_is_verified(path):
    found = verify(path)
    assert found.flights == ("box",)
    assert (found.rows, found.columns, found.size) == (N, len(make().data), path.stat().st_size)
    assert found.digest == hashlib.sha256(path.read_bytes()).hexdigest()


def test_verify_finds_any_changed_byte_also_in_the_checksum(path, tmp_path, monkeypatch):
    """No file of these reaches HDF5 in this process unless its child could read it."""
    monkeypatch.setattr(inspection, "TIMEOUT_S", 1.0)
    data = path.read_bytes()
    changed = tmp_path / "changed.h5"
    rng = np.random.default_rng(9)
    used = np.flatnonzero(np.frombuffer(data, np.uint8))
    positions = {*rng.choice(used, 5).tolist(), *rng.integers(len(data), size=4).tolist()}
    positions |= {0, 8, *range(len(data) - CHECKSUM_BYTES, len(data), 20), len(data) - 1}
    for position in sorted(positions):
        broken = bytearray(data)
        broken[position] ^= int(rng.integers(1, 256))
        changed.write_bytes(broken)
        with pytest.raises(DataError) as caught:
            verify(changed)
        assert str(caught.value).startswith(f"{changed}: "), position
    changed.write_bytes(data)
    assert verify(changed).flights == ("box",)


def differences_found(path: Path, change: object, *, checksum: bool) -> list[str]:
    with h5py.File(path, "a") as opened:
        change(opened["flights/000001"])
    if checksum:
        hdf5.add_checksum(path)
    with pytest.raises(DataError) as caught:
        verify(path)
    return [line.removeprefix(f"{path}: ") for line in str(caught.value).splitlines()]


def test_verify_names_the_values_that_differ(path):
    lines = differences_found(path, lambda g: g["truth"].__setitem__((3, 1), 7.0), checksum=False)
    assert lines == [
        "has no checksum at its end: another program wrote or changed it",
        "flights/000001: the values of truth are not those that were written (its checksum differs)",
    ]


def test_verify_lists_the_differences_of_every_flight(tmp_path):
    shard = tmp_path / "shard.h5"
    write_recordings(shard, [make("a"), make("b"), make("c")])
    with h5py.File(shard, "a") as opened:
        opened["flights/000001/input"][3, 0] = np.nan
        opened["flights/000003/label"][3, 0] = 1.0
    hdf5.add_checksum(shard)
    with pytest.raises(DataError) as caught:
        verify(shard)
    assert [line.removeprefix(f"{shard}: flights/") for line in str(caught.value).splitlines()] == [
        "000001: the values of input are not those that were written (its checksum differs)",
        "000001: column mag_cabin_nt is not finite, first at 0.3 s",
        "000003: the values of label are not those that were written (its checksum differs)",
    ]


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (lambda g: g.create_group("more"), "more is not part of the layout"),
        (
            lambda g: g["input"].attrs.create("column_meanings", np.array([b"?"] * 5)),
            "column mag_cabin_nt has meaning '?'; the table of columns has 'Reading of a scalar magnetometer'",
        ),
        (lambda g: g["label"].attrs.pop("sha256"), "label has no attribute sha256"),
        (lambda g: _repack(g, "label"), "label is not one contiguous block of float64, so it cannot be mapped"),
    ],
)
def test_verify_compares_a_file_with_a_fitting_checksum_with_the_layout(path, change, line):
    assert f"flights/000001: {line}" in differences_found(path, change, checksum=True)


def _repack(group: h5py.Group, name: str) -> None:
    values, attributes = group[name][:], dict(group[name].attrs)
    del group[name]
    block = group.create_dataset(name, data=values, compression="gzip")
    for key in ("sha256", "column_units", "column_frames", "column_meanings"):
        block.attrs[key] = attributes[key]

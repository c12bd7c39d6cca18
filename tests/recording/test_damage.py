"""Damaged and harmful recording files are refused with one clear line, and do no harm."""

import hashlib
import shutil
from contextlib import suppress
from pathlib import Path

import h5py
import numpy as np
import pytest

from magsim.errors import DataError, MagsimError
from magsim.recording import Recording, read_recordings
from magsim.storage import hdf5, inspection
from magsim.storage.checksum import CHECKSUM_BYTES, checksum_state
from tests.benchmarks.hostile_files import Watch, read_apart, write_mutated
from tests.support.crafted import crafted, digest_of, recording


def edit(path: Path, change: object) -> str:
    """Return the error of reading after a change by another program."""
    with h5py.File(path, "a") as opened:
        change(opened, opened["flights/000001"])
    with pytest.raises(DataError) as caught:
        read_recordings(path)
    text = str(caught.value)
    assert text.startswith(f"{path}: ")
    assert "\n" not in text
    return text.removeprefix(f"{path}: ")


def _replace(group: h5py.Group, name: str, value: object) -> None:
    del group[name]
    group[name] = value


def _channel(group: h5py.Group, role: str, index: int, name: bytes) -> None:
    values = group[f"{role}_channel"][:]
    values[index] = name
    group[f"{role}_channel"][:] = values


def _time(group: h5py.Group, index: int, value: float) -> None:
    group["time_s"][index] = value


CHANGES = {
    "has schema_version 3 (a newer magsim wrote it); allowed: 1, 2": lambda f, g: f.attrs.modify("schema_version", 3),
    "has schema_version 0; allowed: 1, 2": lambda f, g: f.attrs.modify("schema_version", 0),
    "is not a recording of magsim": lambda f, g: f.attrs.modify("title", "something else"),
    "there is no flights": lambda f, g: f.move("flights", "fights"),
    "flights: there is no flight inside": lambda f, g: f.move("flights/000001", "other"),
    "flights/000001: there is no time_s": lambda f, g: g.move("time_s", "time"),
    "flights/000001: time_s is not strictly increasing, finite and of 2 rows or more": lambda f, g: _time(g, 7, 0.0),
    "flights/000001: time_s is not strictly increasing, finite and of 2 rows or more ": lambda f, g: _time(
        g, 7, np.nan
    ),
    "flights/000001: column mag_cabin_nt is not finite, first at 0.3 s": lambda f, g: g["input"].__setitem__(
        (3, 0), np.inf
    ),
    "flights/000001: input has a column 'mag_nabin_xy' that magsim": lambda f, g: _channel(
        g, "input", 0, b"mag_nabin_xy"
    ),
    "flights/000001: column clean_cab_nt stands in input; expected in truth": lambda f, g: _channel(
        g, "input", 0, b"clean_cab_nt"
    ),
    "flights/000001: column flux_flux_x_nt is there twice": lambda f, g: _channel(g, "input", 2, b"flux_flux_x_nt"),
    "flights/000001: column mag_cabin_nt has unit 'T'; allowed: 'nT'": lambda f, g: g["input"].attrs.create(
        "column_units", np.array([b"T", b"nT", b"nT", b"nT", b"deg"])
    ),
    "flights/000001: input has no attribute column_units": lambda f, g: g["input"].attrs.pop("column_units"),
    "flights/000001: input has shape (200, 4); expected (200, 5), from time_s and input_channel": lambda f, g: _replace(
        g, "input", np.zeros((200, 4))
    ),
    "flights/000001: input is 2-dimensional of type int64": lambda f, g: _replace(
        g, "input", np.zeros((200, 5), dtype=int)
    ),
    "flights/000001: attribute notes_json is not JSON": lambda f, g: g.attrs.modify("notes_json", "{"),
    "flights/000001: truth is not a data set": lambda f, g: (g.move("truth", "other"), g.create_group("truth")),
    "flights/000001: the name 'Bad' is not allowed": lambda f, g: g.create_group("Bad"),
}


@pytest.mark.parametrize("expected", CHANGES)
def test_changes_by_another_program_are_named(path, expected):
    assert edit(path, CHANGES[expected]).startswith(expected.strip())


def test_a_file_that_another_program_compressed_is_read(path, tmp_path):
    packed = tmp_path / "packed.h5"
    shutil.copy(path, packed)
    with h5py.File(packed, "a") as opened:
        group = opened["flights/000001"]
        truth, names = group["truth"][:], dict(group["truth"].attrs)
        del group["truth"]
        block = group.create_dataset("truth", data=truth, compression="gzip", chunks=(50, 15))
        block.attrs["column_units"] = names["column_units"]
    read = Recording.read(packed)
    assert np.array_equal(read.stack(read.names("truth")), truth)


def test_truncated_files_are_reported(path, tmp_path):
    data = path.read_bytes()
    cut = tmp_path / "cut.h5"
    for length in (len(data) - 1, len(data) - 60, len(data) - 80, len(data) // 2, 600, 100):
        cut.write_bytes(data[:length])
        with pytest.raises(DataError, match=r"is truncated|is damaged"):
            read_recordings(cut)
    for length in (0, 5):
        cut.write_bytes(data[:length])
        with pytest.raises(DataError, match="so it is no recording"):
            read_recordings(cut)


def test_a_single_changed_byte_anywhere_is_noticed(path, tmp_path):
    data = path.read_bytes()
    rng = np.random.default_rng(1)
    changed = tmp_path / "changed.h5"
    for position in rng.integers(0, len(data) - 80, size=200):
        broken = bytearray(data)
        broken[position] ^= int(rng.integers(1, 256))
        changed.write_bytes(broken)
        with pytest.raises(DataError, match=r"is damaged|is not an HDF5 file"):
            read_recordings(changed)


def test_damage_without_a_checksum_does_no_harm(path, tmp_path, monkeypatch):
    """Files without a checksum, as another program writes them: HDF5 itself may crash or hang, the reader may not."""
    monkeypatch.setattr(inspection, "TIMEOUT_S", 1.0)
    data = path.read_bytes()[:-CHECKSUM_BYTES]
    header = np.flatnonzero(np.frombuffer(data, np.uint8))
    rng = np.random.default_rng(2)
    changed = [tmp_path / f"changed_{number}.h5" for number in range(25)]
    for target in changed:
        broken = bytearray(data)
        for position in rng.choice(header[header < 12_000], size=3):
            broken[position] = int(rng.integers(256))
        target.write_bytes(broken)
    inspection.inspect_many(changed)
    for target in changed:
        with suppress(MagsimError):
            assert read_recordings(target)


def test_the_checksum_is_that_of_other_tools(path):
    data = path.read_bytes()
    body, tail = data[:-CHECKSUM_BYTES], data[-CHECKSUM_BYTES:]
    assert tail == b"magsim-sha256:" + hashlib.sha256(body).hexdigest().encode() + b"\n"


def test_the_checksum_fails_for_every_single_byte(path, tmp_path):
    data = bytearray(path.read_bytes())
    changed = tmp_path / "changed.h5"
    for position in [*range(8, len(data), 499), *range(len(data) - CHECKSUM_BYTES, len(data))]:
        data[position] ^= 0x55
        changed.write_bytes(data)
        assert checksum_state(changed).kind == "broken", position
        data[position] ^= 0x55


def test_a_checksum_that_fits_is_not_trusted(path):
    """Another process may have written it: a child process inspects the file all the same."""
    inspection._RESULTS.clear()
    with h5py.File(path, "a") as opened:
        opened["x"] = h5py.SoftLink("/flights")
    hdf5.add_checksum(path)
    inspection._RESULTS.clear()
    with pytest.raises(DataError, match="has a member 'x' that is a link to elsewhere"):
        read_recordings(path)


def test_a_file_is_inspected_once(path, monkeypatch):
    inspection._RESULTS.clear()
    assert len(read_recordings(path)) == 1
    monkeypatch.setattr(inspection, "INSPECTOR", Path("/nowhere"))
    assert len(read_recordings(path)) == 1


def test_harmful_files_do_no_harm(tmp_path):
    """The full numbers are those of tests/benchmarks/hostile_files.py."""
    bad = crafted(tmp_path)
    mutated = write_mutated(tmp_path, 30, seed=3)
    good = {tmp_path / f"good_{number}.h5": recording(number) for number in range(5)}
    for target, wrote in good.items():
        wrote.write(target)
    watch = Watch(tmp_path / "secrets")
    tally = read_apart([*bad.values(), *mutated, *good], readers=1)
    assert watch.seen() == 0
    assert (tally.crashes, tally.hangs, tally.unclear, tally.canaries) == ([], [], [], [])
    assert [name for name, target in bad.items() if str(target) not in tally.refused] == []
    assert all(tally.read[str(target)] == digest_of(wrote) for target, wrote in good.items())
    assert len(tally.read) + len(tally.refused) == len(bad) + len(mutated) + len(good)

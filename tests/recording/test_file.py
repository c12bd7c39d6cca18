"""Recording files: what is written is read, xarray opens it, and no damaged file does harm."""

import hashlib
import os
import shutil
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr

from magsim import columns
from magsim.errors import DataError, MagsimError, RequestError
from magsim.recording import Recording, file, read_recordings, write_recordings
from magsim.recording.verify import verify
from magsim.storage import hdf5, inspection
from magsim.storage.checksum import CHECKSUM_BYTES, checksum_state
from tests.benchmarks.hostile_files import Watch, read_apart, write_mutated
from tests.support.crafted import crafted, digest_of, recording
from tests.support.paths import ROOT

N = 200
META = {
    "start_utc": "2025-03-13T02:00:00+00:00",
    "seed": 2**63 - 1,
    "rate_hz": 10,
    "simulation_rate_hz": 120.0,
    "digest": "00ff",
    "scenario_text": "# Grüße\nschema = 1\n",
    "overrides": ["seed=3"],
    "maneuvers": [{"axis": "pitch", "asked_deg": 5.0, "off_axis_deg": [0.1, 0.2]}],
    "notes": {"integrator": "AB5", "gains": {"pitch": 1.25}, "exact": True, "none": None},
    "title": "",
}


def make(name: str = "box", meta: dict | None = None) -> Recording:
    time_s = np.arange(N) * 0.1
    rng = np.random.default_rng(4)
    data = {
        "circuit": np.ones(N),
        "split": np.repeat([0.0, 1.0, 2.0, 2.0], N // 4),
        "mag_cabin_nt": 45_000.0 + rng.normal(size=N),
        **{f"flux_flux_{axis}_nt": rng.normal(size=N) * 1e4 for axis in "xyz"},
        "ins_roll_deg": rng.normal(size=N),
        "interference_cabin_nt": rng.normal(size=N),
        **{
            columns.PART.name(component=component, sensor="cabin", axis=axis): rng.normal(size=N)
            for component in columns.COMPONENTS
            for axis in "xyz"
        },
    }
    return Recording(name, time_s, data, META if meta is None else meta)


@pytest.fixture
def path(tmp_path) -> Path:
    target = tmp_path / "box.h5"
    make().write(target)
    return target


def test_what_is_written_is_read(path):
    wrote, read = make(), Recording.read(path)
    assert read.name == "box"
    assert read.time_s.tobytes() == wrote.time_s.tobytes()
    assert set(read.data) == set(wrote.data)
    assert all(read[name].tobytes() == wrote[name].tobytes() for name in wrote.data)
    assert read.meta == wrote.meta
    assert [columns.role_of(name) for name in read.data] == sorted(
        (columns.role_of(name) for name in wrote.data), key=columns.ROLES.index
    )
    assert not any(column.flags.writeable for column in read.data.values())


def test_a_text_that_is_too_long_for_an_attribute_is_kept(tmp_path):
    text = "# a comment\n" * 20_000
    make(meta={"scenario_text": text, "table": {"x": [text]}}).write(tmp_path / "a.h5")
    assert Recording.read(tmp_path / "a.h5").meta == {"scenario_text": text, "table": {"x": [text]}}


def test_the_same_recording_gives_the_same_bytes_in_another_process_at_another_time(path, tmp_path):
    code = (
        f"import sys; sys.path.insert(0, {str(ROOT)!r})\n"
        "from tests.recording import test_file as t; t.make().write('again.h5')"
    )
    time.sleep(1.05)  # HDF5 stamps seconds
    environment = {**os.environ, "TZ": "Asia/Tokyo", "PYTHONHASHSEED": "7"}
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, check=True)
    assert (tmp_path / "again.h5").read_bytes() == path.read_bytes()


@pytest.mark.parametrize("engine", ["netcdf4", "h5netcdf"])
def test_xarray_opens_it(path, engine):
    with xr.open_dataset(path, engine=engine, group="flights/000001") as dataset:
        wrote = make()
        assert dataset.input.dims == ("time_s", "input_channel")
        names = [name.decode() if isinstance(name, bytes) else name for name in dataset.truth_channel.values]
        assert names == list(wrote.names("truth"))
        assert np.array_equal(dataset.truth.values, wrote.stack(wrote.names("truth")))
        start = np.datetime64("2025-03-13T02:00:00")
        seconds = (dataset.time_s.values - start) / np.timedelta64(1, "s")
        assert np.allclose(seconds, wrote.time_s, rtol=0.0, atol=1e-6)
        assert list(dataset.input.attrs["column_units"]) == ["nT", "nT", "nT", "nT", "deg"]
        assert list(dataset.truth.attrs["column_frames"])[:3] == ["b", "b", "b"]
        assert "Reading of a scalar magnetometer" in dataset.input.attrs["column_meanings"][0]
        assert dataset.attrs["digest"] == "00ff"
        assert dataset.attrs["title"] == ""


def test_a_block_is_contiguous_float64_and_can_be_mapped(path):
    with h5py.File(path) as opened:
        block = opened["flights/000001/truth"]
        assert block.chunks is None
        offset, shape = block.id.get_offset(), block.shape
    mapped = np.memmap(path, dtype="<f8", mode="r", offset=offset, shape=shape)
    wrote = make()
    assert np.array_equal(mapped, wrote.stack(wrote.names("truth")))


def test_a_blind_copy_says_no_more_than_a_survey_would(tmp_path):
    target = tmp_path / "blind.h5"
    make().blind().write(target)
    read = Recording.read(target)
    assert set(read.meta) == {"start_utc", "rate_hz"}
    assert all(columns.role_of(name) == "input" for name in read.data)
    for word in (b"seed", b"00ff", b"interference", b"schema = 1"):
        assert word not in target.read_bytes()


def test_several_flights_and_folders(tmp_path):
    file.write(tmp_path / "b.h5", [make("two"), make("three", {})])
    make("one").write(tmp_path / "a.h5")
    (tmp_path / ".hidden.h5").write_text("not finished")
    assert [r.name for r in read_recordings(tmp_path / "b.h5")] == ["two", "three"]
    assert [r.name for r in read_recordings(tmp_path)] == ["one", "two", "three"]
    with pytest.raises(RequestError, match=r"b\.h5: holds 2 flights, where one is needed"):
        Recording.read(tmp_path / "b.h5")
    with pytest.raises(RequestError, match="is a folder"):
        Recording.read(tmp_path)


def test_paths_that_hold_no_recording(tmp_path):
    with pytest.raises(RequestError, match=r"no\.h5: there is no such file"):
        read_recordings(tmp_path / "no.h5")
    with pytest.raises(RequestError, match="this folder has no recording"):
        read_recordings(tmp_path)


def test_writing_refuses(tmp_path, path):
    with pytest.raises(RequestError, match="exists already"):
        make().write(path)
    bad = make()
    column = bad["mag_cabin_nt"].copy()
    column[17] = np.nan
    broken = Recording("bad", bad.time_s, {"mag_cabin_nt": column})
    with pytest.raises(DataError, match=r"bad: column mag_cabin_nt is not finite, first at 1\.7 s"):
        broken.write(tmp_path / "bad.h5")
    with pytest.raises(ValueError, match="cannot name an entry"):
        make(meta={"Bad key": 1}).write(tmp_path / "bad.h5")
    with pytest.raises(TypeError, match="cannot be an entry"):
        make(meta={"x": [object()]}).write(tmp_path / "bad.h5")
    assert [entry.name for entry in tmp_path.iterdir()] == ["box.h5"]


def edit(path: Path, change: object) -> str:
    """The message that reading gives after a change by another program."""
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
def test_what_another_program_broke_is_named(path, expected):
    assert edit(path, CHANGES[expected]).startswith(expected.strip())


def test_a_file_that_another_program_packed_is_read(path, tmp_path):
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


def test_truncated_files_are_told_so(path, tmp_path):
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


def test_damage_behind_a_broken_seal_never_harms(path, tmp_path, monkeypatch):
    """Files without a seal, as another program leaves them: HDF5 itself may crash or hang, the reader may not."""
    monkeypatch.setattr(inspection, "TIMEOUT_S", 1.0)
    data = path.read_bytes()[:-CHECKSUM_BYTES]
    header = np.flatnonzero(np.frombuffer(data, np.uint8))
    rng = np.random.default_rng(2)
    changed = tmp_path / "changed.h5"
    for _ in range(25):
        broken = bytearray(data)
        for position in rng.choice(header[header < 12_000], size=3):
            broken[position] = int(rng.integers(256))
        changed.write_bytes(broken)
        with suppress(MagsimError):
            assert read_recordings(changed)


def test_the_seal_is_the_checksum_that_other_tools_compute(path):
    data = path.read_bytes()
    body, tail = data[:-CHECKSUM_BYTES], data[-CHECKSUM_BYTES:]
    assert tail == b"magsim-sha256:" + hashlib.sha256(body).hexdigest().encode() + b"\n"


# --- verify, shards, versions, amounts of truth -----------------------------------------------------------------


def test_a_sound_file_is_verified(path):
    found = verify(path)
    assert found.flights == ("box",)
    assert (found.rows, found.columns, found.size) == (N, len(make().data), path.stat().st_size)
    assert found.digest == hashlib.sha256(path.read_bytes()).hexdigest()


def test_verify_finds_any_changed_byte_those_of_the_checksum_too(path, tmp_path, monkeypatch):
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


def test_the_checksum_fails_for_every_single_byte(path, tmp_path):
    data = bytearray(path.read_bytes())
    changed = tmp_path / "changed.h5"
    for position in [*range(8, len(data), 499), *range(len(data) - CHECKSUM_BYTES, len(data))]:
        data[position] ^= 0x55
        changed.write_bytes(data)
        assert checksum_state(changed).kind == "broken", position
        data[position] ^= 0x55


def told_by_verify(path: Path, change: object, *, seal: bool) -> list[str]:
    with h5py.File(path, "a") as opened:
        change(opened["flights/000001"])
    if seal:
        hdf5.add_checksum(path)
    with pytest.raises(DataError) as caught:
        verify(path)
    return [line.removeprefix(f"{path}: ") for line in str(caught.value).splitlines()]


def test_verify_tells_where_values_differ(path):
    lines = told_by_verify(path, lambda g: g["truth"].__setitem__((3, 1), 7.0), seal=False)
    assert lines == [
        "has no checksum at its end: another program wrote or changed it",
        "flights/000001: the values of truth are not those that were written (its checksum differs)",
    ]


def test_verify_tells_the_differences_of_every_flight(tmp_path):
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
def test_verify_holds_a_file_with_a_checksum_that_fits_against_the_layout(path, change, line):
    assert f"flights/000001: {line}" in told_by_verify(path, change, seal=True)


def _repack(group: h5py.Group, name: str) -> None:
    values, attributes = group[name][:], dict(group[name].attrs)
    del group[name]
    block = group.create_dataset(name, data=values, compression="gzip")
    for key in ("sha256", "column_units", "column_frames", "column_meanings"):
        block.attrs[key] = attributes[key]


def test_files_of_version_1_are_read_and_verified(path):
    with h5py.File(path, "a") as opened:
        opened.attrs.modify("schema_version", 1)
        opened.visititems(lambda _, item: item.attrs.pop("sha256", None) and None)
    hdf5.add_checksum(path)
    inspection._RESULTS.clear()
    read, wrote = Recording.read(path), make()
    assert all(read[name].tobytes() == wrote[name].tobytes() for name in wrote.data)
    assert verify(path).flights == ("box",)


def test_flights_of_a_shard_are_read_by_name(tmp_path):
    shard = tmp_path / "shard.h5"
    write_recordings(shard, (make(name) for name in ("a", "b", "c", "c")))
    assert [r.name for r in read_recordings(shard, ["c", "a"])] == ["a", "c", "c"]
    assert Recording.read(shard, "b").name == "b"
    with pytest.raises(RequestError, match=r"there is no flight 'd' \(magsim info lists them\)"):
        read_recordings(shard, ["a", "d"])
    with pytest.raises(RequestError, match="holds 2 flights of the name 'c', where one is needed"):
        Recording.read(shard, "c")
    assert verify(shard).flights == ("a", "b", "c", "c")
    with h5py.File(shard) as opened:
        for flight in opened["flights"].values():
            for role in columns.ROLES:
                block = flight[role]
                assert (block.chunks, block.compression, block.dtype.str) == (None, None, "<f8")
                assert block.id.get_offset() is not None


def test_a_shard_with_a_bad_flight_is_not_written(tmp_path):
    def flights():
        yield make("good")
        yield Recording("bad", np.arange(3.0), {"mag_cabin_nt": np.array([1.0, np.inf, 2.0])})

    with pytest.raises(DataError, match="bad: column mag_cabin_nt is not finite, first at 1 s"):
        write_recordings(tmp_path / "shard.h5", flights())
    assert list(tmp_path.iterdir()) == []


def test_a_seal_that_fits_is_not_trusted(path):
    """Another process may have made it: the file is walked through by a child all the same."""
    inspection._RESULTS.clear()
    with h5py.File(path, "a") as opened:
        opened["x"] = h5py.SoftLink("/flights")
    hdf5.add_checksum(path)
    inspection._RESULTS.clear()
    with pytest.raises(DataError, match="has a member 'x' that is a link to elsewhere"):
        read_recordings(path)


def test_bytes_that_were_walked_through_once_are_not_again(path, monkeypatch):
    inspection._RESULTS.clear()
    assert len(read_recordings(path)) == 1
    monkeypatch.setattr(inspection, "INSPECTOR", Path("/nowhere"))
    assert len(read_recordings(path)) == 1


def test_hostile_files_do_no_harm(tmp_path):
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


def test_a_writer_that_is_killed_leaves_no_target_or_a_whole_one(tmp_path):
    """Kills ``write_recordings`` itself; tests/benchmarks/killed_generate.py does the same to ``magsim generate``."""
    code = (
        "import sys\nfrom tests.recording import test_file as t\n"
        "from pathlib import Path\n"
        "flights = [t.make(str(i)) for i in range(20)]\n"
        "print('go', flush=True)\n"
        "for i in range(1000): t.write_recordings(Path(sys.argv[1]), flights, force=True)"
    )
    rng = np.random.default_rng(6)
    target = tmp_path / "shard.h5"
    for wait_s in rng.uniform(0.0, 0.25, 3):
        command = [sys.executable, "-c", code, str(target)]
        writer = subprocess.Popen(command, env={**os.environ, "PYTHONPATH": str(ROOT)}, stdout=subprocess.PIPE)
        writer.stdout.readline()
        time.sleep(wait_s)
        writer.kill()
        writer.wait()
        writer.stdout.close()
        if target.exists():
            assert len(verify(target).flights) == 20

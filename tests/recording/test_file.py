"""Recording files: written and read again, by magsim and by xarray; shards of several flights."""

import os
import subprocess
import sys
import time

import h5py
import numpy as np
import pytest
import xarray as xr

from magsim import columns
from magsim.errors import DataError, RequestError
from magsim.recording import Recording, file, read_recordings, write_recordings
from magsim.recording.verify import verify
from magsim.storage import hdf5, inspection
from tests.support.boxes import make
from tests.support.paths import ROOT


def test_a_recording_is_read_as_it_was_written(path):
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


def test_a_blind_copy_has_no_more_than_a_survey(tmp_path):
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


def test_paths_without_a_recording(tmp_path):
    with pytest.raises(RequestError, match=r"no\.h5: there is no such file"):
        read_recordings(tmp_path / "no.h5")
    with pytest.raises(RequestError, match="this folder has no recording"):
        read_recordings(tmp_path)


def test_recordings_that_cannot_be_written(tmp_path, path):
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


def test_a_killed_writer_leaves_no_target_or_a_complete_one(tmp_path):
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

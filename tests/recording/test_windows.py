"""Windows out of mapped memory hold the values that the recordings hold."""

import numpy as np
import pytest

from magsim.errors import DataError, RequestError
from magsim.recording import Recording, write_recordings
from magsim.recording.windows import Windows
from magsim.streams import stream


def make(name: str, rows: int, gap: bool = False, sensors: tuple[str, ...] = ("a", "b")) -> Recording:
    rng = stream(1, name)
    time_s = np.arange(rows) * 0.1 + (np.arange(rows) >= rows // 2) * (5.0 if gap else 0.0)
    data = {f"mag_{sensor}_nt": rng.normal(size=rows) for sensor in sensors}
    data |= {f"interference_{sensor}_nt": rng.normal(size=rows) for sensor in sensors}
    return Recording(name, time_s, data)


@pytest.fixture
def shard(tmp_path):
    flights = [make("one", 50), make("two", 60, gap=True), make("three", 9), make("four", 31)]
    write_recordings(tmp_path / "shard.h5", flights)
    return tmp_path / "shard.h5", flights


@pytest.mark.parametrize("role", ["input", "label"])
def test_every_window_has_the_rows_that_it_names(shard, role):
    path, flights = shard
    windows = Windows(path, rows=10, role=role)
    assert windows.flights == ("one", "two", "three", "four")
    assert windows.names == flights[0].names(role)
    # 41 of the first, twice 21 around the jump, none of the third, 22 of the last
    assert len(windows) == 41 + 2 * 21 + 0 + 22
    found = windows.take(np.arange(len(windows)))
    places = set()
    for index, window in enumerate(found):
        flight, first = windows.where(index)
        wrote = flights[flight].take(slice(first, first + 10))
        assert np.array_equal(window, wrote.stack(windows.names))
        assert np.ptp(wrote.time_s) == pytest.approx(0.9)
        places.add((flight, first))
    assert len(places) == len(windows)


def test_windows_are_drawn_with_equal_chances(shard):
    path, _ = shard
    windows = Windows(path, rows=10)
    first = windows.take(np.arange(len(windows)))[:, 0, 0]
    drawn = windows.random(21_000, stream(0, "draw"))[:, 0, 0]
    counts = np.array([(drawn == value).sum() for value in first])
    assert counts.sum() == 21_000
    # 200 expected of each: chi-squared over 104 degrees of freedom, mean 104, deviation 14
    assert ((counts - 200.0) ** 2 / 200.0).sum() < 104 + 5 * 14.4


def test_a_given_array_is_filled_in_its_own_precision(shard):
    windows = Windows(shard[0], rows=10)
    out = np.empty((5, 10, 2), dtype=np.float32)
    assert windows.take([0, 1, 2, 3, 104], out) is out
    assert np.array_equal(out, windows.take([0, 1, 2, 3, 104]).astype(np.float32))


def test_files_that_do_not_fit_are_refused(shard, tmp_path):
    path, _ = shard
    make("other", 40, sensors=("c", "d")).write(tmp_path / "other.h5")
    with pytest.raises(DataError, match="input has other columns than the first flight"):
        Windows([path, tmp_path / "other.h5"], rows=10)
    with pytest.raises(DataError, match="there is no truth"):
        Windows(path, rows=10, role="truth")
    with pytest.raises(RequestError, match="has 500 rows without a jump in time"):
        Windows(path, rows=500)
    with pytest.raises(IndexError, match="there are windows 0 to 104"):
        Windows(path, rows=10).take([105])
    with pytest.raises(ValueError, match="no windows of 0 rows"):
        Windows(path, rows=0)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    with pytest.raises(DataError, match="is damaged"):
        Windows(path, rows=10)

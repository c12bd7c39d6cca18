"""Windows that are read from files hold the values that the recordings hold."""

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from magsim.errors import DataError, RequestError
from magsim.recording import Recording, places, write_recordings
from magsim.recording import windows as windows_module
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


def test_rows_of_all_stretches_that_have_windows_are_counted(shard):
    path, flights = shard
    windows = Windows(path, rows=10)
    assert windows.total_rows == 50 + 60 + 31
    assert windows.rows == 10
    assert Windows(path, rows=1).total_rows == sum(len(flight) for flight in flights)


def test_windows_of_named_columns_in_any_order(shard):
    path, _ = shard
    whole = Windows(path, rows=10)
    some = Windows(path, rows=10, names=("mag_b_nt", "mag_a_nt"))
    assert some.names == ("mag_b_nt", "mag_a_nt")
    indices = [0, 41, 104]
    np.testing.assert_array_equal(some.take(indices), whole.take(indices)[:, :, ::-1])
    one = Windows(path, rows=10, role="label", names=["interference_b_nt"])
    np.testing.assert_array_equal(one.take(indices), Windows(path, rows=10, role="label").take(indices)[:, :, 1:])
    with pytest.raises(RequestError, match="windows have no column mag_c_nt, x; the flights have mag_a_nt, mag_b_nt"):
        Windows(path, rows=10, names=["mag_c_nt", "mag_a_nt", "x"])
    with pytest.raises(RequestError, match="none is named"):
        Windows(path, rows=10, names=[])


@pytest.fixture
def split(tmp_path):
    """Flights with and without splits; the second has a jump in time inside of its training rows."""
    codes = np.repeat([0.0, 1.0, 2.0, 0.0], [15, 8, 20, 17])
    flights = [
        replace(flight, data={**flight.data, "circuit": np.ones(60), "split": codes})
        for flight in (make("one", 60), make("two", 60, gap=True))
    ]
    write_recordings(tmp_path / "split.h5", [*flights, make("three", 40)])
    return tmp_path / "split.h5", flights


@pytest.mark.parametrize("splits", [("train",), ("valid",), ("train", "valid"), ("valid", "test", "train")])
def test_windows_of_some_splits_are_all_those_whose_rows_have_them(split, splits):
    """By hand: every window of every flight is looked at. A flight without a split has none."""
    path, flights = split
    words = {"train": 0.0, "valid": 1.0, "test": 2.0}
    expected, rows = [], set()
    for number, flight in enumerate(flights):
        for first in range(60 - 6):
            window = flight.take(slice(first, first + 7))
            together = np.ptp(window.time_s) < 0.65
            if together and np.isin(window["split"], [words[word] for word in splits]).all():
                expected.append((number, first))
                rows |= {(number, row) for row in range(first, first + 7)}
    windows = Windows(path, rows=7, splits=splits)
    assert [windows.where(index) for index in range(len(windows))] == expected
    assert windows.total_rows == len(rows)
    for index, (number, first) in enumerate(expected):
        taken = flights[number].take(slice(first, first + 7))
        np.testing.assert_array_equal(windows.take([index])[0], taken.stack(windows.names))


def test_splits_without_a_window_are_refused(split):
    path, _ = split
    with pytest.raises(RequestError, match="has 21 rows of the splits test without a jump in time"):
        Windows(path, rows=21, splits=["test"])
    with pytest.raises(ValueError, match="there is no split 'exam'; allowed: train, valid, test"):
        Windows(path, rows=5, splits=["train", "exam"])


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


@pytest.mark.parametrize("stride", [1, 3, 10, 40])
def test_windows_every_some_rows(shard, stride):
    path, flights = shard
    some = Windows(path, rows=10, stride=stride)
    stretches = ((0, 0, 50), (1, 0, 30), (1, 30, 60), (3, 0, 31))
    expected = [(number, at) for number, first, stop in stretches for at in range(first, stop - 9, stride)]
    assert [some.where(i) for i in range(len(some))] == expected
    for i, (number, first) in enumerate(expected):
        taken = flights[number].take(slice(first, first + 10))
        np.testing.assert_array_equal(some.take([i])[0], taken.stack(some.names))


def test_a_pickled_copy_has_places_and_no_values(tmp_path):
    flights = [make(f"flight_{number}", 3000) for number in range(20)]
    write_recordings(tmp_path / "a.h5", flights)
    windows = Windows(tmp_path / "a.h5", rows=10, names=("mag_b_nt",))
    indices = stream(0, "pickle").integers(len(windows), size=50)
    taken = windows.take(indices)
    copy = pickle.dumps(windows)
    assert len(copy) < 2000 + 60 * len(flights)  # the values are 20 * 3000 * 2 * 8 = 960 000 bytes
    assert pickle.loads(copy).take(indices).tobytes() == taken.tobytes()


def test_open_files_stay_few(tmp_path, monkeypatch):
    monkeypatch.setattr(places, "MOST_OPEN", 5)
    opened = places._OpenFiles()
    monkeypatch.setattr(windows_module, "OPEN_FILES", opened)
    for number in range(12):
        make(f"flight_{number}", 60).write(tmp_path / f"{number:02d}.h5")
    windows = Windows(sorted(tmp_path.glob("*.h5")), rows=10)
    before = len(list(Path("/proc/self/fd").iterdir()))
    every = windows.take(np.arange(len(windows)))
    for _ in range(3):
        for index in range(0, len(windows), 7):
            assert np.array_equal(windows.take([index])[0], every[index])
    assert len(opened._files) <= 5
    assert len(list(Path("/proc/self/fd").iterdir())) <= before + 5

"""The index of a folder: what it lists, how it is read without the files, what it refuses."""

import builtins
import tracemalloc
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet as arrow

from magsim import Dataset
from magsim.dataset import FlightInfo, groups_of, parquet
from magsim.dataset import folder as folders
from magsim.errors import DataError, RequestError
from magsim.recording import write_recordings
from magsim.storage import hdf5
from tests.support.folders import flight, write_index_of

SWEPT = {"start.alt_m": "double", "crew": "string", "interference_std_nt.cabin": "double"}
ALTITUDE = {"one": 100.0, "two": 200.0, "three": float("nan")}


@pytest.fixture
def folder(tmp_path) -> Path:
    write_recordings(tmp_path / "shard_000000.h5", [flight("one", [0, 0, 1, 2, 2]), flight("two", [2] * 4)])
    write_recordings(tmp_path / "shard_000001.h5", [flight("three", None, rows=3)])
    write_index_of(tmp_path, SWEPT, lambda name: {"start.alt_m": ALTITUDE[name], "crew": "calm"}, failed=2)
    return tmp_path


@pytest.fixture
def unread(monkeypatch):
    """Names of the files that HDF5 opens."""
    opened = []
    whole = hdf5.open_untrusted

    def noting(path, **more):
        opened.append(path.name)
        return whole(path, **more)

    monkeypatch.setattr(hdf5, "open_untrusted", noting)
    return opened


def test_a_folder_with_an_index_opens_without_its_files(folder, unread, monkeypatch):
    monkeypatch.setattr(folders.inspection, "inspect_many", lambda files: pytest.fail("it inspects"))
    dataset = Dataset(folder)
    expected = [
        FlightInfo("one", 5, {"train": 2, "valid": 1, "test": 2}, folder / "shard_000000.h5", 0, group="all"),
        FlightInfo("two", 4, {"test": 4}, folder / "shard_000000.h5", 1, group="all"),
        FlightInfo("three", 3, {}, folder / "shard_000001.h5", 0, group="all"),
    ]
    assert list(dataset.flights.values()) == expected
    assert list(dataset.flights.items()) == [(info.name, info) for info in expected]
    assert list(dataset.flights) == ["one", "two", "three"]
    assert (len(dataset), "two" in dataset.flights, "lost_0" in dataset.flights, 3 in dataset.flights) == (
        3,
        True,
        False,
        False,
    )
    assert unread == []
    assert dataset["two"] == flight("two", [2] * 4)
    assert unread == ["shard_000000.h5"]
    with pytest.raises(KeyError, match="there is no flight 'lost_0'; it has one, two, three"):
        dataset["lost_0"]
    assert [recording.name for recording in dataset] == ["one", "two", "three"]
    assert [part.name for part in dataset.split("test")] == ["one", "two"]


def test_an_index_and_the_files_themselves_give_the_same_flights(folder):
    listed = Dataset(folder).flights.values()
    indexed = [(info.name, info.rows, info.splits, info.file, info.number) for info in listed]
    (folder / parquet.INDEX).unlink()
    opened = Dataset(folder).flights.values()
    assert indexed == [(info.name, info.rows, info.splits, info.file, info.number) for info in opened]


def test_the_index_is_a_frame_of_all_flights(folder):
    frame = Dataset(folder).index
    assert list(frame.columns) == [*parquet.COLUMNS, *SWEPT]
    assert frame["flown"].tolist() == [True] * 3 + [False] * 2
    assert frame["name"].tolist() == ["one", "two", "three", "lost_0", "lost_1"]
    assert frame["failure"].tolist()[3:] == ["stalled"] * 2
    np.testing.assert_array_equal(frame["start.alt_m"], [100.0, 200.0, np.nan, np.nan, np.nan])
    flown = frame[frame.flown].set_index("name")
    sizes = {path.name: path.stat().st_size for path in folder.glob("*.h5")}
    assert flown["size"].tolist() == flown["file"].map(sizes).tolist()
    assert frame["size"].tolist()[3:] == [-1, -1]


def test_whole_numbers_of_the_frame_are_exact_where_failed_flights_have_none(folder):
    large = 2**62 + 1  # as float64, it would end in a 0
    rewrite(folder / "index.parquet", seed=[large, large + 2, 7, None, None])
    seeds = Dataset(folder).index["seed"]
    assert seeds.tolist()[:3] == [large, large + 2, 7]
    assert seeds.isna().tolist() == [False] * 3 + [True] * 2


def test_hidden_and_other_files_do_not_count(folder):
    (folder / ".0123-4567.part").mkdir()
    (folder / ".0123-4567.part" / "shard_000002.h5").write_bytes(b"being written")
    (folder / ".shard_000002.h5").write_bytes(b"being written")
    (folder / "journal.jsonl").write_text("{}")
    (folder / "index.parquet.tmp").write_bytes(b"PAR1")
    assert len(Dataset(folder)) == 3


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda f: (f / "shard_000001.h5").unlink(), "shard_000001.h5 is missing"),
        (lambda f: flight("x", [2] * 3).write(f / "shard_000002.h5"), "shard_000002.h5 is not listed"),
        (
            lambda f: flight("three", [2] * 9).write(f / "shard_000001.h5", force=True),
            "shard_000001.h5 has [0-9]+ bytes",
        ),
    ],
)
def test_files_that_do_not_fit_the_index_are_one_message(folder, change, text):
    change(folder)
    with pytest.raises(DataError, match=text) as caught:
        Dataset(folder)
    assert len(str(caught.value).splitlines()) == 1
    assert str(caught.value).startswith(f"{folder / 'index.parquet'}: does not fit the files beside it: ")
    assert "more difference" not in str(caught.value)
    with pytest.raises(DataError, match=text):
        groups_of(folder)


def test_several_differences_are_counted(folder):
    (folder / "shard_000001.h5").rename(folder / "shard_000003.h5")
    with pytest.raises(DataError, match=r"shard_000001\.h5 is missing, and 1 more differences; magsim dataset check"):
        Dataset(folder)


def rewrite(path: Path, **columns: list[object]) -> None:
    """Write other values into some columns of an index."""
    table = arrow.read_table(path)
    for name, values in columns.items():
        place = table.schema.get_field_index(name)
        table = table.set_column(place, table.schema.field(place), pa.array(values, table.schema.field(place).type))
    arrow.write_table(table, path)


A, B = "shard_000000.h5", "shard_000001.h5"


@pytest.mark.parametrize(
    ("columns", "text"),
    [
        ({"name": ["one", "one", "three", "x", "y"]}, "two have one name"),
        ({"name": ["one", None, "three", "x", "y"]}, "a flight has no name"),
        ({"file": [A, A, "../secret.h5", None, None]}, "a name that recording files do not have"),
        ({"file": [A, A, None, None, None]}, "is in no file"),
        ({"file": [A, B, A, None, None], "number": [0, 0, 1, -1, -1]}, "do not stand together"),
        ({"number": [1, 0, 0, -1, -1]}, "are not those from 0 on"),
        ({"rows": [5, 1, 3, 0, 0]}, "less than 2 rows"),
        ({"train_rows": [5, -1, 3, 0, 0]}, "less than none of a split"),
        ({"size": [1, 2, 3, 0, 0]}, "one file has two sizes"),
    ],
)
def test_an_index_of_nonsense_is_refused(folder, columns, text):
    rewrite(folder / "index.parquet", **columns)
    with pytest.raises(DataError, match=rf"index\.parquet: is no index of a data set: .*{text}"):
        Dataset(folder)


def test_another_file_of_that_name_is_refused(folder):
    path = folder / "index.parquet"
    whole = path.read_bytes()
    table = arrow.read_table(path)
    half = table.set_column(table.schema.names.index("rows"), "rows", pa.array([0.5] * 5))
    for make, text in (
        (lambda: path.write_bytes(b"PAR1 no"), "is no index"),
        (lambda: path.write_bytes(whole[:-200]), "is no index"),
        (
            lambda: arrow.write_table(table.drop_columns("number"), path),
            "it has 0 columns 'number'; expected one of int",
        ),
        (lambda: arrow.write_table(half, path), "a column of double 'rows'; expected one of int32"),
        (
            lambda: arrow.write_table(table.append_column("x", pa.array([[1]] * 5)), path),
            "a column of list<element: int64> 'x'; expected one of bool or int64 or double or string",
        ),
    ):
        make()
        with pytest.raises(DataError, match=text):
            Dataset(folder)
    path.unlink()
    with pytest.raises(RequestError, match=r"index\.parquet: there is no such file"):
        _ = Dataset(folder).index


def test_damaged_indexes_are_refused_or_read_but_never_break(folder):
    path = folder / "index.parquet"
    whole = path.read_bytes()
    rng = np.random.default_rng(0)
    for _ in range(60):
        broken = bytearray(whole)
        for place in rng.integers(len(whole), size=3):
            broken[place] = int(rng.integers(256))
        path.write_bytes(broken)
        try:
            flights = list(Dataset(folder).flights.values())
        except DataError:
            continue
        assert all(info.file.parent == folder for info in flights)


def test_a_writer_refuses_rows_that_its_schema_would_drop(folder):
    (row,) = Dataset(folder).index.head(1).to_dict("records")
    del row["size"]
    for wrong, text in (({**row, "more": 1}, "more"), ({k: v for k, v in row.items() if k != "seed"}, "seed")):
        with pytest.raises(ValueError, match=f"other columns than its schema: {text}"):
            parquet.write_index(folder / "index.parquet", [wrong], SWEPT)
    for name, kind in (("rows", "int64"), ("x", "timestamp")):
        with pytest.raises(ValueError, match=f"cannot have a further column '{name}' of type {kind}"):
            parquet.schema({name: kind})


def test_without_pyarrow_the_files_are_opened_and_it_is_said(folder, monkeypatch):
    whole, find = builtins.__import__, parquet.find_spec

    def refusing(name, *more, **others):
        if name.partition(".")[0] == "pyarrow":
            raise ImportError(name)
        return whole(name, *more, **others)

    monkeypatch.setattr(builtins, "__import__", refusing)
    monkeypatch.setattr(parquet, "find_spec", lambda name: None if name == "pyarrow" else find(name))
    with pytest.warns(UserWarning, match="all 2 files are opened, since pyarrow, which reads the index, is missing"):
        dataset = Dataset(folder)
    assert list(dataset.flights) == ["one", "two", "three"]
    with pytest.raises(RequestError, match=r'index.parquet needs pyarrow: pip install "aeromagsim\[parquet\]"'):
        _ = dataset.index


def test_flights_of_an_index_are_groups_of_their_own_or_all_one(tmp_path):
    """Where a file ends is of no meaning in a sweep, even if every file holds training and test rows."""
    both, test = [0, 0, 2, 2], [2, 2, 2]
    for name, second in (("own", both), ("all", test)):
        folder = tmp_path / name
        folder.mkdir()
        write_recordings(folder / "shard_000000.h5", [flight("one", both), flight("two", second)])
        flight("three", both).write(folder / "shard_000001.h5")
        write_index_of(folder)
    found = {group.name: len(group.flights) for group in groups_of(tmp_path / "own")}
    assert found == {"one": 1, "two": 1, "three": 1}
    assert {group.name: len(group.flights) for group in groups_of(Dataset(tmp_path / "all"))} == {"all": 3}


def test_a_hundred_thousand_flights_open_in_little_memory(tmp_path):
    """Several row groups, files that cross their borders; 100 000 descriptions would take 60 MB."""
    count, each = 100_000, 77
    files = -(-count // each)
    for number in range(files):
        (tmp_path / f"shard_{number:06d}.h5").write_bytes(b"x" * (number % 7))

    def rows():
        fixed = dict.fromkeys(("rows", "train_rows", "test_rows"), 6000) | {"valid_rows": 0, "duration_s": 600.0}
        for k in range(count):
            place = {"file": f"shard_{k // each:06d}.h5", "number": k % each, "sha256": f"{k // each:064d}"}
            known = {"flight": k, "name": f"f{k:07d}", "flown": True, "failure": None, "digest": f"{k:064d}", "seed": k}
            yield known | place | fixed

    parquet.write_index(tmp_path / "index.parquet", rows(), {})
    assert arrow.ParquetFile(tmp_path / "index.parquet").num_row_groups == 10
    tracemalloc.start()
    dataset = Dataset(tmp_path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(dataset) == count
    assert peak < 10e6
    info = dataset.flights["f0054321"]
    assert (info.file_name, info.number, info.splits) == ("shard_000705.h5", 36, {"train": 6000, "test": 6000})
    assert sum(info.number for info in dataset.flights.values()) == sum(k % each for k in range(count))

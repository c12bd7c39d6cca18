"""The index of a data set of thousands of flights: one Parquet file that says what is in which file.

One row for each flight, in the order of the files and of the numbers in them; flights that failed have rows too. First
the columns of ``COLUMNS``; then those that the data set varies, each under its key path in a scenario; then figures,
``interference_std_nt.<sensor>``. A row says ``flown`` in a column of its own: filters on numbers lose rows with NaN
where they are pushed down into the file.
"""

import re
from collections.abc import ItemsView, Iterable, Iterator, Mapping, Sequence, ValuesView
from importlib.util import find_spec
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from magsim import columns
from magsim.dataset.index import FlightInfo
from magsim.errors import DataError, MagsimError, RequestError
from magsim.storage import atomic_write

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

INDEX = "index.parquet"
"""Name of the file."""

ROW_GROUP = 10_000
"""Rows of a row group: a reader of one row decodes no more."""

COLUMNS: Mapping[str, str] = {
    "flight": "int64",  # number of the flight in its sweep
    "name": "string",  # as in its file
    "flown": "bool",
    "failure": "string",  # null if flown
    "file": "string",  # without its folder; null if not flown
    "number": "int32",  # in its file, from 0; -1 if not flown
    "rows": "int32",
    "train_rows": "int32",
    "valid_rows": "int32",
    "test_rows": "int32",
    "duration_s": "double",
    "digest": "string",  # of the scenario with its aircraft
    "seed": "int64",
    "sha256": "string",  # of the file
    "size": "int64",  # of the file [bytes]; -1 if not flown
}
"""Columns that every index has, in their order, with their types as Arrow names them."""

VALUES = ("bool", "int64", "double", "string")
"""Types that the further columns may have."""

FIGURE = "interference_std_nt.{sensor}"
"""Figure of a flight: standard deviation of the interference of a scalar magnetometer."""

MOST_ROWS = 20_000_000
"""Most flights of an index that is read."""

_FILE = re.compile(r"[a-z][a-z0-9_]{0,56}\.h5")
_OPENED = ("name", "flown", "file", "number", "rows", "train_rows", "valid_rows", "test_rows", "size", "sha256")
_TEXTS = ("failure", "file", "sha256")


def schema(further: Mapping[str, str]) -> "pa.Schema":
    """Return the schema of an index.

    Parameters
    ----------
    further : mapping of str to str
        Columns after those of ``COLUMNS``, with their types, of ``VALUES``.

    Raises
    ------
    ValueError
        If one has the name of another column, or a type that is not allowed.
    RequestError
        If pyarrow is not installed.
    """
    pa = _pyarrow()
    for name, kind in further.items():
        if name in COLUMNS or kind not in VALUES:
            msg = f"an index cannot have a further column {name!r} of type {kind}; allowed: {', '.join(VALUES)}"
            raise ValueError(msg)
    return pa.schema([pa.field(name, pa.type_for_alias(kind)) for name, kind in {**COLUMNS, **further}.items()])


def write_index(path: Path, rows: Iterable[Mapping[str, object]], further: Mapping[str, str]) -> None:
    """Write an index whole or not at all, with no more than one row group in memory.

    Parameters
    ----------
    path : Path
        ``index.parquet`` in the folder of the files, which must be there: their sizes are taken from them.
    rows : iterable of mapping
        In the order of the files and of the numbers in them. Each has the columns of ``COLUMNS`` but for ``size``, and
        further ones; those that it lacks are null.
    further : mapping of str to str
        See ``schema``.

    Raises
    ------
    ValueError
        If a row has a column that the schema has not, or lacks one of ``COLUMNS``.
    RequestError
        If the file cannot be written, or pyarrow is not installed.
    """
    pa = _pyarrow()
    from pyarrow import parquet

    form = schema(further)
    known, needed = set(form.names), set(COLUMNS) - {"size"}
    sizes: dict[str, int] = {}

    def whole(row: Mapping[str, object]) -> dict[str, object]:
        wrong = (row.keys() - known) | (needed - row.keys())
        if wrong:
            # pyarrow would leave out the one and write nulls for the other, without a word
            msg = f"a row of an index has other columns than its schema: {', '.join(sorted(wrong))}"
            raise ValueError(msg)
        name = row["file"]
        if isinstance(name, str) and name not in sizes:
            sizes[name] = (path.parent / name).stat().st_size
        return {**row, "size": sizes.get(str(name), -1)}

    def write(temporary: Path) -> None:
        left = iter(rows)
        with parquet.ParquetWriter(temporary, form, compression="zstd", write_page_checksum=True) as writer:
            while group := [whole(row) for row in islice(left, ROW_GROUP)]:
                writer.write_table(pa.Table.from_pylist(group, schema=form), row_group_size=ROW_GROUP)

    atomic_write(path, write, force=True)


def _pyarrow() -> Any:
    try:
        import pyarrow as pa
    except ImportError:
        msg = f'{INDEX} needs pyarrow: pip install "aeromagsim[parquet]"'
        raise RequestError(msg) from None
    return pa


def is_there(folder: Path) -> bool:
    """Whether a folder has an index, and pyarrow, which reads it, is installed."""
    return (folder / INDEX).is_file() and find_spec("pyarrow") is not None


def read_frame(path: Path) -> "pd.DataFrame":
    """Return an index as a pandas DataFrame, a row for each flight, failed ones too.

    Whole numbers are ``Int64``, which has a place for what a failed flight lacks: as float64, seeds would be rounded.

    Raises
    ------
    RequestError
        If there is no such file, or pyarrow is not installed.
    DataError
        If it is no index.
    """
    import pandas as pd

    table = _read(path, None)
    whole = {kind: pd.Int64Dtype() for kind in table.schema.types if str(kind) in ("int32", "int64")}
    return table.to_pandas(types_mapper=whole.get)


def read_listed(path: Path) -> "IndexedFlights":
    """Return the flights of an index; whether the files are there is not looked at.

    Raises
    ------
    RequestError
        If there is no such file, or pyarrow is not installed.
    DataError
        If it is no index.
    """
    table = _read(path, _OPENED)
    return IndexedFlights(path, table.filter(table["flown"]))


def read_flights(path: Path, files: Sequence[Path]) -> "IndexedFlights":
    """Return the flights of an index, after comparing it with the files that are there.

    No file is opened: names and sizes are compared.

    Parameters
    ----------
    path : Path
    files : sequence of Path
        The recording files of the folder.

    Raises
    ------
    RequestError
        If pyarrow is not installed.
    DataError
        If it is no index, or does not fit the files: what differs first, and how much more does.
    """
    listed = read_listed(path)
    differences = [*differences_of(listed.sizes(), files)]
    if differences:
        more = f", and {len(differences) - 1} more differences" if len(differences) > 1 else ""
        msg = (
            f"{path}: does not fit the files beside it: {differences[0]}{more}; magsim dataset check lists all, and "
            "without the index the files are opened as they are"
        )
        raise DataError(msg)
    return listed


def differences_of(sizes: Mapping[str, int], files: Sequence[Path]) -> Iterator[str]:
    """Describe how names and sizes of files differ from those that an index lists."""
    present = {file.name: file.stat().st_size for file in files}
    yield from (f"{name} is missing" for name in sizes if name not in present)
    yield from (f"{name} is not listed" for name in present if name not in sizes)
    for name, size in sizes.items():
        if present.get(name, size) != size:
            yield f"{name} has {present[name]} bytes, where {size} are listed"


def _read(path: Path, names: Sequence[str] | None) -> "pa.Table":
    """Read columns of an index, or all of them, after a look at its schema."""
    _pyarrow()
    from pyarrow import parquet

    try:
        with parquet.ParquetFile(path, page_checksum_verification=True) as file:
            _check_schema(path, file.schema_arrow, file.metadata.num_rows)
        with parquet.ParquetFile(path, read_dictionary=list(_TEXTS), page_checksum_verification=True) as file:
            table = file.read(columns=None if names is None else list(names))
            table.validate(full=True)
            return table
    except FileNotFoundError:
        msg = f"{path}: there is no such file"
        raise RequestError(msg) from None
    except MagsimError:
        raise
    except Exception as error:  # whatever Arrow stumbles over, the file is the reason
        first = (str(error).splitlines() or [type(error).__name__])[0]
        msg = f"{path}: is no index of a data set: {first[:200]}"
        raise DataError(msg) from None


def _check_schema(path: Path, found: "pa.Schema", rows: int) -> None:
    allowed = {**dict.fromkeys(found.names, VALUES), **{name: (kind,) for name, kind in COLUMNS.items()}}
    for name, kinds in allowed.items():
        count = found.names.count(name)
        if count != 1 or str(found.field(name).type) not in kinds:
            has = f"{count} columns" if count != 1 else f"a column of {found.field(name).type}"
            msg = f"{path}: is no index of a data set: it has {has} {name[:60]!a}; expected one of {' or '.join(kinds)}"
            raise DataError(msg)
    if rows > MOST_ROWS:
        msg = f"{path}: claims {rows} flights; allowed: up to {MOST_ROWS}"
        raise DataError(msg)


class IndexedFlights(Mapping[str, FlightInfo]):
    """The flights of an index by their names; each is described when it is asked for.

    Parameters
    ----------
    path : Path
        The index.
    table : pyarrow.Table
        Its rows of flights that were flown.

    Raises
    ------
    DataError
        If a name is missing or there twice, a file has no name of a recording file, or numbers in a file are not those
        from 0 on.
    """

    def __init__(self, path: Path, table: "pa.Table") -> None:
        import pyarrow.compute as pc

        self._path, self._table = path, table
        self._names = table["name"].combine_chunks()
        texts = table["file"].unify_dictionaries().combine_chunks()
        self._file_names: list[str | None] = texts.dictionary.to_pylist()
        self._files = texts.indices.fill_null(-1).to_numpy(zero_copy_only=False)
        self._numbers, self._rows, self._sizes = (table[name].to_numpy() for name in ("number", "rows", "size"))
        self._splits = {split: table[f"{split}_rows"].to_numpy() for split in columns.SPLITS.values()}
        if self._names.null_count or pc.count_distinct(self._names).as_py() != len(self._names):
            self._refuse("a flight has no name, or two have one name")
        self._check_places()
        every = all(len(self._splits[split]) and self._splits[split].min() > 0 for split in ("train", "test"))
        self._own_groups = bool(every)

    def _check_places(self) -> None:
        if any(name is None or not _FILE.fullmatch(name) for name in self._file_names) or (self._files < 0).any():
            self._refuse("a flown flight is in no file, or its file has a name that recording files do not have")
        starts = np.flatnonzero(np.diff(self._files, prepend=-1))
        if len(np.unique(self._files[starts])) != len(starts):
            self._refuse("the flights of a file do not stand together")
        counts = np.diff(np.append(starts, len(self._files)))
        expected = np.arange(len(self._files)) - np.repeat(starts, counts)
        if not np.array_equal(self._numbers, expected):
            self._refuse("the numbers of the flights of a file are not those from 0 on, in their order")
        self._starts, self._counts = starts, counts
        if (self._sizes != np.repeat(self._sizes[starts], counts)).any():
            self._refuse("one file has two sizes")
        if (self._rows < 2).any() or any((rows < 0).any() for rows in self._splits.values()):
            self._refuse("a flown flight has less than 2 rows, or less than none of a split")

    def _refuse(self, reason: str) -> None:
        msg = f"{self._path}: is no index of a data set: {reason}"
        raise DataError(msg)

    def sizes(self) -> dict[str, int]:
        """Return the sizes of the files [bytes], by their names, in the order of the index."""
        return {str(self._file_names[self._files[i]]): int(self._sizes[i]) for i in self._starts.tolist()}

    def __len__(self) -> int:
        return len(self._names)

    def __iter__(self) -> Iterator[str]:
        return (name.as_py() for name in self._names)

    def __getitem__(self, name: str) -> FlightInfo:
        import pyarrow.compute as pc

        row = pc.index(self._names, name).as_py() if isinstance(name, str) else -1
        if row < 0:
            raise KeyError(name)
        return self.at(row)

    def checksums(self) -> dict[str, str]:
        """Return the SHA-256 of each file, by their names.

        Raises
        ------
        DataError
            If the flights of a file have different ones.
        """
        texts = self._table["sha256"].unify_dictionaries().combine_chunks()
        codes = texts.indices.fill_null(-1).to_numpy(zero_copy_only=False)
        if (codes < 0).any() or (codes != np.repeat(codes[self._starts], self._counts)).any():
            self._refuse("a file has no sha256, or two")
        dictionary = texts.dictionary.to_pylist()
        return dict(zip(self.sizes(), (str(dictionary[codes[i]]) for i in self._starts.tolist()), strict=True))

    def at(self, row: int) -> FlightInfo:
        """Return the flight of a row."""
        name = self._names[row].as_py()
        splits = {split: int(rows[row]) for split, rows in self._splits.items() if rows[row]}
        file = self._path.parent / str(self._file_names[self._files[row]])
        # A file of a sweep holds what its size allows, so that its flights do not belong together.
        group = name if self._own_groups else "all"
        return FlightInfo(name, int(self._rows[row]), splits, file, int(self._numbers[row]), group=group)

    def values(self) -> ValuesView[FlightInfo]:
        """Return a view of the flights, in the order of the index."""
        return _Values(self)

    def items(self) -> ItemsView[str, FlightInfo]:
        """Return a view of names and flights, in the order of the index."""
        return _Items(self)


class _Values(ValuesView[FlightInfo]):
    """The flights of an index by their rows: a search for each name would take the square of the time."""

    def __init__(self, flights: IndexedFlights) -> None:
        super().__init__(flights)
        self._flights = flights

    def __iter__(self) -> Iterator[FlightInfo]:
        return map(self._flights.at, range(len(self._flights)))


class _Items(ItemsView[str, FlightInfo]):
    """Names and flights of an index, as ``_Values``."""

    def __init__(self, flights: IndexedFlights) -> None:
        super().__init__(flights)
        self._flights = flights

    def __iter__(self) -> Iterator[tuple[str, FlightInfo]]:
        return ((info.name, info) for info in self._flights.values())

"""Where the values of flights lie in a file: found once, with all checks, and copied from there without HDF5."""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from magsim import columns
from magsim.errors import DataError
from magsim.recording import file
from magsim.signals import spans
from magsim.storage import hdf5

MOST_OPEN = 200
"""Most files that are kept open at a time: the system bounds those of a process."""


@dataclass(frozen=True)
class Places:
    """The blocks of the flights of one file, and the rows in which windows may lie.

    Attributes
    ----------
    path : Path
    size, changed_ns : int
        Of the file when it was checked: bytes, and the time of its last change.
    flights : tuple of str
        Names.
    channels : dict of str to tuple of str
        Columns of the block of each role, the same in all flights.
    offsets : dict of str to (f,) int
        Where the block of each flight begins [bytes].
    flight, first, stop : (k,) int
        Stretches of rows of some splits without a jump in time: number of the flight, first row, and the row after the
        last.
    """

    path: Path
    size: int
    changed_ns: int
    flights: tuple[str, ...]
    channels: dict[str, tuple[str, ...]]
    offsets: dict[str, np.ndarray]
    flight: np.ndarray
    first: np.ndarray
    stop: np.ndarray


def find_places(path: Path, roles: Sequence[str], codes: np.ndarray | None) -> Places:
    """Open a file with care, and find where its blocks lie.

    Parameters
    ----------
    path : Path
    roles : sequence of str
        The blocks: ``input``, ``label``, ``truth``, ``segment``.
    codes : array, optional
        Codes of the splits that rows must have; all rows by default.

    Raises
    ------
    RequestError
        If there is no such file.
    DataError
        If it is no recording or is damaged, a flight has no such block, or other columns than the first.
    """
    before = path.stat() if path.exists() else None
    names: list[str] = []
    channels: dict[str, tuple[str, ...]] = {}
    offsets: dict[str, list[int]] = {role: [] for role in roles}
    stretches: list[tuple[int, int, int]] = []
    with hdf5.open_untrusted(path) as root:
        for number, group in enumerate(file.flight_groups(root)):
            names.append(file.flight_name(group))
            time_s = _times(group)
            for role in roles:
                offset, found = _block(group, role, len(time_s))
                if channels.setdefault(role, found) != found:
                    group.refuse(f"{role} has other columns than the first flight")
                offsets[role].append(offset)
            stretches += [(number, *ends) for ends in _stretches(group, time_s, codes)]
    assert before is not None  # a file that is not there was refused
    flight, first, stop = np.array(stretches, dtype=np.int32).reshape(-1, 3).T
    places = {role: np.array(found, dtype=np.int64) for role, found in offsets.items()}
    return Places(path, before.st_size, before.st_mtime_ns, tuple(names), channels, places, flight, first, stop)


def _times(group: hdf5.Reader) -> np.ndarray:
    time_s = group.array(columns.TIME, kind="f", ndim=1)
    if len(time_s) < 2 or not np.isfinite(time_s).all() or not np.all(np.diff(time_s) > 0.0):
        group.refuse("time_s is not strictly increasing, finite and of 2 rows or more")
    return time_s


def _block(group: hdf5.Reader, role: str, rows: int) -> tuple[int, tuple[str, ...]]:
    """Return offset and columns of a block."""
    if role not in group.names():
        group.refuse(f"there is no {role}")
    names = tuple(n.decode("utf-8", "replace") for n in group.array(f"{role}_channel", kind="S", ndim=1).tolist())
    offset, shape = group.block(role, ndim=2)
    if shape != (rows, len(names)):
        group.refuse(f"{role} has shape {shape}, which time_s and {role}_channel do not have")
    return offset, names


def _stretches(group: hdf5.Reader, time_s: np.ndarray, codes: np.ndarray | None) -> list[tuple[int, int]]:
    """Return stretches of rows of some splits, first and beyond the last, without a jump in time."""
    found = [(span.start, span.stop) for span in spans(time_s)]
    if codes is None:
        return found
    wanted = np.concatenate([[False], np.isin(_split(group, len(time_s)), codes), [False]])
    edges = np.flatnonzero(np.diff(wanted.astype(int)))
    kept = list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
    return [(max(a, c), min(b, d)) for a, b in found for c, d in kept if max(a, c) < min(b, d)]


def _split(group: hdf5.Reader, rows: int) -> np.ndarray:
    """Return the column ``split`` of a flight; NaN where it has none."""
    segment = columns.SPLIT.role
    if segment in group.names():
        names = [n.decode("utf-8", "replace") for n in group.array(f"{segment}_channel", kind="S", ndim=1).tolist()]
        block = group.array(segment, kind="f", ndim=2)
        if block.shape != (rows, len(names)):
            group.refuse(f"{segment} has shape {block.shape}; expected {(rows, len(names))}")
        if columns.SPLIT.pattern in names:
            return block[:, names.index(columns.SPLIT.pattern)]
    return np.full(rows, np.nan)


class OpenFile:
    """A file that is open for reading at any place, until nobody holds it any more."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._number = os.open(path, os.O_RDONLY | getattr(os, "O_BINARY", 0))

    def __del__(self, close: Callable[[int], None] = os.close) -> None:
        # at the end of the process, the module os may be gone before
        if hasattr(self, "_number"):
            close(self._number)

    def state(self) -> os.stat_result:
        """Return what the system says of the file that is open."""
        return os.fstat(self._number)

    def read(self, offset: int, out: np.ndarray) -> None:
        """Fill a contiguous array with the bytes from an offset on.

        Raises
        ------
        DataError
            If the file ends before.
        """
        count = os.preadv(self._number, [out.data], offset)
        if count != out.nbytes:
            msg = f"{self.path}: ends before its values do"
            raise DataError(msg)


class _OpenFiles:
    """Files that this process has open at the moment; all windows share them.

    Values are read, not mapped: mapped pages add up to whole files, and to give them back now and then costs more than
    the copy that they save.
    """

    def __init__(self) -> None:
        self._files: dict[tuple[Path, int, int], OpenFile] = {}

    def of(self, path: Path, size: int, changed_ns: int) -> OpenFile:
        """Return an open file, refusing one that has changed since it was checked."""
        key = path, size, changed_ns
        found = self._files.get(key)
        if found is None:
            try:
                found = OpenFile(path)
                state = found.state()
            except OSError as error:
                msg = f"{path}: cannot be opened: {error.strerror or error}"
                raise DataError(msg) from None
            if (state.st_size, state.st_mtime_ns) != (size, changed_ns):
                msg = f"{path}: has changed since it was checked"
                raise DataError(msg)
            self._files[key] = found
            if len(self._files) > MOST_OPEN:
                # closed when the last who reads from it is done
                self._files.pop(next(iter(self._files)), None)
        return found


OPEN_FILES = _OpenFiles()
"""Files that this process has open."""

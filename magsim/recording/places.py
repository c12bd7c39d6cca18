"""Where the values of flights lie in a file: found once, with all checks, and copied from there without HDF5."""

import mmap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from magsim import columns
from magsim.errors import DataError
from magsim.recording import file
from magsim.signals import spans
from magsim.storage import hdf5

MOST_MAPPED = 200
"""Most files that are mapped at a time: each holds one of the files that the system lets a process have open."""

RELEASE_BYTES = 16 * 2**20
"""Bytes that are copied before the mapped memory is given back: the system keeps it as its cache of files."""


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


class _Mapped:
    """Files that are mapped at the moment, in this process; all windows of a process share them."""

    def __init__(self) -> None:
        self._maps: dict[tuple[Path, int, int], mmap.mmap] = {}
        self._copied = 0

    def of(self, path: Path, size: int, changed_ns: int) -> mmap.mmap:
        """Return a mapped file, refusing one that has changed since it was checked."""
        key = path, size, changed_ns
        found = self._maps.get(key)
        if found is None:
            try:
                with path.open("rb") as opened:
                    found = mmap.mmap(opened.fileno(), 0, access=mmap.ACCESS_READ)
                    state = path.stat()
            except (OSError, ValueError) as error:
                msg = f"{path}: cannot be mapped: {getattr(error, 'strerror', None) or error}"
                raise DataError(msg) from None
            if (state.st_size, state.st_mtime_ns) != (size, changed_ns):
                msg = f"{path}: has changed since it was checked"
                raise DataError(msg)
            self._maps[key] = found
            if len(self._maps) > MOST_MAPPED:
                self._maps.pop(next(iter(self._maps)), None)
        return found

    def note(self, count: int) -> None:
        """Count copied bytes, and give mapped memory back now and then, so that it does not add up to whole files."""
        self._copied += count
        if self._copied > RELEASE_BYTES:
            self._copied = 0
            if hasattr(mmap, "MADV_DONTNEED"):
                for found in list(self._maps.values()):
                    found.madvise(mmap.MADV_DONTNEED)


MAPPED = _Mapped()
"""Files that this process has mapped."""

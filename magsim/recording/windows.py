"""Windows of rows from many flights, memory-mapped: for training on more than fits into memory."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from magsim import columns
from magsim.errors import RequestError
from magsim.recording import file
from magsim.signals import spans
from magsim.storage import hdf5, inspection


class Windows:
    """Windows of a fixed number of rows of one block from every flight of some files.

    The files are opened with care once, to check them and to find where the blocks lie; from then on windows are copied
    out of mapped memory without HDF5. No window spans a jump in time. The files must not change meanwhile.

    Parameters
    ----------
    paths : Path, str, or several
        Recording files.
    rows : int
        Rows of a window, 1 or more.
    role : str
        The block: ``input``, ``label``, ``truth`` or ``segment``.
    names : sequence of str, optional
        Columns of the block, in the order of the windows; by default all.
    splits : sequence of str, optional
        Only windows whose rows all have one of these splits, ``("train", "valid")``; by default all windows.

    Attributes
    ----------
    names : tuple of str
        Columns of the windows, the same in every flight.
    flights : tuple of str
        Names of the flights.
    rows : int
    total_rows : int
        Rows of all stretches that have windows.

    Raises
    ------
    RequestError
        If there is no such file or column, or no flight has as many rows.
    DataError
        If a file is no recording or is damaged, a flight has no such block, or other columns than the first.
    """

    def __init__(
        self,
        paths: Path | str | Iterable[Path | str],
        *,
        rows: int,
        role: str = "input",
        names: Sequence[str] | None = None,
        splits: Sequence[str] | None = None,
    ) -> None:
        if role not in columns.ROLES or rows < 1:
            msg = f"no windows of {rows} rows of {role!r}; allowed: 1 row or more of {', '.join(columns.ROLES)}"
            raise ValueError(msg)
        files = [Path(paths)] if isinstance(paths, Path | str) else [Path(path) for path in paths]
        if not files:
            msg = "windows need at least one recording file"
            raise RequestError(msg)
        codes = _codes(splits)
        self.rows = rows
        self.total_rows = 0
        self._channels: tuple[str, ...] = ()
        flights: list[str] = []
        self._blocks: list[np.ndarray] = []
        block_of: list[int] = []
        first_of: list[int] = []
        count_of: list[int] = []
        inspection.inspect_many(files)
        for path in files:
            mapped = None
            with hdf5.open_untrusted(path) as root:
                for group in file.flight_groups(root):
                    if mapped is None:
                        mapped = np.memmap(path, dtype=np.uint8, mode="r")
                    self._blocks.append(self._block(group, role, mapped))
                    flights.append(file.flight_name(group))
                    for first, last in _runs(group, codes):
                        if last - first >= rows:
                            self.total_rows += last - first
                            block_of.append(len(self._blocks) - 1)
                            first_of.append(first)
                            count_of.append(last - first - rows + 1)
        if not count_of:
            of_split = f" of the splits {', '.join(splits)}" if splits is not None else ""
            msg = f"no flight of {', '.join(map(str, files[:3]))} has {rows} rows{of_split} without a jump in time"
            raise RequestError(msg)
        self.names = self._channels if names is None else tuple(names)
        self._picked = None if names is None else self._places(self.names)
        self.flights = tuple(flights)
        self._block_of, self._first_of = np.array(block_of), np.array(first_of)
        self._ends = np.cumsum(count_of)

    def __len__(self) -> int:
        """Return the number of different windows: one for every row that a window can begin with."""
        return int(self._ends[-1])

    def _block(self, group: hdf5.Reader, role: str, mapped: np.ndarray) -> np.ndarray:
        if role not in group.names():
            group.refuse(f"there is no {role}")
        names = tuple(n.decode("utf-8", "replace") for n in group.array(f"{role}_channel", kind="S", ndim=1).tolist())
        if self._channels and names != self._channels:
            group.refuse(f"{role} has other columns than the first flight")
        self._channels = names
        offset, shape = group.block(role, ndim=2)
        if shape[1] != len(names) or shape[0] != len(group.array(columns.TIME, kind="f", ndim=1)):
            group.refuse(f"{role} has shape {shape}, which time_s and {role}_channel do not have")
        return np.ndarray(shape, dtype="<f8", buffer=mapped, offset=offset)

    def _places(self, names: Sequence[str]) -> np.ndarray:
        """Return where columns lie in the block."""
        missing = [name for name in names if name not in self._channels]
        if missing or not names:
            has = ", ".join(self._channels[:12])
            msg = f"windows have no column {', '.join(missing) or '(none is named)'}; the flights have {has}"
            raise RequestError(msg)
        return np.array([self._channels.index(name) for name in names])

    def take(self, indices: np.ndarray | Sequence[int], out: np.ndarray | None = None) -> np.ndarray:
        """Copy windows.

        Parameters
        ----------
        indices : (m,) int
            From 0 to ``len(self) - 1``.
        out : (m, rows, c), optional
            Where to; its type decides the precision. A new float64 array by default.

        Returns
        -------
        (m, rows, c)

        Raises
        ------
        IndexError
            If there is no such window.
        """
        indices = np.asarray(indices, dtype=np.int64)
        if indices.size and (indices.min() < 0 or indices.max() >= len(self)):
            msg = f"there are windows 0 to {len(self) - 1}, not {indices.min()} to {indices.max()}"
            raise IndexError(msg)
        runs, starts = self._place(indices)
        shape = (len(indices), self.rows, len(self.names))
        if out is None:
            out = np.empty(shape)
        elif out.shape != shape:
            msg = f"out has shape {out.shape}, expected {shape}"
            raise ValueError(msg)
        rows, blocks = self.rows, self._blocks
        for i, (block, start) in enumerate(zip(self._block_of[runs].tolist(), starts.tolist(), strict=True)):
            window = blocks[block][start : start + rows]
            out[i] = window if self._picked is None else window[:, self._picked]
        return out

    def where(self, index: int) -> tuple[int, int]:
        """Return the number of the flight, from 0 as in ``flights``, and the first row of a window."""
        runs, starts = self._place(np.array([index]))
        return int(self._block_of[runs[0]]), int(starts[0])

    def random(self, count: int, rng: np.random.Generator, out: np.ndarray | None = None) -> np.ndarray:
        """Copy windows that are drawn with equal chances and replacement, (count, rows, c)."""
        return self.take(rng.integers(len(self), size=count), out)

    def _place(self, indices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        runs = np.searchsorted(self._ends, indices, side="right")
        before = np.where(runs > 0, self._ends[runs - 1], 0)
        return runs, self._first_of[runs] + indices - before


def _codes(splits: Sequence[str] | None) -> np.ndarray | None:
    """Return the codes of splits."""
    if splits is None:
        return None
    known = {word: code for code, word in columns.SPLITS.items()}
    unknown = [word for word in splits if word not in known]
    if unknown:
        msg = f"there is no split {unknown[0]!r}; allowed: {', '.join(known)}"
        raise ValueError(msg)
    return np.array([known[word] for word in splits], dtype=float)


def _runs(group: hdf5.Reader, codes: np.ndarray | None) -> list[tuple[int, int]]:
    """Return stretches of rows of some splits, first and beyond the last, without a jump in time."""
    time_s = group.array(columns.TIME, kind="f", ndim=1)
    steps = np.diff(time_s)
    if len(steps) < 1 or not np.isfinite(time_s).all() or not np.all(steps > 0.0):
        group.refuse("time_s is not strictly increasing, finite and of 2 rows or more")
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

"""Windows of rows from many flights, read from their files: for training on more than fits into memory."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from magsim import columns
from magsim.errors import DataError, RequestError
from magsim.recording.places import OPEN_FILES, Places, find_places
from magsim.storage import inspection


class Windows:
    """Windows of a fixed number of rows of one block from every flight of some files.

    The files are opened with care once, to check them and to find where the blocks lie; from then on windows are read
    without HDF5. No window spans a jump in time. A file that has changed meanwhile is refused when it is opened again,
    and must not change later.

    A pickled copy has paths and places and no values: another process opens the files when it needs them.

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
    stride : int
        Rows between the beginnings of two windows of a stretch.

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
        stride: int = 1,
    ) -> None:
        if role not in columns.ROLES or rows < 1 or stride < 1:
            msg = (
                f"no windows of {rows} rows of {role!r} every {stride} rows; allowed: 1 row or more of "
                f"{', '.join(columns.ROLES)}, every 1 row or more"
            )
            raise ValueError(msg)
        files = [Path(paths)] if isinstance(paths, Path | str) else [Path(path) for path in paths]
        if not files:
            msg = "windows need at least one recording file"
            raise RequestError(msg)
        codes = codes_of(splits)
        inspection.inspect_many(files)
        self._lay(
            [find_places(path, (role,), codes) for path in files], rows=rows, role=role, names=names, stride=stride
        )
        if not len(self):
            of_split = f" of the splits {', '.join(splits)}" if splits is not None else ""
            msg = f"no flight of {', '.join(map(str, files[:3]))} has {rows} rows{of_split} without a jump in time"
            raise RequestError(msg)

    @classmethod
    def at(
        cls, places: Sequence[Places], *, rows: int, role: str, names: Sequence[str] | None = None, stride: int = 1
    ) -> "Windows":
        """Return windows at places that were found before; there may be none.

        Raises
        ------
        RequestError
            If there is no such column.
        DataError
            If a file has other columns than the first.
        """
        windows = cls.__new__(cls)
        windows._lay(places, rows=rows, role=role, names=names, stride=stride)
        return windows

    def _lay(self, places: Sequence[Places], *, rows: int, role: str, names: Sequence[str] | None, stride: int) -> None:
        """Give the windows of all files their numbers."""
        channels = places[0].channels[role]
        for other in places:
            if other.channels[role] != channels:
                msg = f"{other.path}: {role} has other columns than the first flight"
                raise DataError(msg)
        self.rows = rows
        self.names = channels if names is None else tuple(names)
        self.flights = tuple(name for place in places for name in place.flights)
        self._width, self._stride = len(channels), stride
        self._picked = None if names is None else _picked(self.names, channels)
        self._files = [(place.path, place.size, place.changed_ns) for place in places]
        counts = [len(place.offsets[role]) for place in places]
        self._file_of = np.repeat(np.arange(len(places), dtype=np.int32), counts)
        self._offset_of = np.concatenate([place.offsets[role] for place in places])
        before = np.cumsum([0, *counts[:-1]])
        flight_of = np.concatenate([place.flight + start for place, start in zip(places, before, strict=True)])
        first_of = np.concatenate([place.first for place in places])
        lengths = np.concatenate([place.stop for place in places]) - first_of
        kept = lengths >= rows
        self._flight_of, self._first_of = flight_of[kept].astype(np.int32), first_of[kept]
        self._ends = np.cumsum((lengths[kept].astype(np.int64) - rows) // stride + 1)
        self.total_rows = int(lengths[kept].sum())

    def __len__(self) -> int:
        """Return the number of different windows; with a stride of 1, one for every row that one can begin with."""
        return int(self._ends[-1]) if len(self._ends) else 0

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
        flights, starts = self._place(indices)
        shape = (len(indices), self.rows, len(self.names))
        if out is None:
            out = np.empty(shape)
        elif out.shape != shape:
            msg = f"out has shape {out.shape}, expected {shape}"
            raise ValueError(msg)
        files = self._file_of[flights]
        opened = {number: OPEN_FILES.of(*self._files[number]) for number in np.unique(files).tolist()}
        offsets = self._offset_of[flights] + starts * (8 * self._width)
        block, picked = np.empty((self.rows, self._width), "<f8"), self._picked
        straight = picked is None and out.dtype == block.dtype and out.flags.c_contiguous
        for i, (number, offset) in enumerate(zip(files.tolist(), offsets.tolist(), strict=True)):
            opened[number].read(offset, out[i] if straight else block)
            if not straight:
                out[i] = block if picked is None else block[:, picked]
        return out

    def where(self, index: int) -> tuple[int, int]:
        """Return the number of the flight, from 0 as in ``flights``, and the first row of a window."""
        flights, starts = self._place(np.array([index]))
        return int(flights[0]), int(starts[0])

    def random(self, count: int, rng: np.random.Generator, out: np.ndarray | None = None) -> np.ndarray:
        """Copy windows that are drawn with equal chances and replacement, (count, rows, c)."""
        return self.take(rng.integers(len(self), size=count), out)

    def _place(self, indices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return number of the flight and first row of windows."""
        runs = np.searchsorted(self._ends, indices, side="right")
        before = np.where(runs > 0, self._ends[runs - 1], 0)
        return self._flight_of[runs], self._first_of[runs] + (indices - before) * self._stride


def _picked(names: Sequence[str], channels: tuple[str, ...]) -> np.ndarray | slice:
    """Return where columns lie in the block; as a slice, which is faster, if they lie side by side."""
    missing = [name for name in names if name not in channels]
    if missing or not names:
        has = ", ".join(channels[:12])
        msg = f"windows have no column {', '.join(missing) or '(none is named)'}; the flights have {has}"
        raise RequestError(msg)
    places = [channels.index(name) for name in names]
    first = places[0]
    together = places == list(range(first, first + len(places)))
    return slice(first, first + len(places)) if together else np.array(places)


def codes_of(splits: Sequence[str] | None) -> np.ndarray | None:
    """Return the codes of splits; None for none.

    Raises
    ------
    ValueError
        If there is no such split.
    """
    if splits is None:
        return None
    known = {word: code for code, word in columns.SPLITS.items()}
    unknown = [word for word in splits if word not in known]
    if unknown:
        msg = f"there is no split {unknown[0]!r}; allowed: {', '.join(known)}"
        raise ValueError(msg)
    return np.array([known[word] for word in splits], dtype=float)

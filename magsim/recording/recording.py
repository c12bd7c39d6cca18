"""A recording: one flight's table of inputs, labels, truth and segments, with its provenance."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Self

import numpy as np

from magsim import columns
from magsim.arrays import readonly
from magsim.errors import RequestError
from magsim.recording import display, file
from magsim.signals import median_step, spans

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.figure import Figure


TRUTHS = ("full", "sum", "none")
"""How much truth a recording keeps: all of it; all but the vectors of the parts; neither truth nor labels."""

_PUBLIC = ("start_utc", "rate_hz")
"""Provenance that a real survey knows too, so that a method may see it."""


class MissingColumnError(KeyError):
    """A column that a recording does not have."""

    def __str__(self) -> str:
        return str(self.args[0])


@dataclass(frozen=True, eq=False, repr=False)
class Recording:
    """One flight at the recording rate.

    The table cannot be changed: the arrays lie in immutable memory, and ``data`` is a read-only mapping. Two recordings
    are equal if names, times, columns and provenance are equal, bit for bit.

    Attributes
    ----------
    name : str
        Name of the flight.
    time_s : (n,) [s]
        Time tags, strictly increasing.
    data : mapping of str to (n,)
        Columns named by ``magsim.columns``, float64, in the units that their names carry.
    meta : mapping
        Provenance: scenario text, digest, seed, version. Empty in a blind or labeled copy but for what a real
        survey would know (``start_utc``, ``rate_hz``).
    """

    name: str
    time_s: np.ndarray
    data: Mapping[str, np.ndarray]
    meta: Mapping[str, object] = field(default_factory=dict)

    def __post_init__(self) -> None:
        time_s = readonly(self.time_s)
        if time_s.ndim != 1 or len(time_s) < 2 or not (np.all(np.diff(time_s) > 0.0) and np.isfinite(time_s).all()):
            msg = f"time_s of {self.name!r} must be one row of at least 2 finite, strictly increasing times"
            raise ValueError(msg)
        data = {name: readonly(column) for name, column in self.data.items()}
        for name, column in data.items():
            columns.role_of(name)
            if column.shape != time_s.shape:
                msg = f"column {name!r} of {self.name!r} has shape {column.shape}, expected {time_s.shape}"
                raise ValueError(msg)
        object.__setattr__(self, "time_s", time_s)
        object.__setattr__(self, "data", MappingProxyType(data))
        object.__setattr__(self, "meta", dict(self.meta))

    def __reduce__(self) -> tuple[object, ...]:
        # a read-only mapping cannot be pickled; the copy is checked and frozen again
        return Recording, (self.name, self.time_s, dict(self.data), self.meta)

    def __len__(self) -> int:
        return len(self.time_s)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Recording):
            return NotImplemented
        return (
            self.name == other.name
            and self.data.keys() == other.data.keys()
            and self.meta == other.meta
            and np.array_equal(self.time_s, other.time_s)
            and all(np.array_equal(self.data[name], other.data[name], equal_nan=True) for name in self.data)
        )

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return display.line(self)

    def _repr_html_(self) -> str:
        return display.html(self)

    def __getitem__(self, name: str) -> np.ndarray:
        """Return one column, (n,), read-only.

        Raises
        ------
        MissingColumnError
            If the recording has no such column; the message names those of the same kind that it has.
        """
        if name == columns.TIME:
            return self.time_s
        try:
            return self.data[name]
        except KeyError:
            kind = name.partition("_")[0]
            kin = [other for other in self.data if other.partition("_")[0] == kind] or list(self.data)
            msg = f"recording {self.name!r} has no column {name!r}; it has {', '.join(kin[:12])}"
            raise MissingColumnError(msg) from None

    def __contains__(self, name: object) -> bool:
        return name in self.data

    def stack(self, names: Iterable[str]) -> np.ndarray:
        """Return several columns side by side, (n, c)."""
        return np.column_stack([self[name] for name in names])

    def vector(self, family: columns.Family, **fields: str) -> np.ndarray:
        """Return the three axes of a vector family, (n, 3)."""
        return self.stack(family.name(axis=axis, **fields) for axis in columns.AXES)

    @cached_property
    def rate_hz(self) -> float:
        """Rows a second, from the median time step."""
        return 1.0 / median_step(self.time_s)

    def names(self, role: str) -> tuple[str, ...]:
        """Return the names of the columns of one role, in file order."""
        return tuple(name for name in self.data if columns.role_of(name) == role)

    @cached_property
    def scalars(self) -> tuple[str, ...]:
        """Names of the scalar magnetometers."""
        return columns.sensors_of(self.data, columns.MAG)

    @cached_property
    def fluxgates(self) -> tuple[str, ...]:
        """Names of the fluxgates."""
        return columns.sensors_of(self.data, columns.FLUX)

    def check_scalar(self, sensor: str) -> None:
        """Refuse a scalar magnetometer that the recording does not have.

        Raises
        ------
        RequestError
            Naming those that it has.
        """
        if sensor not in self.scalars:
            has = ", ".join(self.scalars) or "none"
            msg = f"recording {self.name!r} has no scalar magnetometer {sensor!r}; it has {has}"
            raise RequestError(msg)

    def _keep(self, wanted: Callable[[str], bool]) -> "Recording":
        """Return a copy with some columns and the provenance that a method may see."""
        kept = {name: column for name, column in self.data.items() if wanted(name)}
        return Recording(self.name, self.time_s, kept, {key: self.meta[key] for key in _PUBLIC if key in self.meta})

    def labeled(self) -> "Recording":
        """Return a copy for fitting: inputs, labels and segments, without truth, scenario text, digest and seed."""
        return self._keep(lambda name: columns.role_of(name) in ("input", "label", "segment"))

    def blind(self, patterns: Iterable[str] | None = None) -> "Recording":
        """Return a copy for an estimate: inputs alone, without scenario text, digest and seed.

        Parameters
        ----------
        patterns : iterable of str, optional
            Keep the inputs of these column families only, as ``Compensator.requires`` lists them; by default all.
        """
        allowed = None if patterns is None else set(patterns)

        def wanted(name: str) -> bool:
            family = columns.family_of(name)
            return family.role == "input" and (allowed is None or family.pattern in allowed)

        return self._keep(wanted)

    def with_truth(self, truth: str) -> "Recording":
        """Return a copy with as much truth as ``TRUTHS`` lists: ``full``, ``sum`` or ``none``.

        Raises
        ------
        ValueError
            If there is no such word.
        """
        if truth not in TRUTHS:
            msg = f"truth cannot be {truth!r}; allowed: {', '.join(TRUTHS)}"
            raise ValueError(msg)
        dropped = {"full": (), "sum": (columns.PART,)}.get(truth)
        kept = {
            name: column
            for name, column in self.data.items()
            if (columns.role_of(name) in ("input", "segment") if dropped is None else columns.find(name) not in dropped)
        }
        return replace(self, data=kept)

    def take(self, rows: np.ndarray | slice) -> "Recording":
        """Return the rows that a mask, an index array or a slice selects."""
        return replace(self, time_s=self.time_s[rows], data={name: column[rows] for name, column in self.data.items()})

    def where(self, **values: float | str) -> "Recording":
        """Return the rows whose segment columns have given values, ``where(circuit=1)`` or ``where(split="train")``.

        Raises
        ------
        ValueError
            If fewer than 2 rows are left.
        MissingColumnError
            If the recording has no such segment column.
        """
        rows = self.mask(**values)
        if rows.sum() < 2:
            wanted = ", ".join(f"{key}={value}" for key, value in values.items())
            msg = f"recording {self.name!r} has no rows with {wanted}"
            raise ValueError(msg)
        return self.take(rows)

    def mask(self, **values: float | str) -> np.ndarray:
        """Return a boolean (n,) of the rows whose segment columns have given values (see ``where``).

        Raises
        ------
        ValueError
            If a word stands for no value of that column.
        """
        codes = {"split": columns.SPLITS, "maneuver": columns.MANEUVERS}
        rows = np.ones(len(self), dtype=bool)
        for key, value in values.items():
            code = value
            if isinstance(value, str):
                words = {word: number for number, word in codes.get(key, {}).items()}
                if value not in words:
                    allowed = ", ".join(words) or "numbers"
                    msg = f"{key!r} cannot be {value!r}; allowed: {allowed}"
                    raise ValueError(msg)
                code = words[value]
            rows &= self[key] == code
        return rows

    def reads(self, sensor: str) -> np.ndarray:
        """Return a boolean (n,) of the rows in which a scalar magnetometer reads.

        All rows where the recording has no column for it.

        Raises
        ------
        RequestError
            If the recording has no such magnetometer.
        """
        self.check_scalar(sensor)
        name = columns.MAG_VALID.name(sensor=sensor)
        return self.data[name] == 1.0 if name in self.data else np.ones(len(self), dtype=bool)

    def pieces(self) -> tuple["Recording", ...]:
        """Return the parts between jumps in time of more than 1.5 steps, which may be filtered.

        A single row between two jumps is left out.
        """
        found = spans(self.time_s)
        return (self,) if len(found) == 1 else tuple(self.take(span) for span in found if span.stop - span.start >= 2)

    def plot(self, kind: str = "flight", sensor: str | None = None) -> "Figure":
        """Draw a figure of a kind of ``magsim plot``: ``flight``, ``field``, ``interference``, ``spectrum``, ...

        Raises
        ------
        RequestError
            If there is no such kind, or the recording lacks what it shows.
        """
        return display.figure(self, kind, sensor)

    def to_frame(self) -> "pd.DataFrame":
        """Return the table as a pandas DataFrame with ``time_s`` as index."""
        import pandas as pd

        return pd.DataFrame(dict(self.data), index=pd.Index(self.time_s, name=columns.TIME))

    def to_xarray(self) -> "xr.Dataset":
        """Return the table as an xarray Dataset along ``time_s``, each variable with units, frame, role and meaning.

        Raises
        ------
        RequestError
            If xarray is not installed.
        """
        return display.dataset(self)

    def write(self, path: Path | str, *, force: bool = False) -> None:
        """Write the recording to an HDF5 file, whole or not at all (layout: ``magsim.recording.file``).

        Raises
        ------
        RequestError
            If the path is taken and ``force`` is not set, or cannot be written to.
        DataError
            If a column is not finite.
        """
        file.write(Path(path), [self], force=force)

    @classmethod
    def read(cls, path: Path | str, name: str | None = None) -> Self:
        """Read the flight of a name, or of a file that holds exactly one; ``read_recordings`` reads several.

        Raises
        ------
        RequestError
            If there is no such file or flight, or there are several.
        DataError
            If it is no recording, or is truncated or damaged.
        """
        return cls(*file.read_one(Path(path), name))


def write_recordings(path: Path | str, recordings: Iterable[Recording], *, force: bool = False) -> str:
    """Write several flights to one file, a shard, whole or not at all; an iterator is drawn from while writing.

    Returns
    -------
    str
        SHA-256 of the file.

    Raises
    ------
    RequestError
        If the path is taken and ``force`` is not set, or cannot be written to.
    DataError
        If a column is not finite.
    """
    return file.write(Path(path), recordings, force=force)


def read_recordings(path: Path | str, names: Iterable[str] | None = None) -> tuple[Recording, ...]:
    """Read flights of a file, or of all ``*.h5`` files of a folder in the order of their names.

    Parameters
    ----------
    path : Path or str
    names : iterable of str, optional
        Only the flights of these names; all by default.

    Raises
    ------
    RequestError
        If there is no such file or flight, or the folder has no recording.
    DataError
        If a file is no recording, or is truncated or damaged.
    """
    return tuple(Recording(*stored) for stored in file.read(Path(path), None if names is None else list(names)))

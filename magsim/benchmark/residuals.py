"""What a method leaves of a recording's test rows: all that scores are computed from."""

import json
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from io import BytesIO
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from magsim.arrays import readonly
from magsim.benchmark.twins import PEAKS_NT
from magsim.errors import DataError
from magsim.files import first_bytes
from magsim.recording.segments import NamedRows, cells, headings_and_maneuvers
from magsim.storage import atomic_write

MAX_BYTES = 2**31
"""Largest file of residuals that is read."""

TWINS = ("injected", "change")
"""Signals with a column for each height of anomaly."""


@dataclass(frozen=True)
class Judged:
    """What residuals belong to.

    Attributes
    ----------
    recording : str
    file : str
        Name of the recording's file; empty for one in memory.
    sensor : str
        The scalar magnetometer.
    level : int, optional
        Step of difficulty.
    seed : int
        Of the fit.
    method : str
    """

    recording: str
    file: str
    sensor: str
    level: int | None
    seed: int
    method: str


@dataclass(frozen=True)
class Residuals:
    """Signals of one method on the test rows of one recording; (n,) each, over the rows that count.

    Filtered signals were filtered whole, piece by piece, and cropped. ``reading`` is the scalar magnetometer's,
    ``interference`` the reading minus the clean field, ``compensated`` the reading minus the estimate, ``error`` the
    interference minus the estimate.

    Attributes
    ----------
    judged : Judged
    time_s : (n,) [s]
    piece : (n,)
        Number of the piece that a row was filtered with.
    reading, compensated : (n,) [nT]
        In band.
    injected, change : (n, 3) [nT]
        In band: anomalies of the heights ``PEAKS_NT`` that were added to the reading, and what they change in the
        compensated reading; zero where there were none.
    reading_high, compensated_high : (n,) [nT]
        Above 0.03 Hz.
    far : (n,)
        1 where a row is far enough from the ends for that high-pass.
    fourth : (n,) [nT]
        Fourth difference of the compensated reading over 16, unfiltered: what surveys are checked by.
    interference, error : (n,) [nT], optional
        In band; None without truth.
    floor : (n,) [nT], optional
        In band: what a perfect estimate would leave, the instrument's own error.
    interference_raw, error_raw : (n,) [nT], optional
        Unfiltered.
    slow : (n,) [nT], optional
        Error from 0.005 to 0.1 Hz (``signals.slow_part``); NaN in what was filtered as one and is shorter than 150 s.
    heading_deg, maneuver, turn : (n,), optional
        NamedRows columns of the recording.
    """

    judged: Judged
    time_s: np.ndarray
    piece: np.ndarray
    reading: np.ndarray
    compensated: np.ndarray
    injected: np.ndarray
    change: np.ndarray
    reading_high: np.ndarray
    compensated_high: np.ndarray
    far: np.ndarray
    fourth: np.ndarray
    interference: np.ndarray | None = None
    error: np.ndarray | None = None
    floor: np.ndarray | None = None
    interference_raw: np.ndarray | None = None
    error_raw: np.ndarray | None = None
    slow: np.ndarray | None = None
    heading_deg: np.ndarray | None = None
    maneuver: np.ndarray | None = None
    turn: np.ndarray | None = None

    def __post_init__(self) -> None:
        rows = len(self.time_s)
        for name, values in self._signals().items():
            shape = (rows, len(PEAKS_NT)) if name in TWINS else (rows,)
            if np.shape(values) != shape:
                msg = f"{name} of residuals has shape {np.shape(values)}, expected {shape}"
                raise ValueError(msg)
            object.__setattr__(self, name, readonly(values))

    def __len__(self) -> int:
        return len(self.time_s)

    def _signals(self) -> dict[str, np.ndarray]:
        """Return what there is, by name."""
        found = {item.name: getattr(self, item.name) for item in fields(self) if item.name != "judged"}
        return {name: values for name, values in found.items() if values is not None}

    def has(self, name: str) -> bool:
        """Whether a signal is known; ``far`` and ``slow`` if any row has them, ``cells`` if there are any."""
        if name == "cells":
            return bool(self.cells)
        values = getattr(self, name)
        if values is None:
            return False
        return {"far": np.any(values), "slow": np.isfinite(values).any()}.get(name, True)

    def take(self, rows: np.ndarray) -> "Residuals":
        """Return the rows that a mask or an index array selects, which need not be in the order of time."""
        return Residuals(self.judged, **{name: values[rows] for name, values in self._signals().items()})

    @property
    def segments(self) -> list[NamedRows]:
        """Straight legs by heading, and maneuvers; see ``magsim.recording.segments``."""
        return headings_and_maneuvers(self._segment_columns())

    @property
    def cells(self) -> list[NamedRows]:
        """Maneuvers on headings: the cells of a figure of merit."""
        return cells(self._segment_columns())

    def _segment_columns(self) -> dict[str, np.ndarray]:
        table = {"leg_heading_deg": self.heading_deg, "maneuver": self.maneuver, "turn": self.turn}
        return {name: values for name, values in table.items() if values is not None}

    def write(self, path: Path | str, *, force: bool = False) -> None:
        """Write the residuals to a file (npz), whole or not at all, so that they can be judged elsewhere.

        Raises
        ------
        RequestError
            If the path is taken and ``force`` is not set, or cannot be written to.
        """
        about = np.frombuffer(json.dumps(asdict(self.judged), sort_keys=True).encode(), dtype=np.uint8)

        def save(temporary: Path) -> None:
            with temporary.open("wb") as file:
                np.savez(file, **{"judged": about, **self._signals()})  # type: ignore[arg-type] # arrays by name

        atomic_write(Path(path), save, force=force)

    @classmethod
    def read(cls, path: Path | str) -> "Residuals":
        """Read what ``write`` wrote.

        Raises
        ------
        RequestError
            If there is no such file.
        DataError
            If it holds no residuals or is damaged.
        """
        path = Path(path)
        data = first_bytes(path, MAX_BYTES, kind="a file of residuals")
        try:
            with np.load(BytesIO(data), allow_pickle=False) as file:
                arrays = dict(file)
            judged = Judged(**json.loads(arrays.pop("judged").tobytes()))
            return cls(judged, **arrays)
        except (ValueError, TypeError, KeyError, EOFError, RecursionError, BadZipFile, zlib.error) as error:
            msg = f"{path}: holds no residuals: {error}"
            raise DataError(msg) from None


def pooled(residuals: Sequence[Residuals], judged: Judged | None = None) -> Residuals:
    """Join residuals: of several pieces, flights or seeds.

    Parameters
    ----------
    residuals : sequence of Residuals
        One or more. A signal that one of them lacks is missing in the whole.
    judged : Judged, optional
        What the whole belongs to; by default that of the first.

    Raises
    ------
    ValueError
        If there is none.
    """
    if not residuals:
        msg = "there are no residuals to join"
        raise ValueError(msg)
    offsets = np.cumsum([0.0, *(one.piece.max(initial=-1.0) + 1.0 for one in residuals[:-1])])
    tables: list[Mapping[str, np.ndarray]] = [
        {**one._signals(), "piece": one.piece + offset} for one, offset in zip(residuals, offsets, strict=True)
    ]
    shared = [name for name in tables[0] if all(name in table for table in tables)]
    whole = {name: np.concatenate([table[name] for table in tables]) for name in shared}
    return Residuals(judged or residuals[0].judged, **whole)


Score = Callable[[Residuals], float]
"""A pure function of residuals."""

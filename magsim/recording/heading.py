"""The heading table: what a magnetometer read over one and the same point on each heading.

A flight whose legs all pass one point lists the passes in ``meta["notes"]["center_passes"]``. What the
ground adds is the same in all passes, so what differs between them is the aircraft (and the day).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from magsim import columns
from magsim.errors import DataError
from magsim.recording import Recording


@dataclass(frozen=True)
class CenterPass:
    """One pass of the center."""

    circuit: int
    leg: int
    heading_deg: float
    """Planned course of the pass."""
    time_s: float
    miss_m: float
    """Horizontal distance from the center."""
    height_error_m: float
    """Height above that of the center."""
    clean_nt: float | None
    """Field without the aircraft; None where the recording holds no truth."""
    reading_nt: float
    interference_nt: float | None
    """Norm with the aircraft minus norm without it; None where the recording holds no labels."""


def has_heading_table(recording: Recording) -> bool:
    """Whether a recording lists passes of a center."""
    return bool(_passes(recording))


def heading_table(recording: Recording, sensor: str) -> tuple[CenterPass, ...]:
    """Values of a sensor at the center, pass by pass, linear between the rows.

    Parameters
    ----------
    recording : Recording
    sensor : str
        A scalar magnetometer.

    Returns
    -------
    tuple of CenterPass
        Empty where the flight passes no center; passes outside the rows are left out.

    Raises
    ------
    KeyError
        If the recording has no such sensor.
    DataError
        If its list of passes is damaged.
    """
    reading = recording[columns.MAG.name(sensor=sensor)]
    names = columns.CLEAN.name(sensor=sensor), columns.INTERFERENCE.name(sensor=sensor)
    clean, interference = (recording.data.get(name) for name in names)

    def at(time_s: float, values: np.ndarray) -> float:
        return float(np.interp(time_s, recording.time_s, values))

    out = []
    for entry in _passes(recording):
        try:
            time_s = float(entry["time_s"])
            heading_deg, miss_m, height_error_m = (
                float(entry[key]) for key in ("heading_deg", "miss_m", "height_error_m")
            )
            circuit, leg = int(entry["circuit"]), int(entry["leg"])
        except (KeyError, TypeError, ValueError, OverflowError):
            msg = f"recording {recording.name!r}: its list of center passes is damaged"
            raise DataError(msg) from None
        if recording.time_s[0] <= time_s <= recording.time_s[-1]:
            out.append(
                CenterPass(
                    circuit=circuit,
                    leg=leg,
                    heading_deg=heading_deg,
                    time_s=time_s,
                    miss_m=miss_m,
                    height_error_m=height_error_m,
                    clean_nt=None if clean is None else at(time_s, clean),
                    reading_nt=at(time_s, reading),
                    interference_nt=None if interference is None else at(time_s, interference),
                )
            )
    return tuple(out)


def _passes(recording: Recording) -> list[Mapping]:
    """Return the entries of the notes; none where a file holds something else."""
    notes = recording.meta.get("notes")
    found = notes.get("center_passes") if isinstance(notes, Mapping) else None
    return [entry for entry in found if isinstance(entry, Mapping)] if isinstance(found, list) else []

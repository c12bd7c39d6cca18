"""Rows that a fit of coefficients must refuse: a field that hardly turns in the axes of the aircraft, dead channels."""

from collections.abc import Sequence

import numpy as np

from magsim import columns
from magsim.compensation.columns import Design
from magsim.errors import DataError
from magsim.recording import Recording

LEAST_ANGLE_DEG = 15.0
"""Angle that the field must sweep in the axes of the aircraft. Measured (docs/diagnosis.md): Tolles-Lawson with 16
terms from one line, judged on maneuvers on the same heading, has an improvement ratio of 0.3 at 3.4 deg, 1.2 and 4.6 at
9 deg, 7.6 at 14 deg and 18 at 19 deg. Level flight of surveys has about 12 deg (SGL data, public MagNav work, 2026)."""

SWEEPS = 4
"""Steps of the search for the two directions that are farthest apart."""


def angle_swept_deg(directions: np.ndarray) -> float:
    """Return the largest angle between two directions [deg], found by going to the farthest one again and again.

    Parameters
    ----------
    directions : (n, 3)
        Of any length but zero.
    """
    unit = directions / np.sqrt(np.einsum("ni,ni->n", directions, directions))[:, None]
    start, widest = unit.mean(axis=0), 0.0
    for _ in range(SWEEPS):
        cosines = np.einsum("ni,i->n", unit, start)
        start = unit[int(np.argmin(cosines))]
        away = unit - start
        # the chord is exact where the cosine has no digits left
        chord = float(np.sqrt(np.einsum("ni,ni->n", away, away).max()))
        widest = max(widest, float(np.degrees(2.0 * np.arcsin(min(chord / 2.0, 1.0)))))
    return widest


def check_angle(designs: Sequence[Design], read: Sequence[np.ndarray], names: Sequence[str]) -> None:
    """Refuse rows in which the field turns too little in the axes of the aircraft.

    Parameters
    ----------
    designs : sequence of Design
        Those with three permanent columns, the direction of the field, are looked at.
    read : sequence of (n,) bool
        Rows to fit.
    names : sequence of str
        Of the recordings.

    Raises
    ------
    DataError
        With the angle, the columns that are alike, and the remedy.
    """
    permanent = np.array([group == "permanent" for group in designs[0].groups])
    if permanent.sum() != 3:
        return
    check_directions([d.matrix[rows][:, permanent] for d, rows in zip(designs, read, strict=True)], names)


def check_directions(directions: Sequence[np.ndarray], names: Sequence[str]) -> None:
    """Refuse directions of the field in the axes of the aircraft, (n, 3) of each recording, that turn too little.

    Raises
    ------
    DataError
    """
    angle = angle_swept_deg(np.concatenate(directions))
    if angle < LEAST_ANGLE_DEG:
        raise DataError(unobservable(angle, ", ".join(repr(name) for name in names[:4])))


def unobservable(angle_deg: float, names: str) -> str:
    """Return why a fit is refused, in words."""
    return (
        f"recording {names}: the field sweeps {angle_deg:.1f} deg in the axes of the aircraft, and a fit needs "
        f"{LEAST_ANGLE_DEG:g}: permanent, induced and eddy terms look alike there and are unobservable; fly pitch, "
        "roll and yaw maneuvers on several headings (magsim observe tells which)"
    )


_PLACE = tuple(columns.INS_ATTITUDE.name(angle=angle) for angle in ("lat", "lon"))


def check_channels(recordings: Sequence[Recording], patterns: Sequence[str], sensor: str) -> None:
    """Refuse channels that never change over all rows: a dead magnetometer, fluxgate axis or attitude teaches nothing.

    Parameters
    ----------
    recordings : sequence of Recording
    patterns : sequence of str
        Column families that are read.
    sensor : str
        The scalar magnetometer, whose reading is looked at where its family is among them.

    Raises
    ------
    DataError
        Naming the channels, with the remedy.
    """
    dead = []
    for name in recordings[0].names("input"):
        family = columns.family_of(name)
        if family.pattern not in patterns or family not in (columns.MAG, columns.FLUX, columns.INS_ATTITUDE):
            continue
        if family is columns.MAG and name != columns.MAG.name(sensor=sensor):
            continue
        if name in _PLACE:  # a line due north has one longitude
            continue
        if is_constant(recordings, name):
            dead.append(name)
    if dead:
        msg = (
            f"recording {recordings[0].name!r}: {', '.join(dead)} never changes, a dead channel; leave out the rows "
            "in which it was dead, import another channel in its place, or choose another sensor or fluxgate"
        )
        raise DataError(msg)


def is_constant(recordings: Sequence[Recording], name: str) -> bool:
    """Whether a channel has one value in all rows of all recordings."""
    found = [recording[name] for recording in recordings if name in recording]
    return bool(found) and all(np.ptp(values) == 0.0 and values[0] == found[0][0] for values in found)

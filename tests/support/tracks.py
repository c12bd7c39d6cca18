"""A logged track made from formulas, as the shipped scenario ``patterns/track`` carries it.

``python -m tests.support.tracks FILE`` writes it. Two legs of 70 s joined by a half turn, with roll, pitch and yaw
swings on each; heights above the sea in feet, as flight recorders write them.
"""

import sys
from pathlib import Path

import numpy as np

from magsim.terrain import TangentPlane
from magsim.units import FT, G0

RATE_HZ = 10
LEG_S, TURN_S = 70.0, 60.0
SPEED_MPS, HEIGHT_M = 72.0, 450.0
START = (52.2, 9.8)
SWINGS = (("pitch", 4.0, 6.0, 10.0), ("roll", 10.0, 6.0, 30.0), ("heading", 5.0, 7.0, 46.0))
"""Angle, amplitude [deg], period [s], time on the leg [s]; three cycles each."""


def _step(x: np.ndarray) -> np.ndarray:
    """Step from 0 to 1 with three continuous derivatives."""
    x = np.clip(x, 0.0, 1.0)
    return x**4 * (35.0 - 84.0 * x + 70.0 * x**2 - 20.0 * x**3)


def course_of(time: np.ndarray) -> np.ndarray:
    """Course [rad]: north, half a turn to the right, south."""
    return np.pi * _step((time - LEG_S) / TURN_S)


def track(time: np.ndarray) -> dict[str, np.ndarray]:
    """Columns of the file at times from 0 [s]."""
    fine = np.arange(0.0, time[-1] + 1e-9, 1e-3)
    step = 1e-3
    middle = course_of(fine[:-1] + 0.5 * step)
    north = np.concatenate([[0.0], np.cumsum(SPEED_MPS * np.cos(middle) * step)])
    east = np.concatenate([[0.0], np.cumsum(SPEED_MPS * np.sin(middle) * step)])
    rows = np.round(time / step).astype(int)
    plane = TangentPlane(*np.radians(START), HEIGHT_M)
    lat, lon = plane.geodetic(north[rows], east[rows])
    turning = (course_of(time + 1e-4) - course_of(time - 1e-4)) / 2e-4
    angles = {
        "roll": np.arctan(SPEED_MPS * turning / G0),
        "pitch": np.full(len(time), np.radians(2.0)),
        "heading": course_of(time),
    }
    for begin in (0.0, LEG_S + TURN_S):
        for axis, amplitude, period, start in SWINGS:
            inside = time - begin - start
            envelope = _step(inside / period) * _step((4.0 * period - inside) / period)
            angles[axis] = angles[axis] + np.radians(amplitude) * envelope * np.sin(2.0 * np.pi * inside / period)
    turn = (time >= LEG_S) & (time < LEG_S + TURN_S)
    return {
        "time_s": time,
        "lat_deg": np.degrees(lat),
        "lon_deg": np.degrees(lon),
        "alt_msl_ft": (HEIGHT_M + 5.0 * np.sin(2.0 * np.pi * time / 50.0)) / FT,
        "roll_deg": np.degrees(angles["roll"]),
        "pitch_deg": np.degrees(angles["pitch"]),
        "heading_deg": np.degrees(angles["heading"]) % 360.0,
        "line": np.where(time < LEG_S + TURN_S, 1.0, 2.0),
        "turn": turn.astype(float),
    }


def write_csv(path: Path) -> None:
    """Write the file: angles to 1e-5 deg, places to 1e-8 deg, heights to 0.01 ft."""
    table = track(np.arange(0.0, 2.0 * LEG_S + TURN_S + 1e-9, 1.0 / RATE_HZ))
    formats = ("%.1f", "%.8f", "%.8f", "%.2f", "%.5f", "%.5f", "%.5f", "%.0f", "%.0f")
    lines = ["# Made by tests/support/tracks.py: two legs and a half turn, 10 rows a second", ",".join(table)]
    for row in zip(*table.values(), strict=True):
        lines.append(",".join(form % (value + 0.0) for form, value in zip(formats, row, strict=True)))
    path.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    write_csv(Path(sys.argv[1]))

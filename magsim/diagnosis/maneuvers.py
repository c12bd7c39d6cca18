"""Model maneuvers and model survey lines: the direction of the field in the axes of the aircraft, in band.

Headings are magnetic: they are counted from the horizontal part of the field, so that a fluxgate alone is enough.
"""

from typing import NamedTuple

import numpy as np

from magsim import signals
from magsim.compensation.columns import Terms, tolles_lawson_columns
from magsim.compensation.columns.direction import time_derivative
from magsim.frames import rot_nb_from_attitude, rotate_back
from magsim.streams import stream

HEADINGS = {"north": 0.0, "east": 90.0, "south": 180.0, "west": 270.0}

AMPLITUDES_DEG = {"pitch": 5.0, "roll": 10.0, "yaw": 5.0}
"""Of the maneuvers of a figure of merit (SEG Wiki, after the Geological Survey of Canada, 1991)."""

PERIOD_S = 6.0
"""Of the maneuvers: within the 4 to 10 s that crews fly (estimate)."""

LINE_DEG = {"roll": 0.29, "pitch": 0.08, "yaw": 0.12}
"""RMS of the attitude in band on a straight level line in light air, vertical gusts of 0.7 m/s: measured on the Cessna
208B of ``patterns/straight`` without maneuvers, 300 s."""

LINE_S, MANEUVER_S = 300.0, 60.0
"""Time in band of a model line and of a model maneuver [s]."""

AXES = ("roll", "pitch", "yaw")


class Ambient(NamedTuple):
    """The field that an aircraft flies in."""

    horizontal_nt: float
    down_nt: float

    @property
    def strength_nt(self) -> float:
        """Length of the field [nT]."""
        return float(np.hypot(self.horizontal_nt, self.down_nt))

    @property
    def inclination_deg(self) -> float:
        """Angle of the field below the horizontal [deg]."""
        return float(np.degrees(np.arctan2(self.down_nt, self.horizontal_nt)))


def ambient_of(fluxgate_nt: np.ndarray) -> Ambient:
    """Return the field from a fluxgate whose axes are about those of the aircraft, x forward and z down.

    Parameters
    ----------
    fluxgate_nt : (n, 3) [nT]
        Mostly level flight: the median of the third axis is the vertical part.
    """
    down = float(np.median(fluxgate_nt[:, 2]))
    strength = float(np.mean(np.sqrt(np.einsum("ni,ni->n", fluxgate_nt, fluxgate_nt))))
    return Ambient(float(np.sqrt(max(strength**2 - down**2, 0.0))), down)


def _columns(ambient: Ambient, heading_deg: float, swing_deg: np.ndarray, rate_hz: float, terms: Terms) -> np.ndarray:
    """Return Tolles-Lawson columns in band for swings about level flight, (n, 3) [deg], without the ends."""
    attitude = np.radians(swing_deg + np.array([0.0, 0.0, heading_deg]))
    field = np.array([ambient.horizontal_nt, 0.0, ambient.down_nt])
    cosines = rotate_back(rot_nb_from_attitude(attitude), np.tile(field, (len(attitude), 1))) / ambient.strength_nt
    time_s = np.arange(len(attitude)) / rate_hz
    strength = np.full(len(attitude), ambient.strength_nt)
    matrix = tolles_lawson_columns(cosines, time_derivative(cosines, time_s), strength, terms)
    return signals.in_band(matrix, time_s)


def maneuver_columns(ambient: Ambient, heading: str, axis: str, rate_hz: float, terms: Terms) -> np.ndarray:
    """Return the columns of a minute of one maneuver on one heading, in band, (n, terms)."""
    time_s = np.arange(round((MANEUVER_S + 2.0 * signals.EDGE_S) * rate_hz)) / rate_hz
    swing = np.zeros((len(time_s), 3))
    swing[:, AXES.index(axis)] = AMPLITUDES_DEG[axis] * np.sin(2.0 * np.pi * time_s / PERIOD_S)
    return _columns(ambient, HEADINGS[heading], swing, rate_hz, terms)


def line_columns(ambient: Ambient, heading: str, rate_hz: float, terms: Terms) -> np.ndarray:
    """Return the columns of a straight level line in light air, in band, (n, terms): the same for every call."""
    count = round((LINE_S + 2.0 * signals.EDGE_S) * rate_hz)
    noise = signals.band_pass(stream(0, "diagnosis/line").standard_normal((count, 3)), rate_hz)
    swing = noise / noise.std(axis=0) * [LINE_DEG[axis] for axis in AXES]
    return _columns(ambient, HEADINGS[heading], swing, rate_hz, terms)

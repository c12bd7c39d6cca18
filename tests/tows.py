"""Flying ropes for the tests: what drives them, how they are let go, their whole states through time."""

from collections.abc import Callable

import numpy as np
from scipy.spatial.transform import Rotation

from magsim.flight.tow.chain import advance
from magsim.flight.tow.line import Line
from magsim.flight.tow.steady import steady
from magsim.flight.tow.swing import hanging
from tests.truth.ropes import AIR, air_of

Drive = Callable[[np.ndarray], np.ndarray]


def level(speed_mps: float, density: float = AIR) -> Drive:
    """A level tow to the north."""
    return lambda time_s: np.tile(air_of(speed_mps, density), (len(time_s), 1))


def moved(
    speed_mps: float, amplitude_m: float, period_s: float, axis: int = 1, ease_s: float = 0.0, density: float = AIR
) -> Drive:
    """A tow to the north whose hook swings as a sine along an axis: 1 to the right, 2 down.

    The swing begins within ``ease_s``, with three continuous derivatives of its size.
    """
    omega = 2.0 * np.pi / period_s

    def drive(time_s: np.ndarray) -> np.ndarray:
        share = np.clip(time_s / ease_s, 0.0, 1.0) if ease_s else np.ones(len(time_s))
        size = share**4 * (35.0 - 84.0 * share + 70.0 * share**2 - 20.0 * share**3)
        rest = share * (1.0 - share)
        slope = 140.0 * rest**3 / ease_s if ease_s else 0.0 * share
        bend = 420.0 * rest**2 * (1.0 - 2.0 * share) / ease_s**2 if ease_s else 0.0 * share
        sin, cos = np.sin(omega * time_s), np.cos(omega * time_s)
        out = np.tile(air_of(speed_mps, density), (len(time_s), 1))
        velocity = amplitude_m * (size * omega * cos + slope * sin)
        out[:, axis] -= amplitude_m * ((bend - omega**2 * size) * sin + 2.0 * slope * omega * cos)
        out[:, 3 + axis] -= velocity
        out[:, 6 + axis] -= velocity
        return out

    return drive


def at_rest(line: Line, speed_mps: float, density: float = AIR) -> np.ndarray:
    """State of a line in its equilibrium, (s,)."""
    found = steady(line, speed_mps, density)
    assert found is not None
    return hanging(line, found, air_of(speed_mps, density))


def tilted(line: Line, state: np.ndarray, angle_rad: float, axis: str = "x") -> np.ndarray:
    """The whole line turned stiffly about the tow point: about x to the side, about y along the tow."""
    turn, inner, body = Rotation.from_euler(axis, angle_rad), 3 * (line.links - 1), 6 * (line.links - 1)
    out = state.copy()
    for first in (*range(0, 2 * inner, 3), body, body + 3):
        out[first : first + 3] = turn.apply(state[first : first + 3])
    out[body + 9 :] = np.roll((turn * Rotation.from_quat(np.roll(state[body + 9 :], -1))).as_quat(), 1)
    return out


def states(
    line: Line, state: np.ndarray, drive: Drive, *, seconds: float, step_hz: int, log_hz: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times (m,), states (m, s) there and, between the rows, least and most tension (m - 1, 2), from time 0 on."""
    every, rows = step_hz // log_hz, round(seconds * log_hz)
    out, tension, now = np.empty((rows + 1, len(state))), np.empty((rows, 2)), np.array(state, dtype=float)
    out[0] = now
    for row in range(rows):
        halves = (2 * row * every + np.arange(2 * every + 1)) / (2.0 * step_hz)
        logged = np.empty((every, 4))
        advance(line.numbers, now, drive(halves), 1.0 / step_hz, logged)
        out[row + 1], tension[row] = now, [logged[:, 2].min(), logged[:, 3].max()]
    return np.arange(rows + 1) / log_hz, out, tension


def body_of(line: Line, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places (m, 3) [m] of the body and its roll, pitch and heading (m, 3) [rad] in rows of states."""
    body = 6 * (line.links - 1)
    turns = Rotation.from_quat(np.roll(rows[:, body + 9 :], -1, axis=1)).as_euler("ZYX")
    return rows[:, body : body + 3], np.unwrap(turns[:, ::-1], axis=0)

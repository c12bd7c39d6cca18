"""Flying ropes with bodies through time, a batch of flights at once."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from magsim.flight.tow.chain import advance, nodes_of
from magsim.flight.tow.line import Line
from magsim.flight.tow.steady import Steady

Drive = Callable[[np.ndarray], np.ndarray]
"""What acts from outside on one flight, see ``chain``: times (n,) [s] to ten numbers each, (n, 10)."""

CHUNK_S = 20.0
"""The drives are asked for so much of the flight at once."""


@dataclass(frozen=True)
class Swing:
    """One flight of a body under its rope, relative to the tow point, along the common axes.

    Attributes
    ----------
    time_s : (m,) [s]
    place_m, velocity_mps : (m, 3)
        Center of gravity of the body.
    quaternion : (m, 4)
        From the body's axes to the common ones.
    rate_b : (m, 3) [rad/s]
        Body's axes.
    bridle_m : (m, 3)
        Lower end of the rope.
    tension_n : (m, 2) [N]
        Of the first and of the last link.
    least_n, most_n : float [N]
        Over all links and steps.
    begun_s : float [s]
        When the line began to swing: before the first row where the log was cut.
    slack_s, lost_s : float or None
        When a link first pushed, which a rope cannot; when the numbers ceased to be numbers.
    """

    time_s: np.ndarray
    place_m: np.ndarray
    velocity_mps: np.ndarray
    quaternion: np.ndarray
    rate_b: np.ndarray
    bridle_m: np.ndarray
    tension_n: np.ndarray
    least_n: float
    most_n: float
    begun_s: float
    slack_s: float | None
    lost_s: float | None

    @classmethod
    def of(cls, time_s: np.ndarray, table: np.ndarray, **found: float | None) -> "Swing":
        """From times (m,) and logged rows (m, 18): place, velocity, rate, quaternion, bridle, tensions."""
        place, velocity, rate, quaternion, bridle, tension = np.split(table, [3, 6, 9, 13, 16], axis=1)
        return cls(time_s, place, velocity, quaternion, rate, bridle, tension, **found)


def hanging(line: Line, found: Steady, air: np.ndarray) -> np.ndarray:
    """State (s,) of a body that hangs at rest below its tow point.

    Parameters
    ----------
    line : Line
    found : Steady
    air : (10,)
        Gives the directions of down and of the tow.
    """
    down = air[:3] / np.linalg.norm(air[:3])
    aft = air[3:6] - np.dot(air[3:6], down) * down
    forward = -aft / np.linalg.norm(aft)
    axes = np.column_stack([forward, np.cross(down, forward), down])
    turned = (Rotation.from_matrix(axes) * Rotation.from_rotvec([0.0, found.pitch, 0.0])).as_quat()
    state, body = np.zeros(line.size), 6 * (line.links - 1)
    inner = np.cumsum(found.links, axis=0)[:-1] * line.numbers.link_m
    state[: body // 2] = (inner[:, :1] * forward + inner[:, 1:] * down).ravel()
    state[body : body + 3] = found.hang_m[0] * forward + found.hang_m[1] * down
    state[body + 9 :] = np.roll(turned, 1)
    return state


def swing(
    lines: Sequence[Line],
    states: Sequence[np.ndarray],
    drives: Sequence[Drive],
    *,
    start_s: float,
    duration_s: Sequence[float],
    step_hz: int,
    log_hz: int,
    progress: Callable[[float], None] | None = None,
) -> list[Swing]:
    """Fly a batch of lines; none of them has to do with another, and each may last as long as it wants.

    Parameters
    ----------
    lines : sequence of Line
    states : sequence of (s,)
        At the start.
    drives : sequence of Drive
    start_s : float [s]
    duration_s : sequence of float [s]
    step_hz, log_hz : int [Hz]
        The second divides the first.
    progress : callable, optional
        Told the share that is done, 0 to 1.

    Returns
    -------
    list of Swing
        One for each line. A flight whose numbers are lost ends there, with rows that are NaN.
    """
    out = []
    for number, flight in enumerate(zip(lines, states, drives, duration_s, strict=True)):
        out.append(_swing(*flight, start_s=start_s, step_hz=step_hz, log_hz=log_hz))
        if progress is not None:
            progress((number + 1) / len(lines))
    return out


def _swing(
    line: Line, state: np.ndarray, drive: Drive, duration_s: float, *, start_s: float, step_hz: int, log_hz: int
) -> Swing:
    every, rows = step_hz // log_hz, int(np.floor(duration_s * log_hz + 1e-6)) + 1
    chunk = max(1, round(CHUNK_S * log_hz))
    body = 6 * (line.links - 1)
    state, table = np.array(state, dtype=float), np.full((rows, 18), np.nan)
    least, most, slack_s, lost_s = np.inf, -np.inf, None, None
    for first in range(0, rows, chunk):
        count = min(chunk, rows - first)
        # the last row needs its tensions alone
        halves = start_s + (2 * first * every + np.arange(2 * count * every + 1)) / (2.0 * step_hz)
        airs = drive(np.minimum(halves, start_s + (rows - 1) / log_hz))
        logged = np.empty((every, 4))
        for row in range(count):
            table[first + row, :13] = state[body:]
            table[first + row, 13:16] = nodes_of(line, state)[-1]
            advance(line.numbers, state, airs[2 * row * every : 2 * (row + 1) * every + 1], 1.0 / step_hz, logged)
            table[first + row, 16:] = logged[0, :2]
            time_s = start_s + (first + row) / log_hz
            if not np.isfinite(state.sum() + logged.sum()):
                lost_s = time_s
                break
            least, most = min(least, logged[:, 2].min()), max(most, logged[:, 3].max())
            if slack_s is None and least < 0.0:
                slack_s = time_s + float((logged[:, 2] < 0.0).argmax()) / step_hz
        if lost_s is not None:
            break
    return Swing.of(
        start_s + np.arange(rows) / log_hz,
        table,
        least_n=float(least),
        most_n=float(most),
        begun_s=start_s,
        slack_s=slack_s,
        lost_s=lost_s,
    )

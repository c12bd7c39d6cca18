"""Flying ropes for the tests: what drives them, how they are let go, their whole states through time."""

from collections.abc import Callable

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from magsim.flight.tow.chain import Chain
from magsim.flight.tow.dynamics import advance
from magsim.flight.tow.equilibrium import find_equilibrium, hanging_state
from tests.support.ropes import AIR, air_of

Forcing = Callable[[np.ndarray], np.ndarray]


def level(speed_mps: float, density: float = AIR) -> Forcing:
    """A level tow to the north."""
    return lambda time_s: np.tile(air_of(speed_mps, density), (len(time_s), 1))


def moved(
    speed_mps: float, amplitude_m: float, period_s: float, *, axis: int = 1, ease_s: float = 0.0, density: float = AIR
) -> Forcing:
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


def at_rest(chain: Chain, speed_mps: float, density: float = AIR) -> np.ndarray:
    """State of a chain in its equilibrium, (s,)."""
    found = find_equilibrium(chain, speed_mps, density)
    assert found is not None
    return hanging_state(chain, found, air_of(speed_mps, density))


def tilted(chain: Chain, state: np.ndarray, angle_rad: float, axis: str = "x") -> np.ndarray:
    """The whole chain turned stiffly about the tow point: about x to the side, about y along the tow."""
    turn, inner, body = Rotation.from_euler(axis, angle_rad), 3 * (chain.links - 1), 6 * (chain.links - 1)
    out = state.copy()
    for first in (*range(0, 2 * inner, 3), body, body + 3):
        out[first : first + 3] = turn.apply(state[first : first + 3])
    out[body + 9 :] = np.roll((turn * Rotation.from_quat(np.roll(state[body + 9 :], -1))).as_quat(), 1)
    return out


def states(
    chain: Chain, state: np.ndarray, drive: Forcing, *, seconds: float, step_hz: int, log_hz: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times (m,), states (m, s) there and, between the rows, least and most tension (m - 1, 2), from time 0 on."""
    every, rows = step_hz // log_hz, round(seconds * log_hz)
    out, tension, now = np.empty((rows + 1, len(state))), np.empty((rows, 2)), np.array(state, dtype=float)
    airs, logged = drive(np.arange(2 * rows * every + 1) / (2.0 * step_hz)), np.empty((every, 4))
    out[0] = now
    for row in range(rows):
        advance(chain.constants, now, airs[2 * row * every : 2 * (row + 1) * every + 1], 1.0 / step_hz, logged)
        out[row + 1], tension[row] = now, [logged[:, 2].min(), logged[:, 3].max()]
    return np.arange(rows + 1) / log_hz, out, tension


def body_of(chain: Chain, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places (m, 3) [m] of the body and its roll, pitch and heading (m, 3) [rad] in rows of states."""
    body = 6 * (chain.links - 1)
    turns = Rotation.from_quat(np.roll(rows[:, body + 9 :], -1, axis=1)).as_euler("ZYX")
    return rows[:, body : body + 3], np.unwrap(turns[:, ::-1], axis=0)


def decay(time_s: np.ndarray, values: np.ndarray) -> tuple[float, float]:
    """Period [s] and damping ratio of an oscillation that dies away to zero, by its extremes after the first second."""
    curve = CubicSpline(time_s, values)
    at = curve.derivative().roots(extrapolate=False)
    at = at[(at > time_s[0] + 1.0) & (at < time_s[-1])]
    sizes = np.abs(curve(at))
    fall = np.log(sizes[0] / sizes[-1]) / (np.pi * (len(at) - 1))
    return float(2.0 * (at[-1] - at[0]) / (len(at) - 1)), float(fall / np.hypot(1.0, fall))


def strongest_mode(values: np.ndarray, step_s: float, *, above_hz: float, order: int = 10) -> tuple[float, float]:
    """Frequency [Hz] and damping ratio of the strongest of the damped oscillations that a signal is made of.

    Matrix pencil (Hua and Sarkar 1990): the poles are eigenvalues of the shift within the signal's leading subspace.

    Parameters
    ----------
    values : (n,)
        Evenly spaced; it dies away to zero.
    step_s : float [s]
    above_hz : float
        Slower ones do not count.
    order : int
        Number of poles.
    """
    window = len(values) // 2
    hankel = np.lib.stride_tricks.sliding_window_view(values, window + 1)
    basis = np.linalg.svd(hankel, full_matrices=False)[2][:order].T
    poles = np.linalg.eigvals(np.linalg.lstsq(basis[:-1], basis[1:], rcond=None)[0])
    powers = poles[None, :] ** np.arange(len(values))[:, None]
    sizes = np.abs(np.linalg.lstsq(powers, values.astype(complex), rcond=None)[0])
    rates = np.log(poles) / step_s
    sizes[np.abs(rates.imag) < 2.0 * np.pi * above_hz] = 0.0
    rate = rates[sizes.argmax()]
    return float(abs(rate.imag) / (2.0 * np.pi)), float(-rate.real / abs(rate))


def nudged(chain: Chain, speed_mps: float, axis: int, log_hz: int = 8) -> np.ndarray:
    """Angle [rad] about an axis of a body that is given a small rate about it in its equilibrium: 1 pitch, 2 yaw.

    20 s, counted from the equilibrium.
    """
    state, body = at_rest(chain, speed_mps), 6 * (chain.links - 1)
    before = body_of(chain, state[None])[1][0, axis]
    state[body + 6 + axis] = 0.02
    _, rows, _ = states(chain, state, level(speed_mps), seconds=20.0, step_hz=240, log_hz=log_hz)
    return body_of(chain, rows)[1][:, axis] - before


def started(speed_mps: float, ease_s: float, sway_m: float = 0.0, sway_s: float = 11.0) -> tuple[Forcing, Forcing]:
    """A hook that starts from rest to the north and sways to the right: its places (n, 3) [m] and what drives a chain.

    The speed is taken up within ``ease_s`` with two continuous derivatives; the sway is ``sway_m (1 - cos w t)``.
    """
    omega, turn = 2.0 * np.pi / sway_s, 2.0 * np.pi

    def place(time_s: np.ndarray) -> np.ndarray:
        share = np.clip(time_s / ease_s, 0.0, 1.0)
        eased = 0.5 * share**2 + (np.cos(turn * share) - 1.0) / turn**2
        north = speed_mps * (ease_s * eased + np.maximum(time_s - ease_s, 0.0))
        return np.column_stack([north, sway_m * (1.0 - np.cos(omega * time_s)), np.zeros(len(time_s))])

    def drive(time_s: np.ndarray) -> np.ndarray:
        share = np.clip(time_s / ease_s, 0.0, 1.0)
        out = np.tile(air_of(0.0), (len(time_s), 1))
        out[:, 0] -= speed_mps / ease_s * (1.0 - np.cos(turn * share))
        out[:, 1] -= sway_m * omega**2 * np.cos(omega * time_s)
        north, east = speed_mps * (share - np.sin(turn * share) / turn), sway_m * omega * np.sin(omega * time_s)
        out[:, 3] = out[:, 6] = -north
        out[:, 4] = out[:, 7] = -east
        return out

    return place, drive

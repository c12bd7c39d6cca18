"""The laws: pure functions of arrays at one rate."""

import numpy as np
from scipy import signal

from magsim.storage.compiled import compiled


def dipole(offset_m: np.ndarray) -> np.ndarray:
    """Return the field of unit moments at an offset from them, (k, 3, 3) [nT/(A m^2)].

    ``mu0 / (4 pi) (3 r r^T / r^2 - 1) / r^3`` (Jackson, eq. 5.56).

    Parameters
    ----------
    offset_m : (k, 3) [m]
        From each dipole to the place.
    """
    length = np.linalg.norm(offset_m, axis=1)[:, None, None]
    along = offset_m[:, :, None] * offset_m[:, None, :] / length**2
    return 100.0 * (3.0 * along - np.eye(3)) / length**3


@compiled
def _relays(  # noqa: PLR0917 - compiled: it takes arrays one by one
    field: np.ndarray, up: np.ndarray, down: np.ndarray, weights: np.ndarray, state: np.ndarray, out: np.ndarray
) -> None:
    for row in range(len(field)):
        total = 0.0
        for relay in range(len(up)):
            if field[row] >= up[relay]:
                state[relay] = 1.0
            elif field[row] <= down[relay]:
                state[relay] = -1.0
            total += weights[relay] * state[relay]
        out[row] = total


def preisach(field: np.ndarray, up: np.ndarray, down: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return what relays that remember give back of a field, (n,): Preisach's hysteresis.

    A relay goes to +1 at its upper threshold and to -1 at its lower one (Mayergoyz, Mathematical Models of
    Hysteresis, 1991). Each begins as the first field leaves it, and at -1 where the field lies between its thresholds
    and they lie above zero on average, else at +1: demagnetized.

    Parameters
    ----------
    field : (n,) [nT]
    up, down : (r,) [nT]
        Thresholds, ``up >= down``.
    weights : (r,)
    """
    state = np.where(up + down > 0.0, -1.0, 1.0)
    out = np.empty(len(field))
    _relays(np.ascontiguousarray(field), up, down, weights, state, out)
    return out


def langevin(x: np.ndarray) -> np.ndarray:
    """Return ``coth x - 1 / x``, the magnetization of a paramagnet; its series near zero."""
    small = np.abs(x) < 1e-3
    safe = np.where(small, 1.0, x)
    return np.where(small, x / 3.0, 1.0 / np.tanh(safe) - 1.0 / safe)


def loop_current(flux: np.ndarray, tau_s: float, rate_hz: float) -> np.ndarray:
    """Return the current of a loop, as ``-(flux - its exponential mean over tau)``, (n,) [unit of the flux].

    ``tau di/dt + i = -tau d flux/dt``, exact for a flux that is linear between samples; it begins at rest.

    Parameters
    ----------
    flux : (n,)
    tau_s : float [s]
    rate_hz : float [Hz]
    """
    step = 1.0 / (rate_hz * tau_s)
    decay = np.exp(-step)
    gain = (1.0 - decay) / step
    change = np.diff(flux, prepend=flux[:1])
    return np.asarray(signal.lfilter([-gain], [1.0, -decay], change))


def backlash(angle: np.ndarray, play: float) -> np.ndarray:
    """Return what follows an angle behind a play of full width, (n,): it moves when a side of the play pushes it."""
    out = np.empty(len(angle))
    _follow(np.ascontiguousarray(angle), 0.5 * play, out)
    return out


@compiled
def _follow(angle: np.ndarray, half: float, out: np.ndarray) -> None:
    held = angle[0]
    for row in range(len(angle)):
        held = min(max(held, angle[row] - half), angle[row] + half)
        out[row] = held


def second_order(values: np.ndarray, corner_hz: float, rate_hz: float) -> np.ndarray:
    """Return values behind a Butterworth low-pass of second order, forward alone, begun at rest; rows by columns."""
    sections = signal.butter(2, corner_hz, fs=rate_hz, output="sos")
    begin = signal.sosfilt_zi(sections)[:, :, None] * values[0]
    return np.asarray(signal.sosfilt(sections, values, axis=0, zi=begin)[0])


def low_pass(values: np.ndarray, rate_hz: float, edge_hz: float) -> np.ndarray:
    """Return values behind a linear-phase low-pass of 2 s without delay, (n,) or (n, k); ends are held."""
    taps = signal.firwin(2 * round(rate_hz) + 1, edge_hz, window=("kaiser", 9.0), fs=rate_hz)
    padded = np.pad(values, [(round(rate_hz), round(rate_hz)), *[(0, 0)] * (values.ndim - 1)], mode="edge")
    return np.asarray(signal.fftconvolve(padded, taps.reshape(-1, *[1] * (values.ndim - 1)), mode="valid", axes=0))

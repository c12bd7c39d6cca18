"""Eddy currents as modes: reduction of any R-L circuit in a changing field, and its exact time stepping.

Every conductor that obeys ``L dI/dt + R I = -F dB_0/dt`` and makes ``B = S I`` fits: loops of wire, or the stream
function of a thin skin.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from magsim.field.kernels import step_modes


@dataclass(frozen=True)
class Modes:
    """Independent first-order modes: ``tau dq/dt + q = -drive . dB_0/dt`` and ``B = sum_k field_k q_k``.

    Attributes
    ----------
    tau_s : (k,) [s]
        Time constants, the longest first.
    drive : (k, 3) [m^2 / sqrt(ohm)]
    field : (s, 3, k) [T / (A sqrt(ohm))]
        At each place. ``field @ drive`` is in seconds, so nT in gives nT out.
    """

    tau_s: np.ndarray
    drive: np.ndarray
    field: np.ndarray


def reduce_to_modes(inductance: np.ndarray, resistance: np.ndarray, flux: np.ndarray, field: np.ndarray) -> Modes:
    """Diagonalize ``L u = tau R u`` with ``u^T R u = 1``.

    Parameters
    ----------
    inductance, resistance : (c, c) [H], [ohm]
        Symmetric, positive definite.
    flux : (c, 3) [m^2]
        Flux through each circuit for each component of a uniform field.
    field : (s, 3, c) [T/A]
        Field of each circuit at each place.

    Returns
    -------
    Modes
    """
    if len(inductance) == 0:
        return Modes(np.zeros(0), np.zeros((0, 3)), np.zeros((len(field), 3, 0)))
    tau, vectors = eigh(inductance, resistance)
    tau, vectors = tau[::-1], vectors[:, ::-1]
    # A mode has no sign of its own: the largest entry is made positive, so that results can be compared.
    vectors = vectors * np.sign(vectors[np.argmax(np.abs(vectors), axis=0), np.arange(len(tau))])
    return Modes(
        tau_s=tau,
        drive=np.einsum("ck,cx->kx", vectors, flux),
        field=np.einsum("sxc,ck->sxk", field, vectors),
    )


def slow_limit(modes: Modes) -> np.ndarray:
    """Return ``E`` with ``B = E dB_0/dt`` for slow motion, (s, 3, 3) [s]."""
    return -np.einsum("sik,kj->sij", modes.field, modes.drive)


def states(modes: Modes, rate: np.ndarray, step_s: float, *, lag: bool = True) -> np.ndarray:
    """Return the states of all modes along a flight, (n, k); ``modes.field`` times these is the field.

    Each mode is stepped exactly for a derivative of the field that is linear between samples, and started on the slow
    limit ``-(s - tau ds/dt)`` with ``s = drive . dB_0/dt``, so that no transient is left.

    Parameters
    ----------
    modes : Modes
    rate : (n, 3) [nT/s]
        Time derivative of the ambient field in body axes.
    step_s : float [s]
    lag : bool
        False: proportional to ``rate``, without time constants.
    """
    driven = rate @ modes.drive.T
    return _stepped(modes, driven, step_s) if lag else -driven


def _stepped(modes: Modes, driven: np.ndarray, step_s: float) -> np.ndarray:
    """Return the states for ``s`` (n, k), which is overwritten."""
    tau = modes.tau_s
    decay, mean = np.exp(-step_s / tau), tau / step_s * -np.expm1(-step_s / tau)
    slope = (-3.0 * driven[0] + 4.0 * driven[1] - driven[2]) / (2.0 * step_s)
    step_modes(driven, np.stack([decay, decay - mean, mean - 1.0]), tau * slope - driven[0])
    return driven


def warmed(modes: Modes, states: np.ndarray, rate: np.ndarray, step_s: float, resistance: np.ndarray) -> np.ndarray:
    """Return the states of metal whose resistance changes slowly, all over alike, (n, k).

    Then ``tau dq/dt + r q = -s`` with ``s = drive . dB_0/dt``, in the modes of ``r = 1``, whose states ``p`` obey
    ``tau dp/dt = -(s + p)``. With ``q = p / r + c`` that is ``tau dc/dt + r c = -(1 - 1/r) (s + p)``, which is stepped
    with ``r = 1`` on the left: an error of ``(r - 1)^2 omega tau`` of the state, and of ``tau dr/dt``.

    Parameters
    ----------
    modes : Modes
    states : (n, k)
        For ``r = 1``, of ``states``.
    rate : (n, 3) [nT/s]
        Time derivative of the ambient field in body axes.
    step_s : float [s]
    resistance : (n,)
        ``r``.
    """
    inverse = 1.0 / resistance[:, None]
    late = (1.0 - inverse) * (rate @ modes.drive.T + states)
    return states * inverse + _stepped(modes, late, step_s)


def slow_states(modes: Modes, rate: np.ndarray, curve: np.ndarray) -> np.ndarray:
    """Return the states of all modes to first order in their time constants, (n, k).

    ``q = -(s - tau ds/dt)`` with ``s = drive . dB_0/dt``: for samples that are too far apart to step from one to the
    next. The error is ``(omega tau)^2`` of the state.

    Parameters
    ----------
    modes : Modes
    rate, curve : (n, 3) [nT/s], [nT/s^2]
        First and second time derivative of the ambient field in body axes.
    """
    return modes.tau_s * (curve @ modes.drive.T) - rate @ modes.drive.T

"""What the aircraft's metal adds along a flight: fixed and hinged moments, induced magnetization, eddy currents."""

import numpy as np

from magsim.errors import RequestError
from magsim.field.metal.eddy import step_rate
from magsim.field.response import AircraftResponse
from magsim.field.situation import Situation
from magsim.field.sources.dipoles import HingedDipole, hinged_field
from magsim.scenario import EddyPart


def permanent(situation: Situation) -> np.ndarray:
    """Field of the fixed dipoles, (n, s, 3) [nT]."""
    shape = (len(situation.time_s), len(situation.mounts), 3)
    return np.broadcast_to(situation.response.permanent_nt[situation.rows], shape)


def hinged(situation: Situation) -> np.ndarray:
    """Field of the dipoles on control surfaces, (n, s, 3) [nT].

    Raises
    ------
    RequestError
        If a dipole turns with a surface whose deflection the flight does not tell, and which is not held at rest.
    """
    positions = situation.positions_m
    out = np.zeros((len(situation.time_s), len(positions), 3))
    for dipole, cos, sin in hinged_turns(situation):
        for s, position in enumerate(positions):
            out[:, s] += hinged_field(dipole, cos, sin, position)
    return out


def hinged_turns(situation: Situation) -> list[tuple[HingedDipole, np.ndarray, np.ndarray]]:
    """Dipoles on control surfaces with cosine and sine of their deflections, (n,) or (1,) each; see ``hinged``."""
    angles = situation.flight.controls_at(situation.time_s)
    turns = {name: (np.cos(angle), np.sin(angle)) for name, angle in angles.items()}
    rest, at_rest = (np.ones(1), np.zeros(1)), situation.scenario.field.hinged.at_rest
    for dipole in situation.response.hinged:
        if dipole.surface not in turns and dipole.surface not in at_rest:
            told = ", ".join(turns) or "none"
            msg = (
                f"aircraft {situation.scenario.aircraft}: hinged dipole {dipole.name!r} turns with the surface "
                f"{dipole.surface!r}, which the flight does not log (logged: {told}); allowed: its deflection in the "
                f"track, field.hinged.at_rest = ['{dipole.surface}'], or field.hinged.enabled = false"
            )
            raise RequestError(msg)
    return [(dipole, *turns.get(dipole.surface, rest)) for dipole in situation.response.hinged]


def induced(situation: Situation) -> np.ndarray:
    """Field of the induced magnetization, ``D B_0``, (n, s, 3) [nT]."""
    return np.einsum("sij,nj->nsi", situation.response.induced[situation.rows], situation.ambient_b)


def eddy(situation: Situation) -> np.ndarray:
    """Field of the eddy currents, (n, s, 3) [nT]."""
    part = situation.scenario.field.eddy
    return eddy_field(situation.response, situation.rows, situation.ambient_rate_b, situation.step_s, part)


def eddy_field(
    response: AircraftResponse, rows: np.ndarray, rate: np.ndarray, step_s: float, part: EddyPart
) -> np.ndarray:
    """Field of the eddy currents for a given change of the ambient field.

    Parameters
    ----------
    response : AircraftResponse
    rows : (s,) int
        Mounts, as rows of the response.
    rate : (n, 3) [nT/s]
        Time derivative of the ambient field in body axes.
    step_s : float [s]
    part : EddyPart
        ``lag = False``: proportional to ``rate``, without time constants.

    Returns
    -------
    (n, s, 3) [nT]
    """
    states = eddy_states(response, rate, step_s, part)
    # States of all modes first, then one product with their fields: (n, k) is small beside (n, s, 3) for each mode.
    fields = response.field[rows].reshape(3 * len(rows), len(response.tau_s))
    return (states @ fields.T).reshape(len(rate), len(rows), 3)


def eddy_states(response: AircraftResponse, rate: np.ndarray, step_s: float, part: EddyPart) -> np.ndarray:
    """States of the modes of the eddy currents; see ``eddy_field``.

    Returns
    -------
    (n, k)
        What ``response.field`` multiplies.
    """
    driven = rate @ response.drive.T
    if not part.lag:
        return -driven
    for k, tau in enumerate(response.tau_s):
        driven[:, k] = step_rate(tau, driven[:, k], step_s)
    return driven

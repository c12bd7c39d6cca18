"""Mounts that give way under the loads of the flight, and what it does to the field there.

Each mode of a boom is an oscillator that the specific force at the mount drives; a floor or bracket, far stiffer,
follows the force. The place in the aircraft file is that of the parked aircraft, so that its own weight has bent
everything already: straight flight leaves it there.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from magsim.aircraft.magnetics import FlexMode
from magsim.field.load import specific_force
from magsim.field.situation import Situation
from magsim.field.stepping import first_order
from magsim.units import G0

REACH_M = 0.01
"""Half the distance over which the gradient at a mount is taken: to 3e-4 for a source 1 m away, 4e-3 at 0.3 m."""


@dataclass(frozen=True)
class BendingMode:
    """One way in which a mount gives, by its effect at the mount.

    Attributes
    ----------
    direction : (3,)
        Unit vector, body axes: where the mount goes.
    frequency_hz, damping : float
        Natural frequency, and damping over the critical one (below 1); both zero for what follows the force.
    participation : float
        Deflection of the mount over that of a mass on a spring of the same frequency: 1 for a mass at the end of a
        light boom, 1.566 for the end of a uniform cantilever.
    tilt : (3,) [rad/m]
        Rotation vector of the mount for each meter it goes; 1.3765 over the length for the end of a uniform cantilever.
    compliance : float [s^2]
        Way for each m/s^2 of what follows the force; 0 for an oscillator.
    """

    direction: np.ndarray
    frequency_hz: float
    damping: float
    participation: float
    tilt: np.ndarray
    compliance: float = 0.0

    @classmethod
    def of(cls, mode: FlexMode) -> "BendingMode":
        """Return a mode of the aircraft file."""
        return cls(
            direction=np.array(mode.direction),
            frequency_hz=mode.frequency_hz or 0.0,
            damping=mode.damping or 0.0,
            participation=mode.participation,
            tilt=np.array(mode.tilt_radpm),
            compliance=1e-3 * (mode.compliance_mmpg or 0.0) / G0,
        )


def bend(mode: BendingMode, force_b: np.ndarray, step_s: float) -> np.ndarray:
    """Return the deflection of one mode under a specific force.

    ``x'' + 2 d w x' + w^2 x = -p e . (f - f_rest)`` with ``f_rest = (0, 0, -g)``, stepped exactly for a force that is
    straight between samples; it begins at rest where the first force holds it. What follows the force is at the place
    where such an oscillator would rest.

    Parameters
    ----------
    mode : BendingMode
    force_b : (n, 3) [m/s^2]
    step_s : float [s]

    Returns
    -------
    (n,) [m]
    """
    drive = -mode.participation * np.einsum("ni,i->n", force_b - np.array([0.0, 0.0, -G0]), mode.direction)
    if mode.compliance:
        return mode.compliance * drive
    omega = 2.0 * math.pi * mode.frequency_hz
    ringing = omega * math.sqrt(1.0 - mode.damping**2)
    rate = complex(-mode.damping * omega, ringing)
    # x = Im q / ringing for dq/dt = rate q + drive; at rest q = -drive / rate.
    return first_order(rate, drive.astype(complex), step_s, np.asarray(-drive[0] / rate)).imag / ringing


@dataclass(frozen=True)
class Bending:
    """How the mounts of a situation bend.

    Attributes
    ----------
    shifts_b, tilts_b : mapping of str to (n, 3) [m], [rad]
        Of the mounts that do.
    """

    shifts_b: Mapping[str, np.ndarray]
    tilts_b: Mapping[str, np.ndarray]

    @classmethod
    def of(cls, situation: Situation) -> "Bending":
        """Return the bending of all mounts that carry a sensor; of none where ``field.flex`` is off."""
        settings, step_s = situation.scenario.field.flex, situation.step_s
        shifts, tilts = {}, {}
        for name, place in zip(situation.mounts, situation.positions_m, strict=True):
            modes = situation.magnetics.mounts[name].flex
            if not (settings.enabled and modes):
                continue
            force_b = specific_force(situation.motion, situation.rot_nb, step_s, place)
            shifts[name] = np.zeros_like(force_b)
            tilts[name] = np.zeros_like(force_b)
            for mode in map(BendingMode.of, modes):
                way = settings.scale * bend(mode, force_b, step_s)[:, None]
                shifts[name] += way * mode.direction
                tilts[name] += way * mode.tilt
        return cls(shifts, tilts)


def places_around(situation: Situation, bending: Bending) -> dict[str, np.ndarray]:
    """Return places on both sides of each bending mount along each axis, for the gradient of the field."""
    return {
        f"{name}/{sign:+d}{axis}": situation.magnetics.mounts[name].position_m + sign * REACH_M * np.eye(3)[k]
        for name in bending.shifts_b
        for k, axis in enumerate("xyz")
        for sign in (1, -1)
    }


def moved(around: np.ndarray, shifts_b: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the change of one part of the field by the bending, to first order.

    Parameters
    ----------
    around : (n, 6 m, 3) [nT]
        The part at ``places_around`` of the ``m`` mounts that bend.
    shifts_b : mapping of str to (n, 3) [m]

    Returns
    -------
    dict of str to (n, 3) [nT]
    """
    sides = around.reshape(len(around), len(shifts_b), 3, 2, 3)
    out = {}
    for m, (name, shift_b) in enumerate(shifts_b.items()):
        slopes = (sides[:, m, :, 0] - sides[:, m, :, 1]) / (2.0 * REACH_M)
        out[name] = np.einsum("nji,nj->ni", slopes, shift_b)
    return out

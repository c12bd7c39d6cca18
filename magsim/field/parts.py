"""The parts that an aircraft adds to the field: each is defined here once, for flights, tows and mount maps.

A linear part is the sum, over its sources, of a gain (the field of a source at a place for unit strength) times a
strength over time. A turning part is the sum over dipoles whose moments and places turn or move with the flight.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from magsim.aircraft.magnetics import Dipole, RotatingDipole
from magsim.field.excitation import Excitation
from magsim.field.hanging import hanging_strengths, rotating_on
from magsim.field.kernels import summed
from magsim.field.response import AircraftResponse
from magsim.field.sources.dipoles import DeflectedDipole, DeflectedDipoles
from magsim.field.sources.moving import LinkedDipole, SeatedDipole
from magsim.field.sources.rotors import ShaftDipole, SpinningDipole
from magsim.population.spreads import MAGNETS

GAINS = ("fixed", "metal", "modes", "feeders", "hanging")
"""Kinds of gains, in the order of the sources of an aircraft; see ``gains_of``."""


def gains_of(response: AircraftResponse, kind: str) -> np.ndarray:
    """Return the gains of one kind at the places of a response.

    Parameters
    ----------
    response : AircraftResponse
    kind : str
        ``"fixed"``: the field of the fixed dipoles, and that of the magnets of each material [nT]; ``"metal"``: of the
        steel in a unit ambient field along x, y, z; ``"modes"``: of the eddy-current modes; ``"feeders"``: of each
        feeder [nT/A]; ``"hanging"``: the change as what hangs on rubber mounts goes, by ``magsim.field.hanging``.

    Returns
    -------
    (s, 3, c)
    """
    arrays = {
        "fixed": np.concatenate([response.permanent_nt[:, :, None], response.magnets_nt], axis=2),
        "metal": response.induced,
        "modes": response.field,
        "feeders": response.wiring_nt_per_a,
        "hanging": response.hanging,
    }
    return arrays[kind]


# ---- strengths -------------------------------------------------------------------------------------------------


def _permanent(excitation: Excitation, response: AircraftResponse) -> np.ndarray:
    del response
    warmth = excitation.warmth
    if warmth is None:
        return np.array([[1.0, *(0.0 for _ in MAGNETS)]])
    return np.column_stack([np.ones_like(warmth.magnets_k), *(warmth.moment(magnet) for magnet in MAGNETS)])


def _ambient(excitation: Excitation, response: AircraftResponse) -> np.ndarray:
    del response
    return excitation.ambient_b


def _remembered(excitation: Excitation, response: AircraftResponse) -> np.ndarray | None:
    del response
    memory = excitation.magnetics.memory
    return None if memory is None else excitation.remembered(memory)


def _eddy_states(excitation: Excitation, response: AircraftResponse) -> np.ndarray:
    return excitation.eddy_states(response.modes)


def _currents(excitation: Excitation, response: AircraftResponse) -> np.ndarray | None:
    del response
    feeders, drawn = excitation.magnetics.feeders, excitation.currents_a
    if not feeders:
        return None
    none = np.zeros(len(excitation.ambient_b))
    return np.column_stack([drawn.get(feeder.name, none) for feeder in feeders])


def _hanging(excitation: Excitation, response: AircraftResponse) -> np.ndarray | None:
    del response
    magnetics = excitation.magnetics
    if not magnetics.suspensions:
        return None
    ways, moments = {}, {}
    for name, mounts in magnetics.suspensions.items():
        ways[name] = 1e-3 * np.array(mounts.compliance_mmpg) * -excitation.load_g(np.array(mounts.position_m))
        turning_there = rotating_on(magnetics, name)
        moments[name] = [excitation.moment(_on_shaft(excitation, part), part.rotor) for part in turning_there]
    return hanging_strengths(magnetics, ways, excitation.ambient_b, moments)


@dataclass(frozen=True)
class LinearPart:
    """A part that is a sum of gains times strengths.

    Attributes
    ----------
    gains : str
        One of ``GAINS``.
    strengths : callable
        Strengths (n, c) of the sources, or (1, c) where they are constant, from the excitation and the response;
        None for an aircraft without such sources.
    """

    gains: str
    strengths: Callable[[Excitation, AircraftResponse], np.ndarray | None]

    def field(self, excitation: Excitation, response: AircraftResponse, rows: np.ndarray) -> np.ndarray | None:
        """Return the part at some places of a response, (n, s, 3) [nT]; None for an aircraft without it.

        Parameters
        ----------
        excitation : Excitation
        response : AircraftResponse
        rows : (s,) int
            The places, as rows of the response.
        """
        strengths = self.strengths(excitation, response)
        if strengths is None:
            return None
        gains = np.ascontiguousarray(gains_of(response, self.gains)[rows])
        field = np.swapaxes(summed(gains, np.ascontiguousarray(strengths)), 0, 1)
        return np.broadcast_to(field, (len(excitation.ambient_b), *field.shape[1:]))


class TurningDipole(Protocol):
    """A dipole whose moment, and where it is off the axis also its place, turns with the flight."""

    def at(self, points: np.ndarray) -> np.ndarray:
        """Return the field at fixed points (s, 3) [m], (n, s, 3) [nT]."""

    def along(self, places: np.ndarray) -> np.ndarray:
        """Return the field at moving places (n, s, 3) [m], (n, s, 3) [nT]."""

    def gains(self, points: np.ndarray) -> np.ndarray:
        """Return its field as a linear part: gains at fixed points (s, 3) [m], (s, 3, c)."""

    @property
    def strengths(self) -> np.ndarray:
        """The strengths to these gains, (n, c)."""


@dataclass(frozen=True)
class WarmedDipole:
    """A magnet that turns with the flight, and whose moment follows the temperature.

    Attributes
    ----------
    dipole : TurningDipole
        In the air of the start's height.
    factor : (n,)
        Moment over that.
    """

    dipole: TurningDipole
    factor: np.ndarray

    def at(self, points: np.ndarray) -> np.ndarray:
        """Return the field at fixed points (s, 3) [m], (n, s, 3) [nT]."""
        return self.factor[:, None, None] * self.dipole.at(points)

    def along(self, places: np.ndarray) -> np.ndarray:
        """Return the field at moving places (n, s, 3) [m], (n, s, 3) [nT]."""
        return self.factor[:, None, None] * self.dipole.along(places)

    def gains(self, points: np.ndarray) -> np.ndarray:
        """Return its field as a linear part: gains at fixed points (s, 3) [m], (s, 3, c)."""
        return self.dipole.gains(points)

    @property
    def strengths(self) -> np.ndarray:
        """The strengths to these gains, (n, c)."""
        return self.factor[:, None] * self.dipole.strengths


def _in_this_air(excitation: Excitation, dipole: Dipole, turning: TurningDipole) -> TurningDipole:
    """Return what turns, with a moment that follows the temperature where it is a magnet's."""
    if dipole.magnet is None or excitation.warmth is None:
        return turning
    return WarmedDipole(turning, 1.0 + excitation.warmth.moment(dipole.magnet))


def _hinged(excitation: Excitation) -> list[TurningDipole]:
    cold: list[DeflectedDipole] = []
    warm: list[TurningDipole] = []
    for dipole in excitation.magnetics.hinged:
        deflected = DeflectedDipole(
            np.array(dipole.position_m),
            np.array(dipole.moment_am2),
            np.array(dipole.hinge_point_m),
            np.array(dipole.hinge_axis),
            *excitation.deflection(dipole),
        )
        if dipole.magnet is None or excitation.warmth is None:
            cold.append(deflected)
        else:
            warm.append(_in_this_air(excitation, dipole, DeflectedDipoles((deflected,))))
    return [DeflectedDipoles(tuple(cold)), *warm]


def _controls(excitation: Excitation) -> list[TurningDipole] | None:
    return [
        _in_this_air(
            excitation,
            dipole,
            LinkedDipole(
                np.array(dipole.position_m),
                np.array(dipole.moment_am2),
                travel=1e-3 * np.degrees(dipole.travel_mmpdeg),
                turn=dipole.turn_degpdeg,
                turn_point=np.array(dipole.turn_point_m or dipole.position_m),
                turn_axis=np.array(dipole.turn_axis or (1.0, 0.0, 0.0)),
                angle=excitation.angle(dipole),
            ),
        )
        for dipole in excitation.magnetics.controls
    ] or None


def _crew(excitation: Excitation) -> list[TurningDipole] | None:
    return [
        SeatedDipole(np.array(dipole.position_m), np.array(dipole.moment_am2), excitation.posture(dipole.name))
        for dipole in excitation.magnetics.permanent
        if dipole.seated
    ] or None


def _rotating(excitation: Excitation) -> list[TurningDipole] | None:
    found: list[TurningDipole] = []
    for dipole in excitation.magnetics.rotating:
        source = _on_shaft(excitation, dipole)
        found.append(_in_this_air(excitation, dipole, SpinningDipole(source, excitation.moment(source, dipole.rotor))))
    return found or None


def _on_shaft(excitation: Excitation, dipole: RotatingDipole) -> ShaftDipole:
    return ShaftDipole.of(dipole, excitation.magnetics.rotors[dipole.rotor])


@dataclass(frozen=True)
class TurningPart:
    """A part that is a sum over dipoles that turn.

    Attributes
    ----------
    dipoles : callable
        The dipoles of an excitation; None for an aircraft without the part.
    """

    dipoles: Callable[[Excitation], Sequence[TurningDipole] | None]

    def field(self, excitation: Excitation, response: AircraftResponse, rows: np.ndarray) -> np.ndarray | None:
        """Return the part at some places of a response, (n, s, 3) [nT]; see ``LinearPart.field``."""
        dipoles = self.dipoles(excitation)
        if dipoles is None:
            return None
        fields = [dipole.at(response.positions_m[rows]) for dipole in dipoles]
        out = np.broadcast_to(fields[0], (len(excitation.ambient_b), len(rows), 3))
        return sum(fields[1:], start=out)


LINEAR: Mapping[str, LinearPart] = {
    "permanent": LinearPart("fixed", _permanent),
    "induced": LinearPart("metal", _ambient),
    "memory": LinearPart("metal", _remembered),
    "eddy": LinearPart("modes", _eddy_states),
    "electronics": LinearPart("feeders", _currents),
    "suspension": LinearPart("hanging", _hanging),
}

TURNING: Mapping[str, TurningPart] = {
    "hinged": TurningPart(_hinged),
    "controls": TurningPart(_controls),
    "crew": TurningPart(_crew),
    "propeller": TurningPart(_rotating),
}

PARTS: Mapping[str, LinearPart | TurningPart] = {**LINEAR, **TURNING}
"""What makes each part of the platform; the names are those of ``columns.PLATFORM``."""


# ---- the aircraft as a whole -----------------------------------------------------------------------------------


def gains(response: AircraftResponse) -> np.ndarray:
    """Return the gains of all linear parts at the places of a response, (s, 3, c), kind by kind."""
    return np.concatenate([gains_of(response, kind) for kind in GAINS], axis=2)


def strengths(excitation: Excitation, response: AircraftResponse) -> np.ndarray:
    """Return the strengths of all linear parts that are on, in the order of ``gains``, (n, c).

    Each is multiplied by the scale of its part. Parts with the same gains share their strengths: the steel answers the
    sum of the ambient field and of what it remembers.
    """
    return np.hstack([_strengths_of(kind, excitation, response) for kind in GAINS])


def _strengths_of(kind: str, excitation: Excitation, response: AircraftResponse) -> np.ndarray:
    out = np.zeros((len(excitation.ambient_b), gains_of(response, kind).shape[2]))
    for name, part in LINEAR.items():
        if part.gains == kind and excitation.settings.is_on(name):
            found = part.strengths(excitation, response)
            if found is not None:
                out = out + getattr(excitation.settings, name).scale * found
    return out


def turning(excitation: Excitation) -> list[tuple[float, TurningDipole]]:
    """Return all dipoles that turn in parts that are on, each with the scale of its part."""
    settings = excitation.settings
    return [
        (getattr(settings, name).scale, dipole)
        for name, part in TURNING.items()
        if settings.is_on(name)
        for dipole in part.dipoles(excitation) or ()
    ]

"""What sets the strengths of an aircraft's sources: the ambient field, currents, deflections and rotors of a flight."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from magsim.aircraft.magnetics import ControlDipole, HingedDipole, Magnetics, Memory
from magsim.errors import RequestError
from magsim.field.load import load_g, specific_force
from magsim.field.metal import eddy
from magsim.field.situation import Situation
from magsim.field.sources.memory import remembered
from magsim.field.sources.rotors import Rotation, ShaftDipole, rotating_moment, rotor_rotation, rotor_stream
from magsim.field.sources.seats import posture
from magsim.field.stepping import derivative
from magsim.field.warmth import Warmth
from magsim.field.wiring.electronics import Clock, Onboard, onboard, training_spans
from magsim.population.days import outside_c
from magsim.population.draws import Draws
from magsim.scenario import FieldSettings
from magsim.streams import stream


class Excitation(Protocol):
    """What the strengths of sources are computed from, at ``n`` evenly spaced times."""

    @property
    def magnetics(self) -> Magnetics:
        """The aircraft file."""

    @property
    def settings(self) -> FieldSettings:
        """Which parts are on, and how."""

    @property
    def step_s(self) -> float:
        """Time between samples [s]."""

    @property
    def ambient_b(self) -> np.ndarray:
        """The background at the reference point, (n, 3) [nT] body axes."""

    @property
    def warmth(self) -> Warmth | None:
        """Temperature of magnets and metal along the flight; None where it does not change."""

    @property
    def currents_a(self) -> Mapping[str, np.ndarray]:
        """Current of each feeder, (n,) [A]; may lack feeders."""

    def eddy_states(self, modes: eddy.Modes) -> np.ndarray:
        """Return the states of the eddy-current modes, (n, k)."""

    def deflection(self, dipole: HingedDipole) -> tuple[np.ndarray, np.ndarray]:
        """Return cosine and sine of a dipole's deflection, (n,) each, or (1,) each where it does not move."""

    def angle(self, dipole: ControlDipole) -> np.ndarray:
        """Return the deflection of the surface with which a control moves, (n,) [rad], or (1,) where it rests."""

    def load_g(self, place_b: np.ndarray) -> np.ndarray:
        """Return the specific force at a place of the aircraft less that of the parked one, (n, 3) [g] body axes."""

    def posture(self, person: str) -> np.ndarray:
        """Return how far a person is from the mean posture, and turned, (n, 4) [m], [rad], or (1, 4) at rest."""

    def remembered(self, memory: Memory) -> np.ndarray:
        """Return the field that steel with a memory answers beside the ambient one, (n, 3) [nT]."""

    def moment(self, source: ShaftDipole, rotor: str) -> np.ndarray:
        """Return the moment of a source on the shaft of a rotor, (n, 3) [A m^2]."""


@dataclass(frozen=True)
class FlightExcitation:
    """The excitation of a simulated flight, at the simulation rate.

    Attributes
    ----------
    situation : Situation
        With its background.
    """

    situation: Situation

    @property
    def magnetics(self) -> Magnetics:
        """The aircraft file."""
        return self.situation.magnetics

    @property
    def settings(self) -> FieldSettings:
        """Which parts are on, and how."""
        return self.situation.scenario.field

    @property
    def step_s(self) -> float:
        """Time between samples [s]."""
        return self.situation.step_s

    @property
    def ambient_b(self) -> np.ndarray:
        """The background at the reference point, (n, 3) [nT] body axes."""
        return self.situation.ambient_b

    @cached_property
    def ambient_rate_b(self) -> np.ndarray:
        """Time derivative of the ambient field in body axes, (n, 3) [nT/s]."""
        return self.situation.passage.once("ambient rate", lambda: derivative(self.ambient_b, self.step_s))

    @cached_property
    def warmth(self) -> Warmth | None:
        """Temperature of magnets and metal along the flight; None on no day."""
        scenario, step_s = self.situation.scenario, self.step_s
        if not (scenario.day and scenario.field.temperature.enabled):
            return None
        alt_m = scenario.start.alt_m
        air_c = outside_c(Draws(scenario.aircraft, scenario.individual), scenario.day, alt_m)
        return Warmth.along(self.situation.passage.alt_m, alt_m, air_c, step_s)

    @cached_property
    def onboard(self) -> Onboard:
        """Currents and voltages of the aircraft's wiring."""
        situation = self.situation
        scenario = situation.scenario
        spans = training_spans(situation.flight.segments, scenario.recording)
        clock = Clock(situation.time_s, situation.step_s, situation.flight, scenario.seed, spans)
        return onboard(self.magnetics, self.settings.electronics, clock)

    @property
    def currents_a(self) -> Mapping[str, np.ndarray]:
        """Current of each feeder, (n,) [A]."""
        return self.onboard.currents_a

    def eddy_states(self, modes: eddy.Modes) -> np.ndarray:
        """Return the states of the eddy-current modes, stepped from sample to sample, (n, k)."""
        states = eddy.states(modes, self.ambient_rate_b, self.step_s, lag=self.settings.eddy.lag)
        if self.warmth is None:
            return states
        return eddy.warmed(modes, states, self.ambient_rate_b, self.step_s, self.warmth.resistance)

    @cached_property
    def _angles(self) -> dict[str, np.ndarray]:
        passage = self.situation.passage
        return passage.once("controls", lambda: passage.flight.controls_at(passage.time_s))

    @cached_property
    def _turns(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        def turned() -> dict[str, tuple[np.ndarray, np.ndarray]]:
            moved = {name: angle if np.ptp(angle) > 0.0 else angle[:1] for name, angle in self._angles.items()}
            return {name: (np.cos(angle), np.sin(angle)) for name, angle in moved.items()}

        return self.situation.passage.once("turned", turned)

    def deflection(self, dipole: HingedDipole) -> tuple[np.ndarray, np.ndarray]:
        """Return cosine and sine of a dipole's deflection, (n,) each, or (1,) each where it does not move.

        Raises
        ------
        RequestError
            If the flight does not log the deflection of the surface, and the surface is not held at rest.
        """
        self._check_known(dipole, "hinged")
        return self._turns.get(dipole.surface, (np.ones(1), np.zeros(1)))

    def angle(self, dipole: ControlDipole) -> np.ndarray:
        """Return the deflection of the surface with which a control moves, (n,) [rad], or (1,) where it rests.

        Raises
        ------
        RequestError
            As for ``deflection``.
        """
        self._check_known(dipole, "controls")
        return self._angles.get(dipole.surface, np.zeros(1))

    def _check_known(self, dipole: HingedDipole | ControlDipole, part: str) -> None:
        surface = dipole.surface
        if surface not in self._angles and surface not in self.settings.hinged.at_rest:
            msg = (
                f"aircraft {self.situation.scenario.aircraft}: dipole {dipole.name!r} of [[{part}]] moves with the "
                f"surface {surface!r}, which the flight does not log (logged: {', '.join(self._angles) or 'none'}); "
                f"allowed: its deflection in the track, field.hinged.at_rest = ['{surface}'], or "
                f"field.{part}.enabled = false"
            )
            raise RequestError(msg)

    def load_g(self, place_b: np.ndarray) -> np.ndarray:
        """Return the specific force at a place of the aircraft less that of the parked one, (n, 3) [g] body axes."""
        situation = self.situation
        return load_g(specific_force(situation.motion, situation.rot_nb, self.step_s, place_b))

    def posture(self, person: str) -> np.ndarray:
        """Return how far a person is from the mean posture, and turned about the vertical, (n, 4) [m], [rad]."""
        scenario, logged_s = self.situation.scenario, self.situation.flight.carrier.time_s
        random = stream(scenario.seed, f"crew/{scenario.individual}/{scenario.day}/{person}")
        return posture(random, self.situation.time_s, (float(logged_s[0]), float(logged_s[-1])))

    @cached_property
    def rotations(self) -> dict[str, Rotation]:
        """Angles of the rotors that carry sources."""
        return {name: self._rotation(name) for name in dict.fromkeys(d.rotor for d in self.magnetics.rotating)}

    def _rotation(self, name: str) -> Rotation:
        passage, rotor = self.situation.passage, self.magnetics.rotors[name]
        flight = passage.flight

        def rotation() -> Rotation:
            random = rotor_stream(passage.scenario.seed, name)
            return rotor_rotation(rotor, random, flight.carrier.time_s, flight.rotors.get(name), passage.time_s)

        return passage.once(("rotation", name, rotor.model_dump_json()), rotation)

    def remembered(self, memory: Memory) -> np.ndarray:
        """Return the field that steel with a memory answers beside the ambient one, (n, 3) [nT]."""
        settings = self.settings.memory
        return self.situation.passage.once(
            ("remembered", memory.model_dump_json(), settings.model_dump_json()),
            lambda: remembered(memory, self.ambient_b, self.step_s, settings),
        )

    def moment(self, source: ShaftDipole, rotor: str) -> np.ndarray:
        """Return the moment of a source on the shaft of a rotor, each sample its mean over the step, (n, 3) [A m^2]."""
        return rotating_moment(source, self.rotations[rotor], self.step_s, self.ambient_b)

"""What every part of the field is computed from: the flight at the simulation rate, and the aircraft's response."""

from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from magsim.aircraft import Magnetics
from magsim.earth import geodetic_from_ecef
from magsim.field.response import AircraftResponse
from magsim.frames import rot_nb_from_attitude
from magsim.scenario import Scenario
from magsim.terrain import Ground
from magsim.trajectory import Flight, Trajectory

T = TypeVar("T")


def used_mounts(scenario: Scenario, body: str = "carrier") -> tuple[str, ...]:
    """Return the mounts of all magnetic sensors that a body carries, in the order of first use."""
    sensors = (*scenario.sensors.scalar, *scenario.sensors.fluxgate)
    return tuple(dict.fromkeys(sensor.mount for sensor in sensors if sensor.body == body))


def simulation_times(flight: Flight) -> np.ndarray:
    """Return sample times in the logged span of all bodies at the simulation rate, (n,) [s]; 0 is one of them."""
    rate, logs = flight.simulation_rate_hz, [path.time_s for path in (flight.carrier, flight.bird) if path is not None]
    start, stop = max(log[0] for log in logs), min(log[-1] for log in logs)
    first, last = np.ceil(start * rate - 1e-6), np.floor(stop * rate + 1e-6)
    return np.arange(int(first), int(last) + 1) / rate


@dataclass(frozen=True)
class Passage:
    """The way of one body through the Earth's field, sampled at the simulation rate.

    It is all that the background depends on, but for the places in the body.

    Attributes
    ----------
    scenario : Scenario
    flight : Flight
        With the body as its carrier.
    ground : Ground, optional
        What ``[terrain]`` means; None without it.
    time_s : (n,) [s]
        At the simulation rate, over the whole logged span.
    """

    scenario: Scenario
    flight: Flight
    ground: Ground | None
    time_s: np.ndarray
    _known: dict[Hashable, Any] = field(default_factory=dict, init=False, repr=False, compare=False)

    def once(self, key: Hashable, compute: Callable[[], T]) -> T:
        """Return what depends on the passage and a key alone: computed once, for all aircraft that are on it."""
        if key not in self._known:
            self._known[key] = compute()
        found: T = self._known[key]
        return found

    @property
    def path(self) -> Trajectory:
        """The motion of the body at its log times."""
        return self.flight.carrier

    @cached_property
    def motion(self) -> Trajectory:
        """The motion of the body at the samples."""
        return self.path.at(self.time_s)

    @cached_property
    def alt_m(self) -> np.ndarray:
        """Height of the body above the ellipsoid at the samples, (n,) [m]."""
        return geodetic_from_ecef(self.path.motion_e_at(self.time_s)[0])[2]

    @cached_property
    def rot_nb(self) -> np.ndarray:
        """Rotations from body axes to north-east-down, (n, 3, 3)."""
        return rot_nb_from_attitude(self.motion.attitude)

    @cached_property
    def rot_be(self) -> np.ndarray:
        """Rotations from Earth-fixed to body axes, (n, 3, 3)."""
        return self.path.rot_be_at(self.time_s)


@dataclass(frozen=True)
class Situation:
    """A flight in the field, sampled at the simulation rate.

    Makers of the platform's parts return (n, s, 3) [nT] in body axes at the mounts.

    Attributes
    ----------
    scenario : Scenario
    magnetics : Magnetics
    response : AircraftResponse
    passage : Passage
    mounts : tuple of str
        The ``s`` mounts that carry a sensor.
    background : mapping of str to (n, s, 3) [nT]
        The background parts in body axes, once they are known.
    ambient_b : (n, 3) [nT]
        ``B_0``: the whole background at the reference point, body axes.
    """

    scenario: Scenario
    magnetics: Magnetics
    response: AircraftResponse
    passage: Passage
    mounts: tuple[str, ...]
    background: Mapping[str, np.ndarray]
    ambient_b: np.ndarray

    @property
    def flight(self) -> Flight:
        """The flight, with the body as its carrier."""
        return self.passage.flight

    @property
    def time_s(self) -> np.ndarray:
        """Times of the samples, (n,) [s]."""
        return self.passage.time_s

    @property
    def motion(self) -> Trajectory:
        """The motion of the body at the samples."""
        return self.passage.motion

    @property
    def rot_nb(self) -> np.ndarray:
        """Rotations from body axes to north-east-down, (n, 3, 3)."""
        return self.passage.rot_nb

    @property
    def step_s(self) -> float:
        """Time between samples [s]."""
        return 1.0 / self.flight.simulation_rate_hz

    @cached_property
    def rows(self) -> np.ndarray:
        """The mounts as rows of the response, (s,) int."""
        return self.response.rows(self.mounts)

    @cached_property
    def positions_m(self) -> np.ndarray:
        """Places of the mounts, (s, 3) [m] body axes from the datum."""
        return self.response.positions_m[self.rows]

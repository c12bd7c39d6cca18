"""What every part of the field is computed from: the flight at the simulation rate, and the aircraft's response."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from magsim.aircraft import Magnetics
from magsim.field.response import AircraftResponse
from magsim.frames import rot_nb_from_attitude
from magsim.scenario import Scenario
from magsim.terrain import Ground
from magsim.trajectory import Flight, Trajectory


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
class Situation:
    """A flight in the field, sampled at the simulation rate.

    Makers of background parts return (n, s + 1, 3) [nT] in body axes, at the ``s`` mounts and last at the carrier's
    reference point. Makers of the platform's parts return (n, s, 3) [nT] in body axes at the mounts.

    Attributes
    ----------
    scenario : Scenario
    magnetics : Magnetics
    flight : Flight
    response : AircraftResponse
    ground : Ground, optional
        What ``[terrain]`` means; None without it.
    mounts : tuple of str
        The ``s`` mounts that carry a sensor.
    time_s : (n,) [s]
        At the simulation rate, over the whole logged span.
    motion : Trajectory
        The carrier at these times.
    background : mapping of str to (n, s + 1, 3) [nT]
        The background parts, once they are known.
    """

    scenario: Scenario
    magnetics: Magnetics
    flight: Flight
    response: AircraftResponse
    ground: Ground | None
    mounts: tuple[str, ...]
    time_s: np.ndarray
    motion: Trajectory
    background: Mapping[str, np.ndarray]

    @classmethod
    def of(
        cls,
        scenario: Scenario,
        magnetics: Magnetics,
        flight: Flight,
        response: AircraftResponse,
        ground: Ground | None = None,
        *,
        mounts: tuple[str, ...] | None = None,
        time_s: np.ndarray | None = None,
    ) -> "Situation":
        """Return the situation of a flight, without background.

        By default at the mounts of the carrier's sensors and at the times of the flight.
        """
        time_s = simulation_times(flight) if time_s is None else time_s
        mounts, motion = used_mounts(scenario) if mounts is None else mounts, flight.carrier.at(time_s)
        return cls(scenario, magnetics, flight, response, ground, mounts, time_s, motion, {})

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

    @cached_property
    def arms_b(self) -> np.ndarray:
        """From the reference point to each mount and, last, to itself, (s + 1, 3) [m]."""
        return np.vstack([self.positions_m - self.motion.reference_b, np.zeros(3)])

    @cached_property
    def rot_nb(self) -> np.ndarray:
        """Rotations from body axes to north-east-down, (n, 3, 3)."""
        return rot_nb_from_attitude(self.motion.attitude)

    @cached_property
    def ambient_b(self) -> np.ndarray:
        """``B_0``: the whole background at the reference point, (n, 3) [nT] body axes."""
        out = np.zeros((len(self.time_s), 3))
        for part in self.background.values():
            out += part[:, -1]
        return out

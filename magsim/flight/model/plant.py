"""The flight model as a machine: JSBSim, its start, its state in SI units, its checks.

After the start no state of JSBSim is written: only commands, set points, wind and switches. JSBSim holds Python's
interpreter lock while it steps, so threads gain nothing; processes do.
"""

import math
import struct
from collections.abc import Callable, Sequence
from typing import Protocol

import jsbsim
import numpy as np

from magsim.aircraft.facts import Facts
from magsim.errors import DataError
from magsim.flight.model.airframe import PULLS
from magsim.flight.model.autopilot import INPUTS
from magsim.flight.model.channels import CHANNELS, COLUMN, STATE_COLUMNS, WITHOUT, CarrierState
from magsim.flight.model.envelope import TROUBLES, first_outside, limits_of
from magsim.flight.model.instance import node_of
from magsim.flight.model.setup import PlantSetup
from magsim.flight.model.start import start
from magsim.flight.model.turbulence import TurbulenceFeed
from magsim.units import FT, LB, LBF

ROWS_AT_ONCE = 60_000
"""The log begins with room for so many rows, and gets as many more when it is full."""

READ = jsbsim.FGPropertyNode.get_double_value
"""Reads a property; over nodes by ``map`` it takes two thirds of the time of their bound methods in a list."""

ROW = struct.Struct(f"{len(CHANNELS)}d")
"""A row in memory."""


class HookLoad(Protocol):
    """A load on the hook that is stepped with the flight model."""

    def begin(self, state: CarrierState) -> None:
        """Start below a carrier that flies straight and level."""
        ...

    def step(self, state: CarrierState) -> tuple[float, float, float]:
        """Step to the carrier's new state; return the pull on the hook, north, east, down [N]."""
        ...


class Plant:
    """An aircraft in flight.

    Parameters
    ----------
    facts : Facts
    setup : PlantSetup
    coupled : HookLoad, optional
        Load on the hook of the setup.

    Attributes
    ----------
    rows : (n, c)
        Room for the log: a column for each of ``CHANNELS``, as JSBSim gives it; times ``TO_SI`` it is SI.
    last : int
        Number of the last logged row; row 0 is the start.
    time_s : float
        Time since the start.
    limits : tuple of arrays
        What rows are checked against, from ``limits_of``.
    ground_m : float
        Height of the ground below the aircraft.
    """

    def __init__(self, facts: Facts, setup: PlantSetup, coupled: HookLoad | None = None) -> None:
        self._fdm = start(facts, setup)
        self._run = self._fdm.run
        self._step_s = 1.0 / setup.step_hz
        self._steps, self.time_s = 0, 0.0
        manager = self._fdm.get_property_manager()
        self._nodes = [_logged(manager, name) for _, name, _ in CHANNELS]
        self._writers = {name: node_of(manager, name).set_double_value for name in (*INPUTS, *setup.weather.inputs)}
        self.limits = limits_of(facts)
        self._set_ground = node_of(manager, "position/terrain-elevation-asl-ft").set_double_value
        self._fuel = node_of(manager, "propulsion/total-fuel-lbs").get_double_value
        self.ground_m = setup.ground_m
        self._clock_s = self._fdm["simulation/sim-time-sec"]
        self.rows = np.zeros((ROWS_AT_ONCE, len(CHANNELS)))
        self._bytes = self.rows.data.cast("B")
        self.rows[0] = [*map(READ, self._nodes)]
        self.last = 0
        strength = setup.weather.turbulence
        self._turbulence = None if strength is None else TurbulenceFeed(self._fdm, facts, setup, strength)
        self._coupled = coupled
        if coupled is not None:
            self._pulls = [
                node_of(manager, f"external_reactions/{name}/magnitude").set_double_value for name, _ in PULLS
            ]
            coupled.begin(self._state())

    @property
    def clock_s(self) -> float:
        """The same moment on JSBSim's clock [s]."""
        return self._clock_s + self.time_s

    @property
    def row(self) -> list[float]:
        """The last logged row."""
        return self.rows[self.last].tolist()

    def run(self, steps: int, rows: int = 1) -> np.ndarray:
        """Fly some times a number of steps, log a row after each time, and check them; return the last one, (c,).

        Raises
        ------
        DataError
            If the flight has diverged, touched the ground or left the flight model's envelope.
        """
        first = self.last + 1
        self.advance(steps, rows)
        bad, trouble = first_outside(self.rows, first, self.last, *self.limits, self.ground_m)
        if trouble:
            raise self.trouble(bad, trouble, steps)
        return self.rows[self.last]

    def advance(self, steps: int, rows: int) -> None:
        """Fly as ``run`` does, without the checks."""
        if self.last + rows >= len(self.rows):
            self.rows = np.concatenate([self.rows, np.zeros_like(self.rows)])
            self._bytes = self.rows.data.cast("B")
        run, nodes, pack, table = self._run, self._nodes, ROW.pack_into, self._bytes
        alone = self._coupled is None and self._turbulence is None
        for number in range(self.last + 1, self.last + 1 + rows):
            if alone:
                for _ in range(steps):
                    run()
            else:
                for _ in range(steps):
                    self._step()
            pack(table, number * ROW.size, *map(READ, nodes))
        self.last += rows
        self._steps += steps * rows
        self.time_s = self._steps * self._step_s

    def trouble(self, row: int, code: int, steps: int) -> "FlightTroubleError":
        """Go back to a row that is outside of the limits, so many steps after the one before; return what is wrong."""
        self._steps -= steps * (self.last - row)
        self.last, self.time_s = row, self._steps * self._step_s
        return FlightTroubleError(TROUBLES[code], self.row, self.time_s)

    def _step(self) -> None:
        """Fly a step through turbulence, or with a load on the hook."""
        if self._turbulence is not None:
            self._turbulence.step()
        self._run()
        if self._coupled is not None:
            self._pull(self._coupled.step(self._state()))

    def delay_turbulence(self, time_s: float) -> None:
        """Let the turbulence come later by a time than it would after the plant's start, as soon as it can."""
        if self._turbulence is not None:
            self._turbulence.late(time_s)

    def _state(self) -> CarrierState:
        """Return the state that a towed body needs."""
        return CarrierState(*[READ(self._nodes[index]) * factor for index, factor in STATE_COLUMNS])

    def _pull(self, force_n: tuple[float, float, float]) -> None:
        """Set the pull on the hook in the next step."""
        if not math.isfinite(sum(force_n)):
            row = [*map(READ, self._nodes)]
            trouble = "lost the motion of its bird (allowed: a larger flight.step_hz, fewer links, a heavier rope)"
            raise FlightTroubleError(trouble, row, self.time_s)
        for write, force in zip(self._pulls, force_n, strict=True):
            write(force / LBF)

    def ground(self, height_m: float) -> None:
        """Set the height of the ground below the aircraft, above the ellipsoid."""
        self.ground_m = height_m
        self._set_ground(height_m / FT)

    def value(self, name: str) -> float:
        """Return a quantity of the last row, in SI units."""
        return float(self.rows[self.last, COLUMN[name]]) * CHANNELS[COLUMN[name]][2]

    @property
    def fuel_kg(self) -> float:
        """Fuel in the tanks."""
        return self._fuel() * LB

    def command(self, name: str, value: float) -> None:
        """Write a command or set point of the autopilot."""
        self._writers[name](value)

    def writers(self, names: Sequence[str]) -> list[Callable[[float], object]]:
        """Return what writes each of some commands or set points."""
        return [self._writers[name] for name in names]


class FlightTroubleError(DataError):
    """A flight that went wrong, with the time on the plant's clock, so that the caller can name its own time."""

    def __init__(self, trouble: str, row: list[float], time_s: float) -> None:
        self.trouble, self.row, self.time_s = trouble, row, time_s
        super().__init__(self.message(time_s))

    def message(self, time_s: float) -> str:
        """Return one line that names time and state."""
        value = {name: self.row[i] * CHANNELS[i][2] for name, i in COLUMN.items()}
        return (
            f"the flight {self.trouble} at t = {time_s:.1f} s: height {value['alt']:.0f} m, airspeed "
            f"{value['airspeed']:.1f} m/s, roll {math.degrees(value['roll']):.1f}, pitch "
            f"{math.degrees(value['pitch']):.1f}, angle of attack {math.degrees(value['alpha']):.1f}, sideslip "
            f"{math.degrees(value['beta']):.1f} deg"
        )


def _logged(manager: jsbsim.FGPropertyManager, name: str) -> jsbsim.FGPropertyNode:
    """Return the property of a channel; one that a model need not have is made, and reads 0."""
    if name in WITHOUT:
        manager.get_node(name, True)
    return node_of(manager, name)

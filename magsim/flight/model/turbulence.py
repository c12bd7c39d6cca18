"""Turbulence of a flight: gusts at nodes in time, fed to JSBSim at every step, straight between the nodes.

White noise is drawn for nodes of fixed distance in time, so a flight meets the same gusts at every step rate, and on
every course: along and across are directions of the flight through the steady wind.
"""

import math
from collections.abc import Callable
from itertools import count

import jsbsim
import numpy as np

from magsim.aircraft.facts import Facts
from magsim.flight.model.dryden import DrydenFilters, Strength
from magsim.flight.model.instance import node_of
from magsim.flight.model.setup import PlantSetup
from magsim.flight.model.weather import TURBULENCE_INPUTS
from magsim.streams import stream
from magsim.units import FT

NODE_HZ = 30
"""Nodes a second: 2.5 m apart at 75 m/s, a sixth of the Cessna's span; 0.8 m at a drone's 25 m/s."""

RISE_S = 5.0
"""Gusts rise from still air within this time from a plant's start; no warm-up is shorter."""

STEPS_AHEAD = 2
"""JSBSim's systems act a step late, and a step begins with what was written before it."""

CATCH_UP = 0.25
"""The clock of the gusts runs faster or slower by no more than this part, to meet the first row."""

SLOWEST_MPS = 1.0
"""Below this airspeed gusts pass by as at it."""

BLOCK = 1024
"""Nodes whose noise is drawn at once; the numbers are the same for any."""

_READ = (
    "position/h-agl-ft",
    "velocities/vt-fps",
    "velocities/v-north-fps",
    "velocities/v-east-fps",
    "position/long-gc-rad",
)


class TurbulenceFeed:
    """Writes the turbulence into an instance of JSBSim before each of its steps.

    Parameters
    ----------
    fdm : jsbsim.FGFDMExec
        Begun, at rest in time.
    facts : Facts
    setup : PlantSetup
    strength : Strength
    """

    def __init__(self, fdm: jsbsim.FGFDMExec, facts: Facts, setup: PlantSetup, strength: Strength) -> None:
        manager = fdm.get_property_manager()
        self._strength, self._setup = strength, setup
        self._readers = [node_of(manager, name).get_double_value for name in _READ]
        self._wind = _steady_wind(manager, setup)
        self._writers = [node_of(manager, name).set_double_value for name in TURBULENCE_INPUTS]
        self._rng = stream(setup.weather.seed, "turbulence")
        self._filters = DrydenFilters(facts.geometry.span.value, self._rng.standard_normal(6))
        self._noise: list[np.ndarray] = []
        self._step_s = 1.0 / setup.step_hz
        self._steps = STEPS_AHEAD
        self._late_s = self._target_s = 0.0
        self._numbers = count(1)
        self._index = 0
        self._ahead = (0.0,) * len(self._writers)
        self._lines = self._to_next_node()

    def late(self, time_s: float) -> None:
        """Let the clock of the gusts lag behind the plant's by a time, as soon as it can."""
        self._target_s = time_s

    def step(self) -> None:
        """Write the gusts of the coming step."""
        if self._late_s != self._target_s:
            most = CATCH_UP * self._step_s
            self._late_s += min(max(self._target_s - self._late_s, -most), most)
        place = (self._steps * self._step_s - self._late_s) * NODE_HZ - self._index
        self._steps += 1
        while place >= 1.0:
            place -= 1.0
            self._index += 1
            self._lines = self._to_next_node()
        for write, here, rise in self._lines:
            write(here + place * rise)

    def _to_next_node(self) -> list[tuple[Callable[[float], object], float, float]]:
        """Return what writes each input, its value at the node that is reached, and its rise to the next one."""
        here, self._ahead = self._ahead, self._node()
        return [(w, a, b - a) for w, a, b in zip(self._writers, here, self._ahead, strict=True)]

    def _node(self) -> tuple[float, ...]:
        """Return the values of ``TURBULENCE_INPUTS`` at the next node."""
        height, speed, north, east, lon = [read() for read in self._readers]
        if not self._noise:
            self._noise = [*self._rng.standard_normal((BLOCK, 6))[::-1]]
        way = max(speed * FT, SLOWEST_MPS) / NODE_HZ
        gusts = self._filters.advance(self._strength.at(height * FT), way, self._noise.pop())
        sin, cos = self._course(north, east, lon)
        rise = 0.5 - 0.5 * math.cos(math.pi * min(1.0, next(self._numbers) / (NODE_HZ * RISE_S)))
        moved, turned = rise / FT, rise
        return (
            moved * (gusts.along * cos - gusts.across * sin),
            moved * (gusts.along * sin + gusts.across * cos),
            moved * gusts.down,
            turned * gusts.roll,
            turned * gusts.pitch,
            turned * gusts.yaw,
        )

    def _course(self, north: float, east: float, lon: float) -> tuple[float, float]:
        """Return sine and cosine of the course through the steady wind, near the poles in the grid.

        Parameters
        ----------
        north, east : float [ft/s]
            Motion over ground.
        lon : float [rad]
        """
        grid = self._setup.grid
        if grid:
            turned = grid * (lon - self._setup.grid_lon)
            sin, cos = math.sin(turned), math.cos(turned)
            north, east = north * cos - east * sin, north * sin + east * cos
        wind_north, wind_east = self._wind()
        north, east = north - wind_north, east - wind_east
        speed = math.hypot(north, east)
        return (east / speed, north / speed) if speed else (0.0, 1.0)


def _steady_wind(manager: jsbsim.FGPropertyManager, setup: PlantSetup) -> Callable[[], tuple[float, float]]:
    """Return what reads the wind without gusts to north and east [ft/s], near the poles in the grid."""
    if setup.grid and setup.weather.shear is None:
        north, east = setup.wind_mps
        return lambda: (north / FT, east / FT)
    place = "air/grid" if setup.grid else "atmosphere"
    names = (f"{place}/wind-{axis}-fps" for axis in ("north", "east"))
    read_north, read_east = (node_of(manager, name).get_double_value for name in names)
    return lambda: (read_north(), read_east())

"""The flight model as a machine: JSBSim, its start, its state in SI units, its checks.

After the start no state of JSBSim is written: only commands, set points, wind and switches. JSBSim holds Python's
interpreter lock while it steps, so threads gain nothing; processes do.
"""

import math
from collections.abc import Callable
from typing import Protocol

import jsbsim

from magsim.aircraft.facts import Facts
from magsim.errors import DataError
from magsim.flight.model.airframe import PULLS
from magsim.flight.model.autopilot import INPUTS
from magsim.flight.model.channels import CHANNELS, COLUMN, MOTION_COLUMNS, STATE_COLUMNS, WITHOUT, CarrierState
from magsim.flight.model.instance import node_of
from magsim.flight.model.setup import PlantSetup
from magsim.flight.model.start import start
from magsim.flight.model.turbulence import TurbulenceFeed
from magsim.units import FT, LB, LBF


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
    row : list of float
        The last logged row in the order of ``CHANNELS``, as JSBSim gives it; times ``TO_SI`` it is SI.
    time_s : float
        Time since the plant's start.
    """

    def __init__(self, facts: Facts, setup: PlantSetup, coupled: HookLoad | None = None) -> None:
        self._fdm = start(facts, setup)
        self._run = self._fdm.run
        self._step_s = 1.0 / setup.step_hz
        self._steps = 0
        manager = self._fdm.get_property_manager()
        self._readers = [_reader(manager, name) for _, name, _ in CHANNELS]
        self._writers = {name: node_of(manager, name).set_double_value for name in (*INPUTS, *setup.weather.inputs)}
        self._outside = _envelope(facts)
        self._set_ground = node_of(manager, "position/terrain-elevation-asl-ft").set_double_value
        self._floor_ft = setup.ground_m / FT
        self._clock_s = self._fdm["simulation/sim-time-sec"]
        self.row: list[float] = [read() for read in self._readers]
        strength = setup.weather.turbulence
        self._turbulence = None if strength is None else TurbulenceFeed(self._fdm, facts, setup, strength)
        self._coupled = coupled
        if coupled is not None:
            self._pulls = [
                node_of(manager, f"external_reactions/{name}/magnitude").set_double_value for name, _ in PULLS
            ]
            coupled.begin(self._state())

    @property
    def time_s(self) -> float:
        """Time since the start [s]."""
        return self._steps * self._step_s

    @property
    def clock_s(self) -> float:
        """The same moment on JSBSim's clock [s]."""
        return self._clock_s + self.time_s

    def run(self, steps: int) -> list[float]:
        """Fly a number of steps and log a row; returns ``row``.

        Raises
        ------
        DataError
            If the flight has diverged, touched the ground or left the flight model's envelope.
        """
        run = self._run
        if self._coupled is None and self._turbulence is None:
            for _ in range(steps):
                run()
        else:
            for _ in range(steps):
                self._step()
        self._steps += steps
        self.row = row = [read() for read in self._readers]
        trouble = self._outside(row, self._floor_ft)
        if trouble:
            raise FlightTroubleError(trouble, row, self.time_s)
        return row

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
        return CarrierState(*[self._readers[index]() * factor for index, factor in STATE_COLUMNS])

    def _pull(self, force_n: tuple[float, float, float]) -> None:
        """Set the pull on the hook in the next step."""
        if not math.isfinite(sum(force_n)):
            self.row = [read() for read in self._readers]
            trouble = "lost the motion of its bird (allowed: a larger flight.step_hz, fewer links, a heavier rope)"
            raise FlightTroubleError(trouble, self.row, self.time_s)
        for write, force in zip(self._pulls, force_n, strict=True):
            write(force / LBF)

    def ground(self, height_m: float) -> None:
        """Set the height of the ground below the aircraft, above the ellipsoid."""
        self._floor_ft = height_m / FT
        self._set_ground(self._floor_ft)

    def value(self, name: str) -> float:
        """Return a quantity of the last row, in SI units."""
        index = COLUMN[name]
        return self.row[index] * CHANNELS[index][2]

    def motion(self) -> tuple[float, ...]:
        """Return the quantities of ``MOTION`` of the last row, in SI units."""
        row = self.row
        return tuple([row[index] * factor for index, factor in MOTION_COLUMNS])

    @property
    def fuel_kg(self) -> float:
        """Fuel in the tanks."""
        return float(self._fdm["propulsion/total-fuel-lbs"]) * LB

    def command(self, name: str, value: float) -> None:
        """Write a command or set point of the autopilot."""
        self._writers[name](value)


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


def _reader(manager: jsbsim.FGPropertyManager, name: str) -> Callable[[], float]:
    if name in WITHOUT and manager.get_node(name) is None:
        return float
    return node_of(manager, name).get_double_value


def _envelope(facts: Facts) -> Callable[[list[float], float], str]:
    """Return the check of a row over a ground of some height [ft]: it describes what is wrong, or is empty."""
    limits = facts.limits
    alpha_low, alpha_high = (math.radians(v) for v in limits.angle_of_attack.value)
    beta, bank, pitch = (math.radians(v.value) for v in (limits.sideslip, limits.bank, limits.pitch))
    i_alpha, i_beta, i_roll, i_pitch = (COLUMN[n] for n in ("alpha", "beta", "roll", "pitch"))
    i_alt, i_contact = COLUMN["alt"], COLUMN["contact"]

    def outside(row: list[float], floor: float) -> str:
        # Comparisons are written so that a NaN fails them.
        if not math.isfinite(sum(row)):
            return "diverged (not a number)"
        if not (row[i_alt] > floor and row[i_contact] == 0.0):
            return "touched the ground"
        if not alpha_low < row[i_alpha] < alpha_high:
            return "stalled"
        if not (abs(row[i_beta]) < beta and abs(row[i_roll]) < bank and abs(row[i_pitch]) < pitch):
            return "diverged"
        return ""

    return outside

"""One run of a plant along a path: guidance ten times a second, scheduled maneuvers, a log of every row."""

import math
from array import array
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import accumulate

import numpy as np

from magsim.aircraft.facts import Facts
from magsim.earth.atmosphere import standard_density
from magsim.earth.wgs84 import ecef_from_geodetic, geodetic_from_ecef, rot_ne_at
from magsim.flight.model.aero import bank_below_stall
from magsim.flight.model.autopilot import RAMP_START, rate_of
from magsim.flight.model.channels import CHANNELS, TO_SI
from magsim.flight.model.plant import FlightTroubleError, HookLoad, Plant
from magsim.flight.model.setup import PlantSetup
from magsim.flight.model.turbulence import NODE_HZ
from magsim.flight.path.elements import Element
from magsim.flight.path.heights import HeightPlan
from magsim.flight.path.plane import LocalPlane
from magsim.flight.path.wind import ground_speed
from magsim.flight.pilot.flaps import FlapSchedule
from magsim.flight.pilot.guidance import TICK_HZ, Crossing, Guidance, GuidanceInput, SetPoints, wrap
from magsim.flight.pilot.gusts import GustSchedule
from magsim.flight.pilot.log import Log
from magsim.flight.pilot.monitor import FlightMonitor
from magsim.flight.pilot.response import LoopResponse
from magsim.flight.pilot.swings import SwingCommands
from magsim.flight.pilot.trains import SineTrain, trains_of_leg
from magsim.scenario import FlapMove, LegPattern
from magsim.terrain import Ground
from magsim.units import FT

CLIMB_LEAD_S = 0.8
"""The pitch loops take about so long to take up a planned climb."""


LIFT_PART = 0.9
"""Corrections of the course take no more bank than this part of the largest lift holds up."""


ENTRY_S = 10.0
"""So long before the path is entered the time of the first row is predicted."""


AHEAD_TICKS = 10
"""The ground is looked up for so many ticks at once, along the straight line ahead."""


class Pilot:
    """Flies a plant along a path.

    Parameters
    ----------
    facts : Facts
    setup : PlantSetup
    plane : LocalPlane
        In which the path lies.
    path : sequence of Element
    along_m : float
        Where on the path's first element the plant begins, negative before it.
    log_hz : int
    response : sequence of LoopResponse
        Response of the loops in each part; the swings are commanded by its inverse.
    parts : sequence of LegPattern
        Whose maneuvers are flown on the legs, by the part that an element belongs to.
    trains : sequence of SineTrain
        Trains at given times of the plant, for calibration.
    ground : Ground, optional
        Below the path; without it, or where it is level, it stays as the plant began.
    monitor : FlightMonitor, optional
        Ends the flight when controls saturate or a leg is missed.
    heights : HeightPlan, optional
        Along the path; without it the plant's first height is held.
    flaps : sequence of FlapMove
        Settings of the flap lever.
    coupled : HookLoad, optional
        Load on the hook of the setup.
    seed : int
        Of the scatter of cycles.

    Attributes
    ----------
    log_hz : int
    planned : list of (float, float)
        Time of each tick [s] and planned height there [m]; empty without a plan.
    """

    def __init__(
        self,
        facts: Facts,
        setup: PlantSetup,
        *,
        plane: LocalPlane,
        path: Sequence[Element],
        along_m: float,
        log_hz: int,
        response: Sequence[LoopResponse],
        parts: Sequence[LegPattern] = (),
        trains: Sequence[SineTrain] = (),
        ground: Ground | None = None,
        monitor: FlightMonitor | None = None,
        heights: HeightPlan | None = None,
        flaps: Sequence[FlapMove] = (),
        coupled: HookLoad | None = None,
        seed: int = 0,
    ) -> None:
        self._ground = None if ground is None or ground.level else ground
        self._below: list[float] = []
        self._heights = heights
        self._before_m = [0.0, *accumulate(element.length_m for element in path)]
        self.planned: list[tuple[float, float]] = []
        self.plant = Plant(facts, setup, coupled)
        highest_m = setup.alt_m if heights is None else float(heights.height_m.max())
        most_bank = bank_below_stall(facts, setup.speed_mps, float(standard_density(highest_m)), LIFT_PART)
        gusty = setup.weather.turbulence is not None
        self.guidance = Guidance(path, facts, along_m, most_bank, gusty=gusty)
        self.trains: list[SineTrain] = list(trains)
        self._swings = SwingCommands()
        self._swings.add(trains, response[0])
        self._flying: list[SineTrain] = []
        self.path: Sequence[Element] = path
        self._plane, self._parts, self._setup = plane, tuple(parts), setup
        self._responses = tuple(response)
        self.log_hz = log_hz
        self._steps_per_row = setup.step_hz // log_hz
        self._rows = array("d", self.plant.row)
        self._seen, self._seed = 0, seed
        self._targets: dict[str, float] = {}
        self._moving: set[str] = set()
        self._monitor, self._gusts = monitor, GustSchedule(setup.weather)
        self.flaps = FlapSchedule(flaps)
        self._turned = self._convergence()
        self._planned_s = -along_m / max(1.0, ground_speed(setup.speed_mps, setup.course, setup.local_wind_mps))

    def fly(self, done: Callable[["Pilot"], bool], tick: Callable[["Pilot"], None] | None = None) -> Log:
        """Fly until ``done`` returns true; ``tick`` is called after every tick of the guidance."""
        rows_per_tick = self.log_hz // TICK_HZ
        run, steps, rows = self.plant.run, self._steps_per_row, self._rows
        self._guide()
        while not done(self):
            for _ in range(rows_per_tick):
                rows.extend(run(steps))
            self._guide()
            if tick is not None:
                tick(self)
        table = np.frombuffer(rows, dtype=float).reshape(-1, len(CHANNELS)) * TO_SI
        return Log(np.arange(len(table)) / self.log_hz, table)

    def _guide(self) -> None:
        time, guidance = self.plant.time_s, self.guidance
        lat, lon, v_north, v_east, v_down, heading, airspeed = self.plant.motion()
        if self._ground is not None:
            if not self._below:
                self._below = self._look_ahead(self._ground)
            self.plant.ground(self._below.pop())
        place = self._plane.motion(lat, lon, v_north, v_east)
        if self._flying:
            self._flying = [train for train in self._flying if not train.over(time)]
        self._flying += self._swings.begun(time)
        # Headings of the path and of the guidance are those of the plane: the meridians converge towards the poles.
        turned = math.atan2(place[3], place[2]) - math.atan2(v_east, v_north)
        motion = GuidanceInput(*place, heading + turned, airspeed, v_down)
        # The autopilot counts from local north, or grid north near the poles.
        turned = wrap(turned - self._setup.grid * lon)
        turning, self._turned = wrap(turned - self._turned), turned
        order = guidance.step(time, motion, self._flying)
        if self._monitor is not None:
            self._monitor_flight(self._monitor)
        self._plan_legs(guidance.crossings)
        if not guidance.crossings:
            self._expect_first_row(time, math.hypot(motion.v_north, motion.v_east))
        for name, setting in self._gusts.due(time + 1.5 / TICK_HZ):
            self.plant.command(name, setting)
        flaps = self.flaps.setting(time)
        if flaps is not None:
            self.plant.command("ap/flap-rad", flaps)
        self.plant.command(RAMP_START, self.plant.clock_s)
        for name, value in self._swings.commands(time):
            self.plant.command(name, value)
        # North turns too until the next tick.
        self._command(order, order.heading - turned - turning)
        if self._heights is not None:
            self._climb(self._heights, time, math.hypot(motion.v_north, motion.v_east))

    def _climb(self, heights: HeightPlan, time_s: float, speed: float) -> None:
        """Command the planned height of the next tick, and the planned climb one delay of the loops ahead of it."""
        along = self._before_m[self.guidance.index] + self.guidance.along_m
        self.planned.append((time_s, heights.at(along)))
        along += speed / TICK_HZ
        self._move("ap/height-ft", heights.at(along) / FT)
        self._move("ap/climb-fps", heights.slope(along + CLIMB_LEAD_S * speed) * speed / FT)

    def _look_ahead(self, ground: Ground) -> list[float]:
        """Return the height of the ground [m] at the middle of each of the next ticks, the last one first."""
        value = self.plant.value
        after_s = (np.arange(AHEAD_TICKS)[::-1] + 0.5) / TICK_HZ
        here_e = ecef_from_geodetic(value("lat"), value("lon"), value("alt"))
        north_e, east_e = rot_ne_at(value("lat"), value("lon"))[:2]
        velocity_e = value("v_north") * north_e + value("v_east") * east_e
        lat, lon, _ = geodetic_from_ecef(here_e + after_s[:, None] * velocity_e)
        return ground.height(lat, lon).tolist()

    def _convergence(self) -> float:
        """Return the angle [rad] to add to the autopilot's headings to get those of the plane."""
        value = self.plant.value
        north, east = self._plane.motion(value("lat"), value("lon"), value("v_north"), value("v_east"))[2:]
        turned = math.atan2(east, north) - math.atan2(value("v_east"), value("v_north"))
        return wrap(turned - self._setup.grid * value("lon"))

    def _monitor_flight(self, monitor: FlightMonitor) -> None:
        """End a flight that has gone wrong."""
        plant, guidance = self.plant, self.guidance
        trouble = monitor.controls(plant.row)
        if not trouble and guidance.crossings:
            trouble = monitor.line(self.path[guidance.index], guidance.off_m)
        if trouble:
            raise FlightTroubleError(trouble, plant.row, plant.time_s)

    def _command(self, order: SetPoints, heading: float) -> None:
        """Move the set points to those of the next tick, and the heading in the autopilot's reference."""
        before = self._targets.get("ap/heading-rad", heading)
        self._move("ap/heading-rad", before + wrap(heading - before))
        self._targets["ap/heading-rad"] = heading % (2.0 * math.pi)
        self._move("ap/bank-rad", order.bank)
        self._move("ap/hold-heading", order.hold_heading)
        self._move("ap/hold-yaw", order.hold_yaw)
        self._move("ap/hold-height", order.hold_height)

    def _move(self, name: str, target: float) -> None:
        """Move a set point from its last target to a new one within the next tick; nothing is written at rest."""
        before = self._targets.get(name, target)
        if target == before and name in self._targets and name not in self._moving:
            return
        command = self.plant.command
        command(name, before)
        command(rate_of(name), (target - before) * TICK_HZ)
        (self._moving.discard if target == before else self._moving.add)(name)
        self._targets[name] = target

    def _plan_legs(self, crossings: Sequence[Crossing]) -> None:
        """Plan the trains of a leg when it has been entered."""
        while self._seen < len(crossings):
            crossing = crossings[self._seen]
            if self._seen == 0:
                # Gusts count from the first row, on JSBSim's clock.
                zero_s = first_row_s(crossing.time_s, self.log_hz)
                self._gusts.begin(zero_s, self.plant.clock_s - self.plant.time_s)
                self.flaps.begin(zero_s)
                self._delay_turbulence(zero_s)
            self._seen += 1
            element = self.path[crossing.element]
            if not element.turn:
                self.flaps.entered(element.circuit, element.leg, crossing.time_s)
            if not self._parts or element.turn:
                continue
            planned = _trains_on(element, self._parts, self._setup, crossing.time_s, self._seed)
            self.trains += planned
            self._swings.add(planned, self._responses[element.label.part])

    def _expect_first_row(self, time_s: float, speed: float) -> None:
        """Shortly before the path is entered, let the turbulence be as far as it shall be at the first row."""
        left_s = -self.guidance.along_m / max(1.0, speed)
        if left_s < ENTRY_S:
            self._delay_turbulence(first_row_s(time_s + left_s, self.log_hz))

    def _delay_turbulence(self, zero_s: float) -> None:
        """Let the first row be where it was planned on the turbulence's clock: whole nodes from its beginning."""
        self.plant.delay_turbulence(zero_s - round(self._planned_s * NODE_HZ) / NODE_HZ)


def _trains_on(
    element: Element, parts: Sequence[LegPattern], setup: PlantSetup, start_s: float, seed: int
) -> list[SineTrain]:
    """Return the trains of a leg that is entered at a time."""
    speed = ground_speed(setup.speed_mps, math.radians(element.heading_deg), setup.wind_mps)
    leg_s = element.length_m / max(1.0, speed)
    return trains_of_leg(parts[element.label.part], element.label, start_s, leg_s, seed)


def planned_trains(
    path: Sequence[Element], parts: Sequence[LegPattern], setup: PlantSetup, seed: int
) -> list[SineTrain]:
    """Return all trains of a flight along a path, each counted from the beginning of its leg."""
    return [train for leg in path if not leg.turn for train in _trains_on(leg, parts, setup, 0.0, seed)]


def first_row_s(crossed_s: float, log_hz: int) -> float:
    """Return the time of the first recorded row: the row of the log nearest to the entry of the path."""
    return round(crossed_s * log_hz) / log_hz


def on_clock(train: SineTrain, zero_s: float) -> SineTrain:
    """Return the same train with its start counted from another zero."""
    return replace(train, start_s=train.start_s - zero_s)

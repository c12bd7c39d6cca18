"""One run of a plant along a path: guidance ten times a second, scheduled maneuvers, a log of every row."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import accumulate

import numpy as np

from magsim.aircraft.facts import Facts
from magsim.earth.atmosphere import standard_density
from magsim.earth.wgs84 import ecef_from_geodetic, geodetic_from_ecef, rot_ne_at
from magsim.flight.model.aero import bank_below_stall
from magsim.flight.model.autopilot import RAMPED
from magsim.flight.model.channels import TO_SI
from magsim.flight.model.envelope import TROUBLES
from magsim.flight.model.plant import FlightTroubleError, HookLoad, Plant
from magsim.flight.model.setup import PlantSetup
from magsim.flight.model.turbulence import NODE_HZ
from magsim.flight.path.elements import Element
from magsim.flight.path.heights import HeightPlan
from magsim.flight.path.plane import LocalPlane
from magsim.flight.path.wind import ground_speed
from magsim.flight.pilot import ticks
from magsim.flight.pilot.cycles import table_of
from magsim.flight.pilot.flaps import FlapSchedule
from magsim.flight.pilot.guidance import Crossing, Guidance
from magsim.flight.pilot.gusts import GustSchedule
from magsim.flight.pilot.log import Log
from magsim.flight.pilot.monitor import WATCHED, FlightMonitor
from magsim.flight.pilot.response import LoopResponse
from magsim.flight.pilot.steering import TICK_HZ, wrap
from magsim.flight.pilot.swings import TICK_S, SwingCommands
from magsim.flight.pilot.ticks import ORDERS
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


GUST_LEAD_S = 1.5 / TICK_HZ
"""A gust is passed on so long before it begins: on the last tick before it, or the one before that."""


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
    finished_s : float or None
        When the end of the path was passed; None before.
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
        self.finished_s: float | None = None
        self.trains: list[SineTrain] = list(trains)
        self._swings = SwingCommands()
        self._swings.add(trains, response[0])
        self._flying: list[SineTrain] = []
        self._flown, self._over_s = table_of([]), math.inf
        self.path: Sequence[Element] = path
        self._plane, self._parts, self._setup = plane, tuple(parts), setup
        self._responses = tuple(response)
        self.log_hz = log_hz
        self._steps_per_row = setup.step_hz // log_hz
        self._seen, self._seed = 0, seed
        self._targets = np.zeros((len(RAMPED), 2))
        self._which, self._values = np.zeros(len(ORDERS), dtype=int), np.zeros(len(ORDERS))
        self._writers, self._checked = self.plant.writers(ORDERS), self.plant.last
        self._watched = np.zeros(0, WATCHED) if monitor is None else monitor.watched
        self._monitor, self._gusts = monitor, GustSchedule(setup.weather)
        self.flaps = FlapSchedule(flaps)
        memory = self.guidance.memory
        memory["grid"], memory["turned"] = setup.grid, self._convergence()
        memory["tolerance_m"] = math.inf if monitor is None else monitor.tolerance_m
        self._planned_s = -along_m / max(1.0, ground_speed(setup.speed_mps, setup.course, setup.local_wind_mps))

    def fly(self, done: Callable[["Pilot"], bool], tick: Callable[["Pilot"], None] | None = None) -> Log:
        """Fly until ``done`` returns true; ``tick`` is called after every tick of the guidance."""
        rows_per_tick = self.log_hz // TICK_HZ
        plant, steps = self.plant, self._steps_per_row
        self._guide()
        while not done(self):
            plant.advance(steps, rows_per_tick)
            self._guide()
            if tick is not None:
                tick(self)
        table = plant.rows[: plant.last + 1] * TO_SI
        return Log(np.arange(len(table)) / self.log_hz, table)

    def _guide(self) -> None:
        plant, guidance, swings = self.plant, self.guidance, self._swings
        time, last = plant.time_s, plant.last
        if swings.next_s < time + TICK_S or time >= self._over_s:
            self._choose_trains(time)
        told, detail, count, index, along_m, speed = ticks.tick(
            guidance.memory,
            guidance.elements,
            guidance.points,
            guidance.crossed_s,
            self._plane.table,
            *self._flown,
            *swings.table,
            swings.last,
            self._targets,
            self._watched,
            *plant.limits,
            plant.rows,
            self._checked + 1,
            last,
            plant.ground_m,
            time,
            plant.clock_s,
            self._which,
            self._values,
        )
        self._checked = last
        if told:
            self._note(told, detail, speed)
        if self._ground is not None:
            if not self._below:
                self._below = self._look_ahead(self._ground)
            plant.ground(self._below.pop())
        if self._gusts.next_s <= time + GUST_LEAD_S:
            for name, value in self._gusts.due(time + GUST_LEAD_S):
                plant.command(name, value)
        if self.flaps.next_s <= time:
            setting = self.flaps.setting(time)
            if setting is not None:
                plant.command("ap/flap-rad", setting)
        if self._heights is not None:
            count = self._climb(self._heights, time, self._before_m[index] + along_m, speed, count)
        writers, values = self._writers, self._values[:count].tolist()
        for number, value in zip(self._which[:count].tolist(), values, strict=True):
            writers[number](value)

    def _choose_trains(self, time_s: float) -> None:
        """Keep the trains that are flown at a time, with those that begin."""
        begun = self._swings.begun(time_s)
        self._flying = [train for train in self._flying if not train.over(time_s)] + begun
        self._over_s = min((train.over_s for train in self._flying), default=math.inf)
        self._flown = table_of([train.placed for train in self._flying])

    def _note(self, told: int, detail: int, speed: float) -> None:
        """Do what a tick tells."""
        plant, monitor, guidance, time = self.plant, self._monitor, self.guidance, self.plant.time_s
        if told & ticks.OUTSIDE:
            raise plant.trouble(*divmod(detail, len(TROUBLES)), self._steps_per_row)
        if monitor is not None and told & (ticks.STUCK | ticks.MISSED):
            stuck = told & ticks.STUCK
            element, off_m = self.path[guidance.index], guidance.off_m
            trouble = monitor.stuck(detail, plant.row) if stuck else monitor.line(element, off_m)
            raise FlightTroubleError(trouble, plant.row, time)
        if told & ticks.FINISHED:
            self.finished_s = guidance.finished_s
        if told & ticks.ENTERED:
            self._plan_legs(guidance.crossings)
        elif told & ticks.BEFORE:
            self._expect_first_row(time, guidance.along_m, speed)

    def _climb(self, heights: HeightPlan, time_s: float, along_m: float, speed: float, count: int) -> int:
        """Command the planned height of the next tick, and the planned climb one delay of the loops ahead of it."""
        self.planned.append((time_s, heights.at(along_m)))
        along_m += speed / TICK_HZ
        climb_mps = heights.slope(along_m + CLIMB_LEAD_S * speed) * speed
        for number, target in ((ticks.HEIGHT, heights.at(along_m) / FT), (ticks.CLIMB, climb_mps / FT)):
            count = ticks.move(self._targets, number, target, self._which, self._values, count)
        return count

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

    def _expect_first_row(self, time_s: float, along_m: float, speed: float) -> None:
        """Shortly before the path is entered, let the turbulence be as far as it shall be at the first row."""
        left_s = -along_m / max(1.0, speed)
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

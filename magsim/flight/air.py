"""The air as JSBSim system XML: wind that changes with height, and gusts, both at the step rate.

The steady wind and the turbulence are JSBSim's own. Gusts are handed to generators, each of which makes one gust at a
time; there are as many as gusts overlap. Times are on JSBSim's clock, speeds in feet a second (JSBSim's units).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from magsim.scenario import Air, Gust, LinearShear, LogShear
from magsim.scenario.air import log_factor
from magsim.streams import integer_seed, stream
from magsim.units import FT

NEVER_S = 1.0e9
TUSTIN, MILSPEC = 4, 3
"""JSBSim's numbers of its two Dryden models."""

SEVERITY_WIND_MPS = {0: 0.0, 1: 7.7, 2: 7.7, 3: 7.7, 4: 15.4, 5: 15.4, 6: 23.2, 7: 23.2}
"""Wind at 20 ft of light, moderate and severe turbulence: 15, 30, 45 kt (MIL-F-8785C, 3.7.2)."""


@dataclass(frozen=True)
class Weather:
    """What the air does beside its steady wind.

    Attributes
    ----------
    shear : LinearShear or LogShear, optional
    reference_m : float
        Where the steady wind holds: height above the ellipsoid of a linear shear, above ground of a logarithmic one.
    gusts : tuple of Gust
        Times count from the first row.
    severity : int
        Of the turbulence, 0 to 7.
    model : str
        ``tustin`` or ``milspec``.
    seed : int
        Of the turbulence.
    wind_20ft_mps : float, optional
        What turbulence near the ground depends on; None takes it from the severity.
    """

    shear: LinearShear | LogShear | None = None
    reference_m: float = 0.0
    gusts: tuple[Gust, ...] = ()
    severity: int = 0
    model: str = "tustin"
    seed: int = 1
    wind_20ft_mps: float | None = None

    @cached_property
    def slots(self) -> tuple[tuple[Gust, ...], ...]:
        """Gusts of each generator, in time order; two of one generator never overlap, nor touch within a second."""
        slots: list[list[Gust]] = []
        for gust in sorted(self.gusts, key=lambda gust: gust.at_s):
            free = (slot for slot in slots if slot[-1].at_s + slot[-1].duration_s + 1.0 <= gust.at_s)
            slot = next(free, None)
            if slot is None:
                slots.append([gust])
            else:
                slot.append(gust)
        return tuple(map(tuple, slots))

    @property
    def inputs(self) -> tuple[str, ...]:
        """Properties that Python writes during the flight."""
        return tuple(_gust_property(slot, name) for slot in range(len(self.slots)) for name in GUST_INPUTS)

    def turbulence_properties(self) -> dict[str, float]:
        """Settings of JSBSim's turbulence, in the order in which they are to be written."""
        if not self.severity:
            return {}
        wind = SEVERITY_WIND_MPS[self.severity] if self.wind_20ft_mps is None else self.wind_20ft_mps
        return {
            "atmosphere/randomseed": self.seed,
            "atmosphere/turbulence/milspec/windspeed_at_20ft_AGL-fps": wind / FT,
            "atmosphere/turbulence/milspec/severity": self.severity,
            "atmosphere/turb-type": {"tustin": TUSTIN, "milspec": MILSPEC}[self.model],
        }


CALM = Weather()

GUST_INPUTS = ("start-s", "duration-s", "north-fps", "east-fps", "down-fps")


def _gust_property(slot: int, name: str) -> str:
    return f"air/gust-{slot}/{name}"


def drawn_gusts(air: Air, seed: int, last_s: float) -> tuple[Gust, ...]:
    """The gusts of a scenario: those that it names, and those that it draws, up to a time from the first row.

    Parameters
    ----------
    air : Air
    seed : int
        The scenario's.
    last_s : float
        Draws end here. A later end gives the same gusts and more.
    """
    gusts, settings = list(air.gusts), air.random_gusts
    if settings is None:
        return tuple(gusts)
    rng = stream(seed, "gusts")
    time = 1.0
    while True:
        time += float(rng.exponential(settings.every_s))
        duration = float(rng.uniform(settings.shortest_s, settings.longest_s))
        speed = float(rng.uniform(0.0, settings.speed_mps))
        down, turn = float(rng.uniform(-1.0, 1.0)), float(rng.uniform(0.0, 2.0 * math.pi))
        if time > last_s:
            return tuple(gusts)
        # Even over the sphere: the height of a point is even between the poles (Archimedes).
        level = speed * math.sqrt(1.0 - down * down)
        wind = {"north_mps": level * math.cos(turn), "east_mps": level * math.sin(turn), "down_mps": speed * down}
        gusts.append(Gust(at_s=time, duration_s=duration, **wind))


def weather_xml(weather: Weather, wind_mps: tuple[float, float], grid: float = 0.0, grid_lon_rad: float = 0.0) -> str:
    """The system of shear and gusts, empty where there is neither; near the poles, of all wind.

    JSBSim makes the wind of a step before it runs its systems, so what is computed here acts one step later: gusts
    are computed one step ahead.

    Parameters
    ----------
    weather : Weather
    wind_mps : (float, float)
        Steady wind to north and east where the weather's reference height says; near the poles at ``grid_lon_rad``.
    grid : float
        See ``magsim.earth.grid``: not 0 near the poles, where the air moves in grid directions.
    grid_lon_rad : float
    """
    declared = "".join(
        f' <property value="{NEVER_S if name == "start-s" else 1.0!r}">{_gust_property(slot, name)}</property>\n'
        for slot in range(len(weather.slots))
        for name in GUST_INPUTS
    )
    place = "air/grid" if grid else "atmosphere"
    functions = _shear(weather, wind_mps, place) + _gusts(len(weather.slots), place)
    if grid:
        functions += _turned_to_local(weather, wind_mps, grid, grid_lon_rad)
    channel = f' <channel name="air">\n{functions} </channel>\n' if functions else ""
    return f'<?xml version="1.0"?>\n<system name="air">\n{declared}{channel}</system>\n'


POINTER_FPS = 1.0e-9
"""A wind too weak to be felt, by whose direction JSBSim turns its turbulence."""


def _turned_to_local(weather: Weather, wind_mps: tuple[float, float], grid: float, grid_lon_rad: float) -> str:
    """Wind and gusts of the grid as JSBSim's gusts, which turn no turbulence, in the local directions of the next step.

    JSBSim turns its turbulence counter to the wind, one step late: its wind becomes a pointer, two steps ahead.
    """
    steady = weather.shear is None
    total = {}
    for axis, wind in zip(("north", "east"), wind_mps, strict=True):
        parts = _value(wind / FT) if steady else f"<property>air/grid/wind-{axis}-fps</property>"
        if weather.slots:
            parts += f"<property>air/grid/gust-{axis}-fps</property>"
        total[axis] = f"<sum>{_value(0.0)}{parts}</sum>"
    text = "".join(_function(f"air/grid/total-{axis}-fps", law) for axis, law in total.items())
    if weather.slots:
        text += _function("atmosphere/gust-down-fps", "<sum><property>air/grid/gust-down-fps</property></sum>")
    text += _azimuth("air/grid/azimuth-rad", 1, grid, grid_lon_rad)
    north, east = (f"<property>air/grid/total-{axis}-fps</property>" for axis in ("north", "east"))
    sin, cos = (f"<{name}><property>air/grid/azimuth-rad</property></{name}>" for name in ("sin", "cos"))
    text += _function(
        "atmosphere/gust-north-fps",
        f"<difference><product>{north}{cos}</product><product>{east}{sin}</product></difference>",
    )
    text += _function(
        "atmosphere/gust-east-fps", f"<sum><product>{north}{sin}</product><product>{east}{cos}</product></sum>"
    )
    if weather.severity:
        text += _azimuth("air/grid/pointer-rad", 2, grid, grid_lon_rad)
        for axis, name, sign in (("north", "cos", 1.0), ("east", "sin", -1.0)):
            part = f"<{name}><property>air/grid/pointer-rad</property></{name}>"
            text += _function(f"atmosphere/wind-{axis}-fps", f"<product>{_value(sign * POINTER_FPS)}{part}</product>")
    return text


def _azimuth(output: str, steps: int, grid: float, grid_lon_rad: float) -> str:
    """Local azimuth of grid north some steps ahead: by the longitude that the motion over ground leads to."""
    lon, lat = "<property>position/long-gc-rad</property>", "<property>position/lat-geod-rad</property>"
    v_north, v_east = (f"<property>velocities/v-{axis}-fps</property>" for axis in ("north", "east"))
    time = f"<product>{_value(float(steps))}<property>simulation/dt</property></product>"
    # Along the meridian, away from the axis, and across it, in the plane of the equator.
    out = (
        f"<difference><property>{output}/axis-ft</property>"
        f"<product>{time}{v_north}<sin>{lat}</sin></product></difference>"
    )
    x, y = "position/ecef-x-ft", "position/ecef-y-ft"
    squares = "".join(f"<product><property>{name}</property><property>{name}</property></product>" for name in (x, y))
    text = _function(f"{output}/axis-ft", f"<pow><sum>{squares}</sum>{_value(0.5)}</pow>")
    ahead = f"<atan2><product>{time}{v_east}</product>{out}</atan2>"
    turned = f"<difference><sum>{lon}{ahead}</sum>{_value(grid_lon_rad)}</difference>"
    return text + _function(output, f"<product>{_value(-grid)}{turned}</product>")


def _function(output: str, expression: str) -> str:
    name = output.replace("/", " ")
    return f'  <fcs_function name="{name}"><function>{expression}</function><output>{output}</output></fcs_function>\n'


def _value(value: float) -> str:
    return f"<value>{value!r}</value>"


def _shear(weather: Weather, wind_mps: tuple[float, float], place: str) -> str:
    """Wind to north and east as functions of height, as properties of a place."""
    shear, (north, east) = weather.shear, wind_mps
    if isinstance(shear, LinearShear):
        above = f"<difference><property>position/geod-alt-ft</property>{_value(weather.reference_m / FT)}</difference>"
        laws = {
            axis: f"<sum>{_value(wind / FT)}<product>{_value(gradient)}{above}</product></sum>"
            for axis, wind, gradient in (("north", north, shear.north_per_s), ("east", east, shear.east_per_s))
        }
    elif isinstance(shear, LogShear):
        low, high, unit = 2.0 * shear.roughness_m / FT, shear.top_m / FT, FT / shear.roughness_m
        height = f"<max>{_value(low)}<min>{_value(high)}<property>position/h-agl-ft</property></min></max>"
        profile = f"<ln><product>{_value(unit)}{height}</product></ln>"
        at_reference = log_factor(weather.reference_m, shear)
        laws = {
            axis: f"<product>{_value(wind / FT / at_reference)}{profile}</product>"
            for axis, wind in (("north", north), ("east", east))
        }
    else:
        laws = {}
    return "".join(_function(f"{place}/wind-{axis}-fps", law) for axis, law in laws.items())


def _gusts(slots: int, place: str) -> str:
    """Share of each generator's gust, and their sum as properties of a place: ``atmosphere`` is JSBSim's gust."""
    text, now = "", "<sum><property>simulation/sim-time-sec</property><property>simulation/dt</property></sum>"
    for slot in range(slots):
        start, duration = (f"<property>{_gust_property(slot, name)}</property>" for name in ("start-s", "duration-s"))
        phase = f"<quotient><difference>{now}{start}</difference>{duration}</quotient>"
        text += _function(f"air/gust-{slot}/phase", f"<max>{_value(0.0)}<min>{_value(1.0)}{phase}</min></max>")
        angle = f"<product>{_value(2.0 * math.pi)}<property>air/gust-{slot}/phase</property></product>"
        rise = f"<product>{_value(0.5)}<difference>{_value(1.0)}<cos>{angle}</cos></difference></product>"
        text += _function(f"air/gust-{slot}/share", rise)
    for axis in ("north", "east", "down") if slots else ():
        parts = "".join(
            f"<product><property>air/gust-{slot}/share</property><property>air/gust-{slot}/{axis}-fps</property></product>"
            for slot in range(slots)
        )
        text += _function(f"{place}/gust-{axis}-fps", f"<sum>{_value(0.0)}{parts}</sum>")
    return text


class GustHands:
    """Hands each gust to its generator on the last tick before it begins.

    Parameters
    ----------
    weather : Weather
    """

    def __init__(self, weather: Weather) -> None:
        self._slots = weather.slots
        self._waiting: list[tuple[float, int, Gust]] = []
        self._offset_s = 0.0

    def begin(self, zero_s: float, offset_s: float) -> None:
        """Name the time of the first row, and what JSBSim's clock is ahead of it; until then there are no gusts."""
        self._offset_s = offset_s
        dated = [(gust.at_s + zero_s, slot, gust) for slot, gusts in enumerate(self._slots) for gust in gusts]
        # The later a gust begins, the earlier in the list: the next one is popped from the end.
        self._waiting = sorted(dated, key=lambda item: -item[0])

    def due(self, until_s: float) -> Sequence[tuple[str, float]]:
        """Properties and values of the gusts that begin before a time, which counts like ``zero_s``."""
        waiting = self._waiting
        if not waiting or waiting[-1][0] > until_s:
            return ()
        out: list[tuple[str, float]] = []
        while waiting and waiting[-1][0] <= until_s:
            start, slot, gust = waiting.pop()
            wind = (gust.north_mps / FT, gust.east_mps / FT, gust.down_mps / FT)
            values = (start + self._offset_s, gust.duration_s, *wind)
            out += [(_gust_property(slot, name), value) for name, value in zip(GUST_INPUTS, values, strict=True)]
        return out


def weather_of(air: Air, seed: int, reference_m: float, last_s: float) -> Weather:
    """The weather of a scenario.

    Parameters
    ----------
    air : Air
    seed : int
        The scenario's.
    reference_m : float
        Where the steady wind holds, as ``Weather`` counts it.
    last_s : float
        No gust is drawn that begins later.
    """
    return Weather(
        shear=air.shear,
        reference_m=reference_m,
        gusts=drawn_gusts(air, seed, last_s),
        severity=air.turbulence_severity,
        model=air.turbulence_model,
        seed=integer_seed(seed, "turbulence"),
        wind_20ft_mps=air.turbulence_wind_mps,
    )

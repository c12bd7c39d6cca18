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


def weather_xml(weather: Weather, wind_mps: tuple[float, float]) -> str:
    """The system of shear and gusts, empty where there is neither.

    JSBSim makes the wind of a step before it runs its systems, so what is computed here acts one step later: gusts
    are computed one step ahead.
    """
    declared = "".join(
        f' <property value="{NEVER_S if name == "start-s" else 1.0!r}">{_gust_property(slot, name)}</property>\n'
        for slot in range(len(weather.slots))
        for name in GUST_INPUTS
    )
    functions = _shear(weather, wind_mps) + _gusts(len(weather.slots))
    channel = f' <channel name="air">\n{functions} </channel>\n' if functions else ""
    return f'<?xml version="1.0"?>\n<system name="air">\n{declared}{channel}</system>\n'


def _function(output: str, expression: str) -> str:
    name = output.replace("/", " ")
    return f'  <fcs_function name="{name}"><function>{expression}</function><output>{output}</output></fcs_function>\n'


def _value(value: float) -> str:
    return f"<value>{value!r}</value>"


def _shear(weather: Weather, wind_mps: tuple[float, float]) -> str:
    """Wind to north and east as functions of height."""
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
    return "".join(_function(f"atmosphere/wind-{axis}-fps", law) for axis, law in laws.items())


def _gusts(slots: int) -> str:
    """Share of each generator's gust, and their sum as JSBSim's gust."""
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
        text += _function(f"atmosphere/gust-{axis}-fps", f"<sum>{_value(0.0)}{parts}</sum>")
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

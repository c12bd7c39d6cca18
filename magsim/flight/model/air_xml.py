"""The air as JSBSim system XML: wind that changes with height, and gusts, both at the step rate.

The steady wind is JSBSim's own. Gusts are passed to generators, each of which produces one gust at a time; there are as
many generators as gusts overlap. Turbulence comes from outside at every step, see ``turbulence``. Times are on JSBSim's
clock, speeds in feet a second (JSBSim's units).
"""

import math

from magsim.flight.model.weather import (
    GUST_INPUTS,
    TURBULENCE_INPUTS,
    Weather,
    gust_property,
)
from magsim.scenario import LinearShear, LogShear
from magsim.scenario.air import log_factor
from magsim.units import FT

NEVER_S = 1.0e9
"""Start time of a generator at rest."""


def weather_xml(weather: Weather, wind_mps: tuple[float, float], grid: float = 0.0, grid_lon_rad: float = 0.0) -> str:
    """Write the system of shear and gusts, empty if there is neither; near the poles, of all wind.

    JSBSim computes the wind of a step before it runs its systems, so a result of this system acts one step later:
    gusts are computed one step ahead.

    Parameters
    ----------
    weather : Weather
    wind_mps : (float, float)
        Steady wind to north and east at the weather's reference height; near the poles at ``grid_lon_rad``.
    grid : float
        See ``magsim.earth.grid``: not 0 near the poles, where the air moves in grid directions.
    grid_lon_rad : float
    """
    declared = "".join(
        f' <property value="{NEVER_S if name == "start-s" else 1.0!r}">{gust_property(slot, name)}</property>\n'
        for slot in range(len(weather.slots))
        for name in GUST_INPUTS
    )
    if weather.turbulence:
        declared += "".join(f' <property value="0.0">{name}</property>\n' for name in TURBULENCE_INPUTS)
    place = "air/grid" if grid else "atmosphere"
    functions = _shear(weather, wind_mps, place) + _gusts(weather, place)
    if grid:
        functions += _turned_to_local(weather, wind_mps, grid, grid_lon_rad)
    channel = f' <channel name="air">\n{functions} </channel>\n' if functions else ""
    return f'<?xml version="1.0"?>\n<system name="air">\n{declared}{channel}</system>\n'


def _turned_to_local(weather: Weather, wind_mps: tuple[float, float], grid: float, grid_lon_rad: float) -> str:
    """Write wind and gusts of the grid as JSBSim's gusts, along the next step's local axes."""
    steady, gusts = weather.shear is None, bool(weather.slots or weather.turbulence)
    total = {}
    for axis, wind in zip(("north", "east"), wind_mps, strict=True):
        parts = _value(wind / FT) if steady else f"<property>air/grid/wind-{axis}-fps</property>"
        if gusts:
            parts += f"<property>air/grid/gust-{axis}-fps</property>"
        total[axis] = f"<sum>{_value(0.0)}{parts}</sum>"
    text = "".join(_function(f"air/grid/total-{axis}-fps", law) for axis, law in total.items())
    if gusts:
        text += _function(
            "atmosphere/gust-down-fps", f"<sum>{_value(0.0)}<property>air/grid/gust-down-fps</property></sum>"
        )
    text += _azimuth("air/grid/azimuth-rad", grid, grid_lon_rad)
    north, east = (f"<property>air/grid/total-{axis}-fps</property>" for axis in ("north", "east"))
    sin, cos = (f"<{name}><property>air/grid/azimuth-rad</property></{name}>" for name in ("sin", "cos"))
    text += _function(
        "atmosphere/gust-north-fps",
        f"<difference><product>{north}{cos}</product><product>{east}{sin}</product></difference>",
    )
    text += _function(
        "atmosphere/gust-east-fps", f"<sum><product>{north}{sin}</product><product>{east}{cos}</product></sum>"
    )
    return text


def _azimuth(output: str, grid: float, grid_lon_rad: float) -> str:
    """Write the local azimuth of grid north a step ahead, at the longitude that the motion over ground leads to."""
    lon, lat = "<property>position/long-gc-rad</property>", "<property>position/lat-geod-rad</property>"
    v_north, v_east = (f"<property>velocities/v-{axis}-fps</property>" for axis in ("north", "east"))
    time = "<property>simulation/dt</property>"
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
    """Write wind to north and east as functions of height, as properties below ``place``."""
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


def _gusts(weather: Weather, place: str) -> str:
    """Write each generator's share of its gust, and below ``place`` their sum and the turbulence.

    In ``atmosphere`` the sum is JSBSim's gust.
    """
    slots = len(weather.slots)
    text, now = "", "<sum><property>simulation/sim-time-sec</property><property>simulation/dt</property></sum>"
    for slot in range(slots):
        start, duration = (f"<property>{gust_property(slot, name)}</property>" for name in ("start-s", "duration-s"))
        phase = f"<quotient><difference>{now}{start}</difference>{duration}</quotient>"
        text += _function(f"air/gust-{slot}/phase", f"<max>{_value(0.0)}<min>{_value(1.0)}{phase}</min></max>")
        angle = f"<product>{_value(2.0 * math.pi)}<property>air/gust-{slot}/phase</property></product>"
        rise = f"<product>{_value(0.5)}<difference>{_value(1.0)}<cos>{angle}</cos></difference></product>"
        text += _function(f"air/gust-{slot}/share", rise)
    for axis in ("north", "east", "down") if slots or weather.turbulence else ():
        parts = "".join(
            f"<product><property>air/gust-{slot}/share</property><property>air/gust-{slot}/{axis}-fps</property></product>"
            for slot in range(slots)
        )
        if weather.turbulence:
            parts += f"<property>air/turbulence/{axis}-fps</property>"
        text += _function(f"{place}/gust-{axis}-fps", f"<sum>{_value(0.0)}{parts}</sum>")
    return text

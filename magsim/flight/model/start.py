"""The start of a flight: trimmed, in wind, with the engine running and the autopilot on."""

import math
from dataclasses import replace

import jsbsim

from magsim.aircraft.facts import Facts
from magsim.flight.model.air_xml import weather_xml
from magsim.flight.model.engines import settling_time
from magsim.flight.model.instance import load
from magsim.flight.model.setup import PlantSetup
from magsim.flight.model.trim import set_flaps, set_initial_place, trim
from magsim.flight.path.plane import LocalPlane
from magsim.flight.path.wind import crab_heading, ground_speed
from magsim.units import FT


def start(facts: Facts, setup: PlantSetup) -> jsbsim.FGFDMExec:
    """Start an instance that flies along its course, trimmed, in wind, with the autopilot on.

    Trim is found in still air on an instance of its own; the flight begins with the same attitude to the air and with
    the velocity over ground that the wind gives. An engine that has to run up first does so on the way to the start:
    the instance begins that much earlier on its course, and the flight until then is discarded.
    """
    trimmed = trim(facts, setup)
    settling_s = settling_time(facts.engine)
    begun = _earlier(setup, settling_s)
    north, east = wind = begun.local_wind_mps
    heading = crab_heading(setup.speed_mps, begun.course, wind)
    air_xml = weather_xml(setup.weather, setup.wind_mps, setup.grid, setup.grid_lon)
    turbulent = setup.weather.turbulence is not None
    fdm = load(facts, setup.step_hz, air_xml=air_xml, turbulent=turbulent, hook_b=setup.hook_b)
    set_initial_place(fdm, begun)
    fdm["ic/phi-rad"] = trimmed.roll
    fdm["ic/theta-rad"] = trimmed.pitch
    fdm["ic/psi-true-rad"] = heading % (2.0 * math.pi)
    fdm["ic/vn-fps"] = (setup.speed_mps * math.cos(heading) + north) / FT
    fdm["ic/ve-fps"] = (setup.speed_mps * math.sin(heading) + east) / FT
    fdm["ic/vd-fps"] = 0.0
    fdm["propulsion/fuel_freeze"] = 1.0
    fdm.run_ic()
    set_flaps(fdm, facts, setup.flap_rad)
    for name, value in trimmed.commands.items():
        fdm[name] = value
    fdm["propulsion/set-running"] = -1
    fdm["fcs/advance-cmd-norm"] = 1.0
    fdm["ap/theta-rad"] = trimmed.pitch
    fdm["ap/height-ft"] = setup.alt_m / FT
    fdm["ap/speed-fps"] = setup.speed_mps / FT
    fdm["ap/grid-norm"] = setup.grid
    fdm["ap/heading-rad"] = (heading + setup.grid * begun.lon_rad) % (2.0 * math.pi)
    fdm["ap/hold-height"] = 1.0
    fdm["ap/hold-heading"] = 1.0
    fdm["ap/on"] = 1.0
    if not setup.grid:
        fdm["atmosphere/wind-north-fps"] = north / FT
        fdm["atmosphere/wind-east-fps"] = east / FT
    for _ in range(round(settling_s * setup.step_hz)):
        fdm.run()
    fdm["propulsion/fuel_freeze"] = 0.0 if setup.burn else 1.0
    return fdm


def _earlier(setup: PlantSetup, time_s: float) -> PlantSetup:
    """Move the start a time back on its course, which differs there because the meridians converge."""
    distance = time_s * ground_speed(setup.speed_mps, setup.course, setup.local_wind_mps)
    plane = LocalPlane(setup.lat_rad, setup.lon_rad, setup.alt_m)
    lat, lon = plane.geodetic(-distance * math.cos(setup.course), -distance * math.sin(setup.course))
    return replace(setup, lat_rad=lat, lon_rad=lon, course=setup.course - plane.north_at(lat, lon))

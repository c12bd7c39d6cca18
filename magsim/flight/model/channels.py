"""The quantities that are logged at every row of a flight: names, JSBSim's properties, factors to SI."""

import math
from typing import NamedTuple

import numpy as np

from magsim.units import FT, LBF

CHANNELS: tuple[tuple[str, str, float], ...] = (
    ("lat", "position/lat-geod-rad", 1.0),
    ("lon", "position/long-gc-rad", 1.0),
    ("alt", "position/geod-alt-ft", FT),
    ("v_north", "velocities/v-north-fps", FT),
    ("v_east", "velocities/v-east-fps", FT),
    ("v_down", "velocities/v-down-fps", FT),
    ("roll", "attitude/phi-rad", 1.0),
    ("pitch", "attitude/theta-rad", 1.0),
    ("heading", "attitude/psi-rad", 1.0),
    ("p", "velocities/p-rad_sec", 1.0),
    ("q", "velocities/q-rad_sec", 1.0),
    ("r", "velocities/r-rad_sec", 1.0),
    ("elevator", "fcs/elevator-pos-rad", 1.0),
    ("aileron", "fcs/left-aileron-pos-rad", 1.0),
    ("rudder", "fcs/rudder-pos-rad", 1.0),
    ("airspeed", "velocities/vt-fps", FT),
    ("alpha", "aero/alpha-rad", 1.0),
    ("beta", "aero/beta-rad", 1.0),
    ("throttle", "fcs/throttle-pos-norm", 1.0),
    ("wind_north", "atmosphere/total-wind-north-fps", FT),
    ("wind_east", "atmosphere/total-wind-east-fps", FT),
    ("wind_down", "atmosphere/total-wind-down-fps", FT),
    ("flap", "fcs/flap-pos-rad", 1.0),
    ("engaged", "ap/on", 1.0),
    ("thrust", "propulsion/engine/thrust-lbs", LBF),
    ("rotor", "propulsion/engine/propeller-rpm", math.pi / 30.0),
)
"""Logged quantities: name, JSBSim's property, factor to SI."""

WITHOUT = frozenset({"propulsion/engine/propeller-rpm"})
"""Properties that a model need not have; they read 0 if missing."""

TO_SI = np.array([factor for _, _, factor in CHANNELS])

COLUMN = {name: i for i, (name, _, _) in enumerate(CHANNELS)}

MOTION = ("lat", "lon", "v_north", "v_east", "v_down", "heading", "airspeed")
"""Quantities that guidance reads on every tick."""


class CarrierState(NamedTuple):
    """State of the carrier at one step, as a towed body needs it, SI."""

    lat: float
    lon: float
    alt: float
    v_north: float
    v_east: float
    v_down: float
    roll: float
    pitch: float
    heading: float
    p: float
    q: float
    r: float
    """Angular rate relative to the Earth, body axes."""
    wind_north: float
    wind_east: float
    wind_down: float


STATE_COLUMNS = tuple((COLUMN[name], CHANNELS[COLUMN[name]][2]) for name in CarrierState._fields)
"""Column and factor to SI of each quantity of a ``CarrierState``."""

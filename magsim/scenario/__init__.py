"""A scenario: where, when, how flown, which physics, which instruments, which seed.

The models here are the meaning of a scenario file; ``magsim.config`` reads it and reports every error with
file and line. Limits that belong to the aircraft are checked in the same pass: the aircraft comes in as
``context["aircraft"]`` of the validation, a towed bird as ``context["bird"]``.
"""

from magsim.scenario.air import Air, Gust, LinearShear, LogShear, RandomGusts
from magsim.scenario.base import FieldPart
from magsim.scenario.electronics import Electronics
from magsim.scenario.flaps import FlapMove
from magsim.scenario.geology import Crust, DipoleTarget, PrismTarget, SphereTarget, Target
from magsim.scenario.instruments import (
    Barometer,
    BaseStation,
    Cabin,
    Electrical,
    FluxgateSensor,
    Ins,
    InstrumentClock,
    Radar,
    ScalarSensor,
    Sensor,
    Sensors,
    Surfaces,
    Tone,
)
from magsim.scenario.maneuvers import Combined, Maneuver, Oscillation, PhasedOscillation, Train
from magsim.scenario.patterns import (
    LEGS,
    Box,
    Centered,
    Cloverleaf,
    Diamond,
    Fom,
    FomPeakToPeak,
    HeadingCross,
    LegPattern,
    PatternBase,
    PatternSequence,
    Square,
    StraightLine,
    SurveyPattern,
    key_of,
    parts_of,
)
from magsim.scenario.payload import Loading
from magsim.scenario.physics import Earth, EddyPart, FieldSettings, MemoryPart
from magsim.scenario.place import GroundPoint
from magsim.scenario.resting import resting_settings
from magsim.scenario.start import FlightSettings, Start, Sway
from magsim.scenario.swell import Swell
from magsim.scenario.terrain import FlatTerrain, FractalTerrain, GridTerrain, Terrain, ground_of
from magsim.scenario.tow import Gusts, Tow, TowBody, TowRope
from magsim.scenario.track import TrackPattern
from magsim.scenario.tracklog import TrackLog
from magsim.scenario.variation import Variation
from magsim.scenario.whole import Pattern, RecordingSettings, Scenario

__all__ = [
    "LEGS",
    "Air",
    "Barometer",
    "BaseStation",
    "Box",
    "Cabin",
    "Centered",
    "Cloverleaf",
    "Combined",
    "Crust",
    "Diamond",
    "DipoleTarget",
    "Earth",
    "EddyPart",
    "Electrical",
    "Electronics",
    "FieldPart",
    "FieldSettings",
    "FlapMove",
    "FlatTerrain",
    "FlightSettings",
    "FluxgateSensor",
    "Fom",
    "FomPeakToPeak",
    "FractalTerrain",
    "GridTerrain",
    "GroundPoint",
    "Gust",
    "Gusts",
    "HeadingCross",
    "Ins",
    "InstrumentClock",
    "LegPattern",
    "LinearShear",
    "Loading",
    "LogShear",
    "Maneuver",
    "MemoryPart",
    "Oscillation",
    "Pattern",
    "PatternBase",
    "PatternSequence",
    "PhasedOscillation",
    "PrismTarget",
    "Radar",
    "RandomGusts",
    "RecordingSettings",
    "ScalarSensor",
    "Scenario",
    "Sensor",
    "Sensors",
    "SphereTarget",
    "Square",
    "Start",
    "StraightLine",
    "Surfaces",
    "SurveyPattern",
    "Sway",
    "Swell",
    "Target",
    "Terrain",
    "Tone",
    "Tow",
    "TowBody",
    "TowRope",
    "TrackLog",
    "TrackPattern",
    "Train",
    "Variation",
    "ground_of",
    "key_of",
    "parts_of",
    "resting_settings",
]

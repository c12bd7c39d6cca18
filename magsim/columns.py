"""The table of recording columns: name, role, unit, frame and meaning of each, defined only here.

Attitude, position, velocity and pressure are those of the row's instant, and so are rates unless their meaning says
that they pass the anti-alias filter. Readings, labels and parts of the field pass it too.

A family is a name with fields in braces, ``mag_{sensor}_nt``. Users and aircraft files name sensors, feeders, buses
and control surfaces, with ``[a-z][a-z0-9_]*``.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property, lru_cache

ROLES = ("input", "label", "truth", "segment")
"""Roles in the order in which a file stores them."""

NAME_PATTERN = r"[a-z][a-z0-9_]*"
"""Allowed names of sensors, mounts and control surfaces."""

BACKGROUND = ("earth", "departure", "crust", "target", "variation", "swell")
"""Parts of the field at a sensor that exist without the aircraft."""

PLATFORM = (
    *("permanent", "hinged", "controls", "suspension", "crew", "propeller"),
    *("induced", "memory", "eddy", "electronics", "carrier"),
)
"""Parts of the field at a sensor from the platform: the interference. ``carrier``: of the towing carrier, at a bird."""

COMPONENTS = BACKGROUND + PLATFORM
"""All parts; their sum is the total field. A part that is switched off is absent from truth and from files."""

AXES = ("x", "y", "z")

DIRECTIONS = ("n", "e", "d")
"""Local axes: north, east, down."""

INS_ANGLES = ("roll", "pitch", "heading", "lat", "lon")
"""Angles of ``ins_{angle}_deg`` and ``true_{angle}_deg``: attitude, then WGS-84 position."""

ROPE_WAYS = ("trail", "side")
"""Angles of ``true_rope_{way}_deg``."""

MANEUVERS = {0: "none", 1: "pitch", 2: "roll", 3: "yaw", 4: "combined"}
SPLITS = {0: "train", 1: "valid", 2: "test"}


@dataclass(frozen=True)
class Family:
    """One family of columns.

    Attributes
    ----------
    pattern : str
        Column name with fields in braces.
    role : str
        One of ``ROLES``.
    unit : str
        Unit of the values; ``"1"`` for numbers without unit.
    frame : str
        Frame suffix of the conventions page, or ``""``.
    meaning : str
        One sentence for people; stored in the file beside the column.
    alias_sgl : str
        Pattern of the column's name in the SGL 2020 layout, or ``""``; ``magsim.exchange.aliases`` has those of single
        columns.
    """

    pattern: str
    role: str
    unit: str
    frame: str
    meaning: str
    alias_sgl: str = ""

    @cached_property
    def regex(self) -> re.Pattern[str]:
        """The pattern as a regular expression with one group for each field."""
        choices = {
            "axis": "|".join(AXES),
            "component": "|".join(COMPONENTS),
            "angle": "|".join(INS_ANGLES),
            "direction": "|".join(DIRECTIONS),
            "way": "|".join(ROPE_WAYS),
        }
        parts = re.split(r"\{(\w+)\}", self.pattern)
        text = "".join(
            re.escape(part) if i % 2 == 0 else f"(?P<{part}>{choices.get(part, NAME_PATTERN)})"
            for i, part in enumerate(parts)
        )
        return re.compile(text)

    def name(self, **fields: str) -> str:
        """Return the column name with the fields filled in."""
        return self.pattern.format(**fields)

    def match(self, name: str) -> dict[str, str] | None:
        """Return the fields of a column name of this family; None for another name."""
        found = self.regex.fullmatch(name)
        return None if found is None else found.groupdict()


TIME = "time_s"

MAG = Family("mag_{sensor}_nt", "input", "nT", "", "Reading of a scalar magnetometer", "mag_{sensor}_uc")
MAG_VALID = Family(
    "mag_{sensor}_valid",
    "input",
    "1",
    "",
    "1 if the scalar magnetometer reads, 0 in a dropout, with the last reading repeated",
)
FLUX = Family("flux_{sensor}_{axis}_nt", "input", "nT", "s", "Reading of a fluxgate axis", "flux_{sensor}_{axis}")
INS_ATTITUDE = Family(
    "ins_{angle}_deg", "input", "deg", "", "Attitude and WGS-84 position from the INS; heading in [0, 360)"
)
INS_VELOCITY = Family("ins_v{direction}_mps", "input", "m/s", "n", "Velocity from the INS: n north, e east, d down")
INS_ALTITUDE = Family("ins_alt_m", "input", "m", "", "Height above the WGS-84 ellipsoid from the INS")
INS_ACCELERATION = Family(
    "ins_acc_{axis}_mps2",
    "input",
    "m/s^2",
    "b",
    "Specific force from the accelerometers of the INS, anti-alias filtered: at rest 1 g upward",
)
INS_RATE = Family(
    "ins_rate_{axis}_dps",
    "input",
    "deg/s",
    "b",
    "Angular rate from the gyros of the INS, relative to inertial space, anti-alias filtered",
)
BARO_ALTITUDE = Family(
    "baro_alt_m", "input", "m", "", "Barometric height: geopotential, in the standard atmosphere", "baro"
)
BARO_PRESSURE = Family("baro_pa", "input", "Pa", "", "Static pressure from the barometer")
RADAR = Family("radar_alt_m", "input", "m", "", "Height above the ground from the radar altimeter; -1 without echo")
BASE = Family("base_{sensor}_nt", "input", "nT", "", "Reading of a base station, a scalar magnetometer on the ground")
CURRENT = Family("cur_{feeder}_a", "input", "A", "", "Current of a feeder, from its own sensor, anti-alias filtered")
VOLTAGE = Family("vol_{bus}_v", "input", "V", "", "Voltage of a bus, from its own voltmeter, anti-alias filtered")
SURFACE = Family(
    "surface_{surface}_deg",
    "input",
    "deg",
    "",
    "Deflection of a control surface about its hinge, from its potentiometer, anti-alias filtered",
)

COMPENSATED = Family(
    "compensated_{sensor}_nt", "input", "nT", "", "Reading of a scalar magnetometer minus what a method removed from it"
)
REMOVED = Family("removed_{sensor}_nt", "input", "nT", "", "Interference that a method estimated and removed")

INTERFERENCE = Family(
    "interference_{sensor}_nt",
    "label",
    "nT",
    "",
    "Noise-free interference: field strength with minus without the aircraft",
)
PROJECTION = Family(
    "projection_{sensor}_nt",
    "label",
    "nT",
    "",
    "Noise-free interference: the platform's field along the direction of the background",
)

CLEAN = Family(
    "clean_{sensor}_nt", "truth", "nT", "", "Strength of the background field at the sensor, without the aircraft"
)
TOTAL = Family(
    "total_{sensor}_nt", "truth", "nT", "", "Strength of the total field at the sensor, without instrument errors"
)
SWING = Family(
    "swing_{sensor}_nt",
    "truth",
    "nT",
    "",
    "Change of the background as a towed sensor leaves its smooth track (below 0.03 Hz): clean minus strength there",
)
ERROR = Family(
    "error_{sensor}_nt",
    "truth",
    "nT",
    "",
    "Instrument error of a scalar magnetometer: reading minus total field strength",
)
FLUX_ERROR = Family(
    "fluxerror_{sensor}_{axis}_nt",
    "truth",
    "nT",
    "",
    "Error of a fluxgate: reading of its axis minus the total field along that axis of the body",
)
PART = Family("{component}_{sensor}_{axis}_nt", "truth", "nT", "b", "One part of the field at a sensor, body axes")
FLEX = Family(
    "flex_{sensor}_{axis}_nt",
    "truth",
    "nT",
    "b",
    "Change of the field at a sensor as its mount bends, body axes; the parts and the total hold it",
)
TRUE_BASE = Family(
    "true_base_{sensor}_nt", "truth", "nT", "", "Field strength at the base station, without instrument error"
)
TRUE_ATTITUDE = Family("true_{angle}_deg", "truth", "deg", "", "True attitude and WGS-84 position; heading in [0, 360)")
TRUE_RATE = Family(
    "true_rate_{axis}_dps", "truth", "deg/s", "b", "True angular rate relative to the local frame at the row's instant"
)
TRUE_ACCELERATION = Family(
    "true_acc_{axis}_mps2",
    "truth",
    "m/s^2",
    "b",
    "True specific force at the reference point, anti-alias filtered: acceleration less gravity",
)
TRUE_INERTIAL_RATE = Family(
    "true_inertial_rate_{axis}_dps",
    "truth",
    "deg/s",
    "b",
    "True angular rate relative to inertial space, anti-alias filtered",
)
TRUE_VELOCITY = Family("true_v{direction}_mps", "truth", "m/s", "n", "True velocity: n north, e east, d down")
TRUE_ALTITUDE = Family("true_alt_m", "truth", "m", "", "True height above the WGS-84 ellipsoid")
TRUE_MSL = Family("true_msl_m", "truth", "m", "", "True height above mean sea level")
TRUE_AGL = Family("true_agl_m", "truth", "m", "", "True height above the ground straight below")
TRUE_GROUND = Family("true_ground_m", "truth", "m", "", "Height of the ground below, above the WGS-84 ellipsoid")
TRUE_WIND = Family(
    "true_wind_{direction}_mps", "truth", "m/s", "n", "Velocity of the air over ground, turbulence included: n, e, d"
)
TRUE_CURRENT = Family("true_cur_{feeder}_a", "truth", "A", "", "True current of a feeder, anti-alias filtered")
TRUE_VOLTAGE = Family("true_vol_{bus}_v", "truth", "V", "", "True voltage of a bus, anti-alias filtered")
TRUE_SURFACE = Family(
    "true_surface_{surface}_deg",
    "truth",
    "deg",
    "",
    "True deflection of a control surface about its hinge, anti-alias filtered",
)

CARRIER_ATTITUDE = Family(
    "carrier_{angle}_deg", "input", "deg", "", "Attitude and WGS-84 position of a towing carrier from its own INS"
)
CARRIER_VELOCITY = Family("carrier_v{direction}_mps", "input", "m/s", "n", "Velocity of a towing carrier from its INS")
CARRIER_ALTITUDE = Family(
    "carrier_alt_m", "input", "m", "", "Height of a towing carrier above the WGS-84 ellipsoid from its INS"
)
TRUE_CARRIER_ATTITUDE = Family(
    "true_carrier_{angle}_deg", "truth", "deg", "", "True attitude and WGS-84 position of a towing carrier"
)
TRUE_CARRIER_RATE = Family(
    "true_carrier_rate_{axis}_dps",
    "truth",
    "deg/s",
    "b",
    "True angular rate of a towing carrier relative to the local frame at the row's instant",
)
TRUE_CARRIER_VELOCITY = Family(
    "true_carrier_v{direction}_mps", "truth", "m/s", "n", "True velocity of a towing carrier: n, e, d"
)
TRUE_CARRIER_ALTITUDE = Family(
    "true_carrier_alt_m", "truth", "m", "", "True height of a towing carrier above the WGS-84 ellipsoid"
)
TRUE_ROPE_ANGLE = Family(
    "true_rope_{way}_deg",
    "truth",
    "deg",
    "",
    "Angle from the vertical to the direction from hook to bridle, seen along the course: trail aft, side to the right",
)
TRUE_ROPE_TENSION = Family("true_rope_tension_n", "truth", "N", "", "Tension of the rope at the hook")

TRUE_PRESSURE = Family("true_pressure_pa", "truth", "Pa", "", "True static pressure of the air")
TRUE_TEMPERATURE = Family("true_cabin_c", "truth", "degC", "", "True temperature of the instruments")

CIRCUIT = Family("circuit", "segment", "1", "", "Number of the circuit, from 1")
LEG = Family("leg", "segment", "1", "", "Number of the leg within its circuit, from 1")
TURN = Family("turn", "segment", "1", "", "1 in the turn that follows the leg and in transits, else 0")
TRANSIT = Family("transit", "segment", "1", "", "1 in a transit from one pattern to the next, else 0")
LEG_HEADING = Family("leg_heading_deg", "segment", "deg", "", "Planned course of the leg, clockwise from north")
MANEUVER = Family("maneuver", "segment", "1", "", "0 none, 1 pitch, 2 roll, 3 yaw, 4 combined")
CYCLE = Family("cycle", "segment", "1", "", "Number of the maneuver's cycle from 1, 0 outside maneuvers")
SPLIT = Family("split", "segment", "1", "", "0 train, 1 valid, 2 test")

FAMILIES: tuple[Family, ...] = (
    MAG,
    MAG_VALID,
    FLUX,
    INS_ATTITUDE,
    INS_VELOCITY,
    INS_ALTITUDE,
    INS_ACCELERATION,
    INS_RATE,
    BARO_ALTITUDE,
    BARO_PRESSURE,
    RADAR,
    BASE,
    CURRENT,
    VOLTAGE,
    COMPENSATED,
    REMOVED,
    SURFACE,
    CARRIER_ATTITUDE,
    CARRIER_VELOCITY,
    CARRIER_ALTITUDE,
    INTERFERENCE,
    PROJECTION,
    CLEAN,
    TOTAL,
    SWING,
    ERROR,
    FLUX_ERROR,
    PART,
    FLEX,
    TRUE_BASE,
    TRUE_ATTITUDE,
    TRUE_RATE,
    TRUE_INERTIAL_RATE,
    TRUE_ACCELERATION,
    TRUE_VELOCITY,
    TRUE_ALTITUDE,
    TRUE_MSL,
    TRUE_AGL,
    TRUE_GROUND,
    TRUE_WIND,
    TRUE_CURRENT,
    TRUE_VOLTAGE,
    TRUE_SURFACE,
    TRUE_CARRIER_ATTITUDE,
    TRUE_CARRIER_RATE,
    TRUE_CARRIER_VELOCITY,
    TRUE_CARRIER_ALTITUDE,
    TRUE_ROPE_ANGLE,
    TRUE_ROPE_TENSION,
    TRUE_PRESSURE,
    TRUE_TEMPERATURE,
    CIRCUIT,
    LEG,
    TURN,
    TRANSIT,
    LEG_HEADING,
    MANEUVER,
    CYCLE,
    SPLIT,
)


@lru_cache(maxsize=4096)
def find(name: str) -> Family | None:
    """Return the family of a column name: the first of the table that matches; None if there is none."""
    return next((family for family in FAMILIES if family.match(name) is not None), None)


def family_of(name: str) -> Family:
    """Return the family of a column.

    Raises
    ------
    KeyError
        If no family has that name.
    """
    family = find(name)
    if family is None:
        msg = f"no column family has the name {name!r}"
        raise KeyError(msg)
    return family


def role_of(name: str) -> str:
    """Return the role of a column.

    Raises
    ------
    KeyError
        If no family has that name.
    """
    return family_of(name).role


def sensors_of(names: Iterable[str], family: Family) -> tuple[str, ...]:
    """Return the names of the sensors that have a column of a family, in order of appearance."""
    found = (family.match(name) for name in names)
    return tuple(dict.fromkeys(fields["sensor"] for fields in found if fields is not None))


def components_of(names: Iterable[str], sensor: str) -> tuple[str, ...]:
    """Return the parts of the field that have columns at a sensor, in the order of ``COMPONENTS``."""
    names = set(names)
    return tuple(c for c in COMPONENTS if PART.name(component=c, sensor=sensor, axis="x") in names)

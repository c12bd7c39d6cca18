"""Figures that texts quote: where they stand, and what they have to be."""

import math
import re
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from magsim.earth.atmosphere import standard_density
from magsim.flight.carriers.planning import MARGIN_S
from magsim.flight.tow.modes import modes
from magsim.flight.tow.setup import chain_of, require_equilibrium
from magsim.loading import LoadedScenario
from magsim.planning.geology import shortest_crust_m
from magsim.signals import BAND_HZ, HIGH_PASS_HZ
from magsim.units import FT, G0

NUMBER = re.compile(r"[+-]*\d[\d_]*(?:\.\d+)?")


class Quote(NamedTuple):
    """A phrase with a group for each of its figures, and what they are in a scenario that has the phrase."""

    phrase: str
    figures: Callable[[LoadedScenario], Sequence[float]]


def _modes(loaded: LoadedScenario) -> list[float]:
    """Frequencies of the tow's two swings and of the bird's yaw and pitch [Hz]."""
    scenario, tow, bird = loaded.scenario, loaded.scenario.tow, loaded.bird
    assert tow is not None
    assert bird is not None
    speed, density = scenario.start.speed_mps, float(standard_density(np.array(scenario.start.alt_m)))
    found = modes(chain_of(tow, bird), require_equilibrium(tow, bird, speed, density), speed, density)
    return sorted(mode.frequency_hz for mode in found if 0.0 < mode.frequency_hz < 1.0)


def _sway(loaded: LoadedScenario) -> list[float]:
    """Across, in height, along [m], heading [deg]."""
    sway = loaded.aircraft.facts.sway
    return [sway.lateral.value, sway.vertical.value, sway.along.value, sway.heading.value]


def _band(loaded: LoadedScenario) -> tuple[float, float]:
    return loaded.aircraft.facts.sway.band.value


def _amplitudes(loaded: LoadedScenario) -> list[float]:
    trains = loaded.scenario.pattern.maneuvers
    swings = [value for train in trains for value in train.amplitude_deg]
    return [min(swings), max(swings)]


def _by_hand(loaded: LoadedScenario) -> list[float]:
    """Amplitudes of roll, and of pitch and yaw [deg], periods [s], load factors [g], scatter of both [%]."""
    trains = loaded.scenario.pattern.maneuvers
    rolls = [value for train in trains if train.axis == "roll" for value in train.amplitude_deg]
    others = [value for train in trains if train.axis != "roll" for value in train.amplitude_deg]
    periods = [value for train in trains for value in train.period_s]
    ends = [end(values) for values in (rolls, others, periods) for end in (min, max)]
    (amplitude,) = {train.amplitude_scatter for train in trains}
    (period,) = {train.period_scatter for train in trains}
    return [*ends, *loaded.aircraft.limits.crew_load_factor.value, 100.0 * amplitude, 100.0 * period]


def _rope_and_mass(loaded: LoadedScenario) -> tuple[float, float]:
    chain = chain_of(loaded.scenario.tow, loaded.bird)
    return chain.body.mass_kg, chain.rope.length_m


def _apart(loaded: LoadedScenario) -> list[float]:
    sensors, mounts = loaded.scenario.sensors, loaded.aircraft.mounts
    return [math.dist(mounts[sensors.scalar[0].mount], mounts[sensors.fluxgate[0].mount])]


def _swing_g(loaded: LoadedScenario) -> list[float]:
    """An amplitude [deg], a period [s], and how far they swing the load factor [g]."""
    degrees, period = 15.0, 10.0
    return [degrees, period, loaded.scenario.start.speed_mps * math.radians(degrees) * 2.0 * math.pi / period / G0]


def _ground_m(loaded: LoadedScenario) -> float:
    terrain = loaded.scenario.terrain
    return terrain.height_m + terrain.geoid_m


def _crust(loaded: LoadedScenario) -> list[float]:
    scenario = loaded.scenario
    settings = scenario.field.crust
    shortest = shortest_crust_m(settings, scenario.start, scenario.air)
    return [shortest, scenario.start.speed_mps, BAND_HZ[1], settings.longest_m / 1000.0]


def _fom(loaded: LoadedScenario) -> tuple[float, float, float, float]:
    pattern = loaded.scenario.pattern
    return pattern.roll_deg, pattern.pitch_deg, pattern.yaw_deg, pattern.period_s


def _severities(loaded: LoadedScenario) -> list[float]:
    key = type(loaded.scenario.air).model_json_schema()["properties"]["turbulence_severity"]
    return [1.0, key["maximum"]]


QUOTES = (
    # places, lengths, times
    Quote(
        r"China Sea, (\S+) m, four legs of (\S+) km",
        lambda s: (s.scenario.start.alt_m, s.scenario.pattern.leg_m / 1000.0),
    ),
    Quote(
        r"orthogonal (\S+) km legs at (\S+) m",
        lambda s: (s.scenario.pattern.leg_m / 1000.0, s.scenario.start.alt_m),
    ),
    Quote(
        r"(?:straight part of each leg: |^)(\S+) s$",
        lambda s: [s.scenario.pattern.leg_m / s.scenario.start.speed_mps],
    ),
    Quote(r"(\S+) rows a second", lambda s: [s.scenario.recording.rate_hz]),
    Quote(r"two of them long, (\S+) km", lambda s: [2.0 * s.scenario.pattern.leaf_m / 1000.0]),
    Quote(r"within (\S+) s of the center", lambda s: [s.scenario.pattern.quiet_around_center_s]),
    Quote(r"^(\S+) m above the ground$", lambda s: [s.scenario.start.alt_m - _ground_m(s)]),
    Quote(r"start point, (\S+) m above the ground", lambda s: [s.scenario.sensors.base.height_m]),
    Quote(r"the ground is at (\S+) m", lambda s: [_ground_m(s)]),
    Quote(
        r"(\S+) m are (\S+) m above the ground",
        lambda s: (s.scenario.start.alt_m, s.scenario.start.alt_m - _ground_m(s)),
    ),
    Quote(
        r"^(\d+), (\d+), (\d+), (\d+) degrees$",
        lambda s: [
            (s.scenario.start.heading_deg + (-90.0 if s.scenario.pattern.turn == "left" else 90.0) * k) % 360.0
            for k in range(4)
        ],
    ),
    Quote(
        r"descent: (\S+) m/s at (\S+) m/s",
        lambda s: (s.scenario.pattern.climb_slope * s.scenario.start.speed_mps, s.scenario.start.speed_mps),
    ),
    Quote(
        r"a point (\S+) km north and east of the start, and a line home (\S+) m higher",
        lambda s: (
            s.scenario.pattern.parts[1].north_m / 1000.0,
            s.scenario.pattern.parts[2].alt_m - s.scenario.start.alt_m,
        ),
    ),
    Quote(r"the last (\S+) s of the file", lambda s: [MARGIN_S]),
    Quote(r"(\S+) m behind the scalar sensor", _apart),
    # maneuvers
    Quote(r"(?:maneuvers of|and roll of|amplitudes,) (\S+) to (\S+) degrees", _amplitudes),
    Quote(r"of the airframe \((\S+) to (\S+) g\)", lambda s: s.aircraft.limits.design_load_factor.value),
    Quote(r"(?:than the|flies) (\S+) to (\S+) g", lambda s: s.aircraft.limits.crew_load_factor.value),
    Quote(r"(\S+) degrees in (\S+) s is 1 \+- (\S+) g", _swing_g),
    Quote(r"of \+-(\S+) degrees of roll, \+-(\S+) of pitch and \+-(\S+) of yaw on each heading, (\S+) s a cycle", _fom),
    Quote(
        r"with (\S+), (\S+) and (\S+) degrees read as peak to peak: roll \+-(\S+), pitch \+-(\S+), yaw \+-(\S+)",
        lambda s: (*(2.0 * angle for angle in _fom(s)[:3]), *_fom(s)[:3]),
    ),
    Quote(
        r"of merit at (\S+) m: four headings, on each three yaws of \+-(\S+), three pitches of \+-(\S+) and three "
        r"rolls of \+-(\S+) degrees, (\S+) s for each",
        lambda s: (s.scenario.start.alt_m - _ground_m(s), *_fom(s)[2::-1], _fom(s)[3]),
    ),
    Quote(
        r"rolls of \+-(\S+), pitches and yaws of \+-(\S+) degrees, three of each, (\S+) s each",
        lambda s: (_fom(s)[0], _fom(s)[1], _fom(s)[3]),
    ),
    Quote(
        r"Rolls of (\S+) to (\S+), pitches and yaws of (\S+) to (\S+) degrees in (\S+) to (\S+) s, within (\S+) to "
        r"(\S+) g; the amplitude scatters by (\S+), the period by (\S+) percent",
        _by_hand,
    ),
    # air and ground
    Quote(r"(?:severity |^)(\d) to (\d)(?:$|, see)", _severities),
    Quote(r"a tenth of a wind of (\S+) m/s", lambda s: [10.0 * s.scenario.air.turbulence_mps]),
    Quote(r"above (\S+) ft the wind", lambda s: [s.scenario.air.shear.top_m / FT]),
    Quote(r"wavelengths from (\S+) m \((\S+) m/s over (\S+) Hz\) to (\S+) km", _crust),
    Quote(
        r"its top is (\S+) m deep",
        lambda s: [s.scenario.field.targets[0].depth_m - 0.5 * s.scenario.field.targets[0].height_m],
    ),
    # tow
    Quote(r"a rope of (\S+) m around", lambda s: [_rope_and_mass(s)[1]]),
    Quote(r"(\S+) kg on a rope of (\S+) m", _rope_and_mass),
    Quote(r"on a rope of (\S+) m at (\S+) m \(", lambda s: (_rope_and_mass(s)[1], s.scenario.start.alt_m)),
    Quote(
        r"swing at (\S+) Hz, pitch and yaw of the bird at (\S+) to (\S+) Hz", lambda s: (_modes(s)[0], *_modes(s)[2:])
    ),
    # bands
    Quote(r"[Ii]n (\S+) to (\S+) Hz on", lambda s: BAND_HZ),
    Quote(r"high-pass at (\S+) Hz", lambda s: [HIGH_PASS_HZ]),
)

PAGES = (
    ("docs/tow.md", "papers/002_straight", Quote(r"its file: (\S+), (\S+), (\S+) m", lambda s: _sway(s)[:3])),
    ("docs/tow.md", "papers/002_straight", Quote(r"its file: (\S+) deg", lambda s: _sway(s)[3:])),
    ("docs/tow.md", "papers/002_straight", Quote(r"noise from (\S+) to (\S+) Hz \(`band`", _band)),
    ("docs/tow.md", "papers/002_straight", Quote(r"swings at (\S+) and (\S+) Hz", lambda s: _modes(s)[:2])),
    (
        "docs/tow.md",
        "papers/002_straight",
        Quote(r"bird's yaw at (\S+) and its pitch at (\S+) Hz", lambda s: _modes(s)[2:]),
    ),
    (
        "aircraft/helicopter/README.md",
        "papers/002_straight",
        Quote(
            r"sway of (\S+) m sideways, (\S+) m up and down and along, (\S+) deg", lambda s: _sway(s)[:2] + _sway(s)[3:]
        ),
    ),
    ("aircraft/helicopter/README.md", "papers/002_straight", Quote(r"between (\S+) and (\S+) Hz", _band)),
)
"""Pages, the scenario that a figure is of, and the figure. More are held beside what they tell of."""

CITED = (
    # paper 000, table 2: STD after T-L and MagTCN; 1.320 nT times 12.276, the ratio of its worst method, before
    r"prints 0\.037 nT after Tolles-Lawson and 0\.024 nT after MagTCN; before compensation it is 16\.2 nT",
    r"section 3\.1\.1",
    r"section 3\.1\.2",
    # paper 001, section 3.1, tables 1 and 2
    r"Appl\. Sci\. 12 \(2022\) 10759, section 3\.1\.",
    r"STD of 2\.11 to 2\.33 nT; after a linear fit of the other flight 0\.36 \(least squares\)",
    r"and 0\.32 nT \(ridge\), after its network 0\.27",
    r"8 to 10 minutes",
    # paper 002, sections 2 and 3
    r"another section of the paper gives 1500 m",
    r"disturb by about 5 nT",
    # paper 004, landing page and Table 6
    r"J\. Geod\. Geoinf\. Sci\. 2021, 4\(4\), 74-83",
    r"STD of the raw data, (?:17\.8126|41\.1538|191\.8949|118\.0897) nT",
    # MIL-F-8785C: classes of turbulence, and the height of the wind that makes it
    r"\d calm|\d light|\d(?: to \d)? moderate|\d severe|\d extreme",
    r"at 6 m above the ground",
)
"""What others print, checked against them by reading."""

NAMES = (
    r"magsim [a-z]+ \S.*?(?=\s{2}|$)",
    r"tl16_gradient:\S+",
    r"[Pp]aper \d{3}",
    r"with 16 terms",
    r"lines? 1002\.02( and 1002\.20)?|lines 1002\.20 and 1006\.06|line 1006\.06",
    r"scalar magnetometer 5",
    r"circuit \d|of circuit \d",
    r"Circuits are counted on: 1 is the box, 2 the cloverleaf, 3 the line",
    r"\(1 - cos\) / 2",
    r"\[1, 3, 2, 4\]",
    r"0: calm",
)
"""Digits that are no figures: commands, names, formulas, examples of lists and settings."""


def comments(text: str) -> Iterator[str]:
    """Yield the comments of a TOML text: those behind keys alone, lines of their own joined to paragraphs."""
    paragraph: list[str] = []
    for line in [*text.splitlines(), ""]:
        if line.startswith("#") and len(line) > 1:
            paragraph.append(line[1:].strip() + ("  " if "magsim " in line else ""))
            continue
        if paragraph:
            yield " ".join(paragraph)
            paragraph = []
        if not line.startswith("#") and "#" in line:
            yield line.split("#", 1)[1].strip()


def rounds_to(value: float, printed: str) -> bool:
    """Whether a value is the printed figure at the digits that are printed."""
    text = printed.rstrip(".,:;").replace("_", "")
    decimals = len(text.partition(".")[2])
    return abs(value - float(text.removeprefix("+-"))) <= 0.5000001 * 10.0**-decimals

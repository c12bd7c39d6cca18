"""Load factors of pitch maneuvers."""

import math

from magsim.loading import load_scenario
from tests.support.scenarios import GOOD, problems


def test_loads_are_checked_on_every_leg(write):
    text = GOOD.replace("= 5.0", "= [5.0, 15.0]\nperiod_s = 4.0")
    (line,) = problems(write(text))
    swing = 75.0 * math.radians(15.0) * 2.0 * math.pi / 4.0 / 9.80665
    assert line.startswith(
        f"s.toml:16: pattern.maneuvers[0].amplitude_deg: 15 deg of pitch in 4 s swings from {1 - swing:.2f} to "
        f"{1 + swing:.2f} g at 75 m/s; allowed for c208b: -1.52 to 3.8 g"
    )


def test_what_no_crew_flies_must_be_allowed(write):
    text = GOOD.replace("= 5.0", "= 5.0\nperiod_s = 5.0")
    (line,) = problems(write(text))
    assert line == (
        "s.toml:16: pattern.maneuvers[0].amplitude_deg: 5 deg of pitch in 5 s swings from 0.16 to 1.84 g at 75 m/s; "
        "allowed for a crew: 0.2 to 1.8 g (a period of at least 5.3 s, a smaller amplitude, or allow_beyond_crew_g = "
        "true)"
    )
    # V A 2 pi / T = 0.8 g is 5.24 s: the period that is named is allowed, one a tenth below it is not.
    load_scenario(write(), ["pattern.maneuvers[0].period_s=5.3"])
    assert problems("s.toml", "pattern.maneuvers[0].period_s=5.2")
    load_scenario("s.toml", ["pattern.maneuvers[0].period_s=5", "pattern.allow_beyond_crew_g=true"])

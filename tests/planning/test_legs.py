"""Legs that are long enough for their maneuvers."""

import pytest

from magsim.loading import load_scenario
from tests.support.scenarios import GOOD, problems


def test_maneuvers_must_fit_into_their_leg(write):
    (line,) = problems(write(), "pattern.leg_m=1000")
    assert line == (
        "s.toml:14: pattern.maneuvers: leg 1 needs 39 s for its maneuvers, but a leg of 1000 m takes 13 s at 75 m/s; "
        "allowed: leg_m of at least 2930, or shorter trains"
    )


def test_the_legs_that_are_named_are_long_enough(write):
    needed = "leg_m of at least 2930"
    assert needed in problems(write(), "pattern.leg_m=1000")[0]
    load_scenario(write(), ["pattern.leg_m=2930"])
    assert problems("s.toml", "pattern.leg_m=2910")
    (line,) = problems("s.toml", "pattern.kind=cloverleaf", "pattern.leaf_m=3000", "pattern.maneuvers[0].cycles=12")
    leaf = float(line.split("leaf_m of at least ")[1].split(",")[0])
    overrides = ["pattern.kind=cloverleaf", "pattern.maneuvers[0].cycles=12"]
    load_scenario("s.toml", [*overrides, f"pattern.leaf_m={leaf}"])
    assert problems("s.toml", *overrides, f"pattern.leaf_m={leaf - 20.0}")


@pytest.mark.parametrize("leaf_m", [500.0, 2000.0, 3000.0])
def test_the_leaf_that_is_named_is_the_shortest(write, leaf_m):
    # How many trains fit before the center depends on the length, so a length that is enough need not be the shortest.
    text = GOOD.replace("amplitude_deg = 5.0", "amplitude_deg = 5.0\nperiod_s = 8.0")
    train = '[[pattern.maneuvers]]\naxis = "roll"\namplitude_deg = 8.0\nperiod_s = 5.0\n\n'
    write(text.replace("[[sensors", train + train.replace("roll", "yaw") + "[[sensors"))
    (line,) = problems("s.toml", "pattern.kind=cloverleaf", f"pattern.leaf_m={leaf_m}")
    leaf = float(line.split("leaf_m of at least ")[1].split(",")[0])
    load_scenario("s.toml", ["pattern.kind=cloverleaf", f"pattern.leaf_m={leaf}"])
    assert problems("s.toml", "pattern.kind=cloverleaf", f"pattern.leaf_m={leaf - 5.0}")


def test_checks_of_the_pattern_do_not_wait_for_the_sensors(write):
    found = problems(write(GOOD.replace('"cabin_center"', "3")), "pattern.leg_m=1000")
    assert [line.split(": ")[0] for line in found] == ["s.toml:14", "s.toml:20"]

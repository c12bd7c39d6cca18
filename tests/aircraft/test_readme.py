"""The aircraft's page prints what the aircraft's file gives."""

import re

import pytest

from magsim import assets, metrics
from magsim.aircraft import load_aircraft
from magsim.field import load_response
from tests.benchmarks import aircraft_modes, aircraft_performance
from tests.benchmarks.aircraft_levels import lines


def page(name: str = "c208b") -> str:
    return (assets.aircraft_dir(name) / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", assets.list_aircraft())
def test_levels_of_every_mount_are_those_of_the_response(name):
    aircraft = load_aircraft(name)
    printed = [line for line in page(name).splitlines() if re.match(rf"\| ({'|'.join(aircraft.mounts)}) \|", line)]
    # The page has one more column: what was published.
    assert ["|".join(line.split("|")[:-2]) + "|" for line in printed] == lines(load_response(aircraft))


def test_modes_are_those_of_the_linearization():
    printed = [line for line in page().splitlines() if re.match(r"\| \d+ m/s, ", line)]
    assert printed == aircraft_modes.lines(load_aircraft("c208b").facts, aircraft_modes.CONDITIONS["c208b"])


def test_performance_is_that_of_the_model():
    printed = [line for line in page().splitlines() if re.match(r"\| (top|fuel flow|best|service|stall)", line)]
    assert printed == aircraft_performance.lines(load_aircraft("c208b").facts)


def test_level_of_the_calibration_flight(calibration):
    said = float(re.search(r"center sees ([\d.]+) nT in 0\.1-0\.6 Hz", page())[1])
    assert abs(metrics.band_std(calibration["interference_cabin_nt"], calibration.rate_hz) - said) < 0.06

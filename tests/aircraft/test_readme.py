"""The page of an aircraft or a bird prints what its file gives."""

import re
from collections.abc import Iterable

import pytest

from magsim import assets
from magsim.aircraft import load_aircraft, load_bird
from magsim.field import load_response
from magsim.field.response import response_at
from tests.benchmarks import aircraft_modes
from tests.benchmarks.aircraft_levels import BELOW_M, lines, swing_lines, vehicle
from tests.support import scores


def page(name: str = "c208b") -> str:
    return (assets.ROOT / "aircraft" / name / "README.md").read_text(encoding="utf-8")


def rows(name: str, first: Iterable[str], columns: int) -> list[str]:
    """Lines of the page's tables with so many columns whose first one is among those given."""
    found = [line for line in page(name).splitlines() if re.match(rf"\| ({'|'.join(first)}) \|", line)]
    return [line for line in found if line.count("|") == columns + 1]


@pytest.mark.parametrize("name", [*assets.list_aircraft(), *assets.list_birds()])
def test_levels_of_every_mount_are_those_of_the_response(name):
    body = vehicle(name)
    printed = rows(name, body.mounts, 7)
    # The page has one more column: what was published.
    assert ["|".join(line.split("|")[:-2]) + "|" for line in printed] == lines(load_response(body))


@pytest.mark.parametrize("name", assets.list_birds())
def test_swing_of_every_mount_is_that_of_the_response(name):
    bird = load_bird(name)
    assert rows(name, bird.mounts, 5) == swing_lines(bird, load_response(bird))


def test_field_where_a_bird_hangs_is_that_of_the_response():
    helicopter = load_aircraft("helicopter")
    assert rows("helicopter", BELOW_M, 6) == lines(response_at(helicopter, BELOW_M))


def test_modes_are_those_of_the_linearization():
    printed = [line for line in page().splitlines() if re.match(r"\| \d+ m/s, ", line)]
    assert printed == aircraft_modes.lines(load_aircraft("c208b").facts, aircraft_modes.CONDITIONS["c208b"])


def test_level_of_the_calibration_flight(calibration):
    printed = float(re.search(r"center sees ([\d.]+) nT in 0\.1-0\.6 Hz", page())[1])
    assert abs(scores.band_std(calibration["interference_cabin_nt"], calibration.rate_hz) - printed) < 0.06

"""The Cessna beside what is published of it. No figure here has set a coefficient.

Sources: findaircraft.com/cessna-208 (208B, 675 shp, 8750 lb), planeandpilotmag.com (Caravan for the Jet Set, 2009),
bjtonline.com (Grand Caravan), twinandturbine.com (December 2011). The drag at zero lift was set by 184 knots at
10 000 ft, which is therefore not among them.
"""

import re

import pytest

from magsim import assets
from magsim.aircraft import Aircraft, Facts
from magsim.units import FT, LB
from tests.benchmarks.aircraft_performance import (
    FT_MIN,
    KNOT,
    Row,
    climb_rate,
    fuel_flow,
    lines,
    maximum_load,
    rows,
)


@pytest.fixture(scope="module")
def heavy(cessna: Aircraft) -> Facts:
    return maximum_load(cessna.facts)


@pytest.fixture(scope="module")
def table(cessna: Aircraft) -> list[Row]:
    """The table of the aircraft's page."""
    return rows(cessna.facts)


@pytest.fixture(scope="module")
def value(table: list[Row]) -> dict[str, float]:
    return {what: number for what, number, _, _ in table}


def test_maximum_load_is_the_certified_one(heavy: Facts) -> None:
    assert heavy.mass_kg / LB == pytest.approx(8750.0, abs=1.0)


@pytest.mark.parametrize("height_ft", [0.0, 5000.0, 15000.0, 20000.0])
def test_level_speed_at_other_heights_than_the_one_that_set_the_drag(value: dict[str, float], height_ft: float) -> None:
    # 171 knots of cruise and 175 of top speed (findaircraft.com, heights not given); 186 at most (in general use,
    # unsourced).
    assert 171.0 < value[f"top level speed, {height_ft:.0f} ft"] < 188.0


def test_climb(heavy: Facts) -> None:
    # 975 ft/min (findaircraft.com) to 1234 ft/min (general use, unsourced) at sea level.
    rate, speed = climb_rate(heavy, 20.0)
    assert 975.0 < rate / FT_MIN < 1234.0
    assert 85.0 < speed / KNOT < 115.0


def test_service_ceiling(value: dict[str, float]) -> None:
    # 25 000 ft is the certified limit (TCDS A37CE); the brochure of the lighter 208 says 27 600 ft.
    assert 25000.0 < value["service ceiling, 8750 lb"] < 29000.0


def test_fuel_flow(cessna: Aircraft) -> None:
    # 300 lb/h at 165 knots (planeandpilotmag.com); 50 to 55 gal/h at cruise (bjtonline.com), 6.7 lb/gal.
    slow, fast = (fuel_flow(cessna.facts, 10000.0 * FT, knots * KNOT) / LB * 3600.0 for knots in (165.0, 182.0))
    assert slow == pytest.approx(300.0, rel=0.1)
    assert 335.0 < fast < 380.0


def test_stall(value: dict[str, float]) -> None:
    # 61 knots with flaps (findaircraft.com, twinandturbine.com); about 75 to 78 without (general use, unsourced).
    assert value["stall, flaps 30, 8750 lb"] == pytest.approx(61.0, rel=0.05)
    assert value["stall, flaps up, 8750 lb"] == pytest.approx(76.5, rel=0.05)


def test_the_page_of_the_aircraft_shows_the_results_of_the_model(table: list[Row]) -> None:
    page = (assets.ROOT / "aircraft" / "c208b" / "README.md").read_text(encoding="utf-8")
    printed = [line for line in page.splitlines() if re.match(r"\| (top|fuel flow|best|service|stall)", line)]
    assert printed == lines(table)

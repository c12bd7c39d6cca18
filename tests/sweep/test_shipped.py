"""The shipped sweeps: what they say is what they fly."""

import pytest

from magsim import assets
from magsim import sweep as room
from magsim.errors import RequestError
from magsim.loading import load_scenario

FLIGHTS = {
    "sweeps/air": 80,
    "sweeps/maneuvers": 96,
    "sweeps/places_and_dates": 512,
    "sweeps/population": 200,
    "sweeps/virtual_aircraft": 1000,
    "tuning/levels": 18,
    "tuning/paper_000": 3,
}


@pytest.mark.parametrize("name", FLIGHTS)
def test_their_flights_can_be_flown(name: str) -> None:
    plan = room.read_sweep(name)
    assert room.check(plan, 12) == []
    _, count = room.ranges(plan)
    assert count == FLIGHTS[name]


def test_all_are_listed_and_are_no_scenarios() -> None:
    assert assets.list_sweeps() == tuple(sorted(FLIGHTS))
    assert set(FLIGHTS).isdisjoint(assets.list_scenarios())
    with pytest.raises(RequestError, match=r"is a sweep of many flights \(\[sweep\]\); magsim sweep flies them"):
        load_scenario("sweeps/air")


def test_every_virtual_aircraft_is_another_one_elsewhere() -> None:
    plan = room.read_sweep("sweeps/virtual_aircraft")
    flights = list(plan.space.flights(0, 1000))
    assert {flight.values["individual"] for flight in flights} == set(range(1, 1001))
    assert len({flight.values["start.lat_deg"] for flight in flights}) == 1000
    words = [plan.split(flight.flown) for flight in flights]
    assert 60 < words.count("valid") < 140
    assert 60 < words.count("test") < 140

"""The flights of a sweep: numbers, order, and what stays the same."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from scipy.stats import qmc

from magsim.sweep.settings import SweepSettings
from magsim.sweep.space import Space, SweptFlight

ALTITUDE = {"key": "start.alt_m", "uniform": [300, 3000]}
HEADING = {"key": "start.heading_deg", "grid": {"from": 0.0, "to": 270.0, "step": 90.0}}
INDIVIDUAL = {"key": "individual", "grid": {"from": 1, "to": 3}}
NOISE = {"key": "sensors.scalar[0].noise_nt_rthz", "log_uniform": [0.001, 0.1]}
SPEED = {"key": "start.speed_mps", "normal": [70.0, 5.0], "limits": [60.0, 80.0]}


def space(*axes: dict, **settings: object) -> Space:
    """Return the flights of a sweep with some axes."""
    table = {"axes": [dict(axis) for axis in axes], **settings}
    read = SweepSettings.model_validate(table)
    return Space(read, [list(axis.key) for axis in read.axes])


def by_number(found: Space) -> dict[int, SweptFlight]:
    """Return all flights by number."""
    return {flight.number: flight for flight in found.flights(0, found.count)}


@pytest.mark.parametrize("sampling", ["random", "sobol", "latin_hypercube"])
def test_more_flights_and_one_more_axis_leave_what_was_there(sampling: str) -> None:
    axes = (ALTITUDE, INDIVIDUAL, NOISE)
    before = by_number(space(*axes, flights=300, sampling=sampling))
    more = by_number(space(*axes, flights=6000, sampling=sampling))
    wider = by_number(space(*axes, SPEED, HEADING, flights=1200, sampling=sampling))
    assert len(before) == 300
    for number, flight in before.items():
        assert more[number] == flight
        assert wider[number].flown == flight.flown
        assert {name: wider[number].values[name] for name in flight.values} == flight.values
    assert wider[0].values["start.heading_deg"] == 0.0


@pytest.mark.parametrize("sampling", ["random", "sobol", "latin_hypercube"])
def test_a_flight_alone_is_the_flight_among_all(sampling: str) -> None:
    found = space(ALTITUDE, HEADING, INDIVIDUAL, NOISE, flights=9600, sampling=sampling)
    whole = list(found.flights(0, 9600))
    for place in (0, 1, 2047, 4095, 4096, 9599):
        assert list(found.flights(place, place + 1)) == [whole[place]]


@given(
    st.lists(st.tuples(st.integers(1, 4), st.booleans()), min_size=1, max_size=4), st.integers(1, 3), st.integers(1, 3)
)
def test_every_number_has_one_place_and_those_of_one_flight_stand_together(
    grids: list[tuple[int, bool]], dressings: int, rounds: int
) -> None:
    axes = [
        {"key": f"{'sensors' if dresses else 'start'}.x{i}", "grid": list(range(size))}
        for i, (size, dresses) in enumerate(grids)
    ]
    size = dressings * math.prod(size for size, _ in grids)
    found = list(space(*axes, dressings=dressings, flights=size * rounds).flights(0, size * rounds))
    assert sorted(flight.number for flight in found) == list(range(size * rounds))
    order = [flight.flown for flight in found]
    assert order == sorted(order)
    assert len({(flight.flown, *flight.values.items()) for flight in found}) * dressings == len(found)
    for flight in found:
        # the digits of its number, the first axis fastest
        rest = flight.number // dressings
        for axis in axes:
            rest, digit = divmod(rest, len(axis["grid"]))
            assert flight.values[axis["key"]] == digit


def test_what_dresses_does_not_change_what_is_flown() -> None:
    found = list(space(ALTITUDE, INDIVIDUAL, NOISE, HEADING, flights=120).flights(0, 120))
    groups: dict[int, list[SweptFlight]] = {}
    for flight in found:
        groups.setdefault(flight.flown, []).append(flight)
    assert len(groups) == 40
    for group in groups.values():
        assert len({(f.values["start.alt_m"], f.values["start.heading_deg"]) for f in group}) == 1
        assert len({f.values["sensors.scalar[0].noise_nt_rthz"] for f in group}) == 3
        assert {f.values["individual"] for f in group} == {1, 2, 3}


@pytest.mark.parametrize("sampling", ["random", "sobol", "latin_hypercube"])
def test_distributions_are_those_asked_for(sampling: str) -> None:
    count = 4000
    columns = space(ALTITUDE, NOISE, SPEED, flights=count, sampling=sampling).columns(
        np.arange(count), np.arange(count)
    )
    low, high = -2.0, 2.0
    expected = {
        "start.alt_m": stats.uniform(300, 2700),
        "sensors.scalar[0].noise_nt_rthz": stats.loguniform(0.001, 0.1),
        "start.speed_mps": stats.truncnorm(low, high, 70.0, 5.0),
    }
    for name, distribution in expected.items():
        assert stats.kstest(columns[name], distribution.cdf).pvalue > 1e-3, name
    pair = [stats.rankdata(columns[name]) for name in ("start.alt_m", "start.speed_mps")]
    assert abs(np.corrcoef(pair)[0, 1]) < 4.0 / math.sqrt(count)


def test_whole_numbers_are_as_likely_at_the_ends() -> None:
    axes = ({"key": "day", "uniform": [1, 4], "whole": True}, {"key": "start.x", "normal": [0, 1], "whole": True})
    columns = space(*axes, flights=8000).columns(np.arange(8000), np.arange(8000))
    values, counts = np.unique(columns["day"], return_counts=True)
    assert values.tolist() == [1, 2, 3, 4]
    assert stats.chisquare(counts).pvalue > 1e-3
    assert all(isinstance(value, int) for value in columns["start.x"])
    share = np.mean(np.array(columns["start.x"]) == 0)
    exact = stats.norm.cdf(0.5) - stats.norm.cdf(-0.5)
    assert abs(share - exact) < 4.0 * math.sqrt(exact * (1 - exact) / 8000)


def test_sobol_points_fill_the_square_as_scipys_do() -> None:
    axes = ({"key": "start.x", "uniform": [0, 1]}, {"key": "start.y", "uniform": [0, 1]})
    found = space(*axes, flights=1024, sampling="sobol").columns(np.arange(1024), np.arange(1024))
    points = np.column_stack([found["start.x"], found["start.y"]])
    # a digital shift keeps the net: one point in each elementary interval of 1/1024
    for first in range(11):
        cells = np.floor(points * [2**first, 2 ** (10 - first)]).astype(int)
        assert len(np.unique(cells, axis=0)) == 1024
    random = np.random.default_rng(0).random((1024, 2))
    assert qmc.discrepancy(points) < 0.1 * qmc.discrepancy(random)


def test_each_block_is_a_latin_hypercube() -> None:
    found = space(ALTITUDE, flights=300, sampling="latin_hypercube", block=100)
    values = np.array(found.columns(np.arange(300), np.arange(300))["start.alt_m"])
    for block in values.reshape(3, 100):
        assert sorted(np.floor((block - 300.0) / 27.0)) == list(range(100))


def test_lists_go_together_and_are_crossed_with_grids() -> None:
    lists = ({"key": "start.x", "list": [1, 2]}, {"key": "start.y", "list": [10, 20]})
    found = list(space(*lists, HEADING).flights(0, 8))
    assert [(f.values["start.x"], f.values["start.y"]) for f in found] == [(1, 10), (2, 20)] * 4
    tables = {"list": [{"aircraft": "c208b", "start.speed_mps": 70}, {"aircraft": "drone", "start.speed_mps": 22}]}
    assert [f.values for f in space(tables).flights(0, 2)] == tables["list"]


def test_dates_are_drawn_between_dates() -> None:
    from datetime import UTC, datetime

    bounds = [datetime(2015, 1, 1, tzinfo=UTC), datetime(2025, 1, 1, tzinfo=UTC)]
    found = space({"key": "start.time_utc", "uniform": bounds}, flights=500).columns(np.arange(500), np.arange(500))
    dates = found["start.time_utc"]
    assert all(bounds[0] <= date <= bounds[1] for date in dates)
    share = [(date - bounds[0]) / (bounds[1] - bounds[0]) for date in dates]
    assert stats.kstest(share, "uniform").pvalue > 1e-3


def test_flights_count_themselves() -> None:
    found = {f.number: f for f in space({"key": "individual", "number": 1}, HEADING, flights=12).flights(0, 12)}
    assert [found[number].values["individual"] for number in range(12)] == list(range(1, 13))


def test_flights_may_differ_in_their_seeds_alone() -> None:
    assert [flight.number for flight in space(flights=5).flights(0, 5)] == [0, 1, 2, 3, 4]

"""Sway of a kinematic carrier: spread, band, direction, independence of rates."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.signal import welch

from magsim.aircraft import Aircraft
from magsim.earth import rot_ne_at
from magsim.flight import fly
from magsim.flight.carriers.sway import sway
from magsim.scenario import Scenario
from tests.support.helicopters import LINE, SPEED_MPS, WIND, places, through_air

ScenarioOf = Callable[..., Scenario]


def test_sway_has_its_spread_and_its_band() -> None:
    """Eleven hours: 0.23 Hz of noise have 18 000 degrees of freedom, a spread of 0.5 % for the standard deviation."""
    low, high = 0.02, 0.25
    time = np.arange(0.0, 40_000.0, 0.5)
    moved = sway(time, (0.5, 2.0), (low, high), 7)
    np.testing.assert_allclose(moved.std(axis=0), [0.5, 2.0], rtol=0.025)
    assert np.abs(moved.mean(axis=0)).max() < 0.01
    assert abs(np.corrcoef(moved.T)[0, 1]) < 0.04
    frequency, power = welch(moved[:, 0], 2.0, nperseg=4096)
    inside = (frequency > 0.5 * low) & (frequency < 2.0 * high)
    assert power[~inside].sum() < 0.01 * power.sum()

    def near(hertz: float) -> float:
        return power[np.abs(frequency / hertz - 1.0) < 0.12].mean()

    # Forward and backward, the edges of the band keep a quarter of the power of the middle.
    for edge in (low, high):
        assert near(edge) == pytest.approx(0.25 * near(0.07), rel=0.25)


def test_a_flight_sways_by_its_settings(helicopter_scenario: ScenarioOf, helicopter: Aircraft) -> None:
    """Over 12 minutes and three seeds, across the line and in height."""
    spreads = []
    for seed in (1, 2, 3):
        settings = {"sway": {"lateral_m": 1.5, "vertical_m": 0.25}}
        flight = fly(helicopter_scenario(LINE | {"leg_m": 20_000.0}, seed=seed, flight=settings), helicopter)
        rows = (flight.carrier.time_s > 0.0) & (flight.carrier.time_s < flight.duration_s)
        path = places(flight.carrier)[rows]
        ahead = (path[-1] - path[0]) / np.linalg.norm(path[-1] - path[0])
        right = np.cross(-path[0] / np.linalg.norm(path[0]), ahead)
        spreads.append((np.std(path @ right), np.std(flight.carrier.alt_m[rows])))
        assert (flight.notes["sway_lateral_m"], flight.notes["sway_vertical_m"]) == (1.5, 0.25)
    lateral, vertical = np.sqrt(np.mean(np.square(spreads), axis=0))
    assert lateral == pytest.approx(1.5, rel=0.15)
    assert vertical == pytest.approx(0.25, rel=0.15)


def test_sway_moves_across_the_line_and_leaves_the_airspeed_along_it(
    helicopter_scenario: ScenarioOf, helicopter: Aircraft
) -> None:
    """Along a line to the north the ground speed is that of the wind triangle, whatever the sway."""
    flight = fly(helicopter_scenario(LINE | {"leg_m": 3000.0}, air=WIND, flight={}), helicopter)
    along = math.sqrt(SPEED_MPS**2 - 8.0**2) + 5.0
    np.testing.assert_allclose(flight.carrier.velocity_n[:, 0], along, rtol=0, atol=1e-4)
    # Across it, the velocity is the derivative of the sway.
    east, up = flight.carrier.velocity_n[:, 1], -flight.carrier.velocity_n[:, 2]
    path = places(flight.carrier)
    inner, to_n = slice(1, -1), rot_ne_at(flight.carrier.lat_rad, flight.carrier.lon_rad)
    moved = np.einsum("nij,nj->ni", to_n[inner], (path[2:] - path[:-2]) * flight.carrier.rate_hz / 2.0)
    assert np.abs(moved[:, 1] - east[inner]).max() < 2e-3
    assert 0.1 < np.std(east) < 1.0
    assert 0.1 < np.std(up) < 1.0
    off = np.abs(np.linalg.norm(through_air(flight), axis=1) - SPEED_MPS)
    assert 0.01 < off.max() < np.hypot(east, up).max()


def test_sway_is_the_same_whatever_rate_and_length(helicopter_scenario: ScenarioOf, helicopter: Aircraft) -> None:
    tables = [
        {"flight": {}},
        {"flight": {"log_hz": 60}},
        {"flight": {"step_hz": 240, "log_hz": 20}},
    ]
    flights = [fly(helicopter_scenario(LINE, **table), helicopter) for table in tables]
    flights.append(fly(helicopter_scenario(LINE | {"leg_m": 2000.0}, flight={}), helicopter))
    common = np.arange(-3.0, 20.0, 0.5)
    first, *others = (places(flight.carrier.at(common)) for flight in flights)
    for other in others:
        np.testing.assert_allclose(other, first, rtol=0, atol=1e-4)
    moved = places(fly(helicopter_scenario(LINE, flight={}, seed=2), helicopter).carrier.at(common))
    assert np.abs(moved - first).max() > 0.2

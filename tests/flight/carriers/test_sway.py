"""Sway of a kinematic carrier: spread, spectrum, what attitude follows from it, independence of rates."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.signal import coherence, welch

from magsim.aircraft import Aircraft
from magsim.earth import rot_ne_at
from magsim.flight import fly
from magsim.flight.carriers.sway import SwaySize, sway
from magsim.scenario import Scenario
from magsim.units import G0
from tests.benchmarks.realism_rows.helicopter import ROLL_RMS_DEG, ROW_HZ, WINDOW, flown
from tests.support.helicopters import LINE, SPEED_MPS, WIND, places, through_air
from tests.support.lateral import FREQUENCIES_HZ, PILOTS, on_a_line, weighted

ScenarioOf = Callable[..., Scenario]
BAND_HZ = (0.05, 0.40)


def departure_power(at_hz: np.ndarray, turns: int) -> np.ndarray:
    """Power density of unit white noise through the low passes: twice the line's for a place, once for the heading."""
    low, high = BAND_HZ
    return (1.0 + (at_hz / low) ** 2) ** -turns / (1.0 + (at_hz / high) ** 4) ** 2


def test_sway_has_its_spread_and_its_spectrum() -> None:
    """Eleven hours: a tenth of a hertz of noise has 8000 degrees of freedom, a spread of 0.8 % for the deviation."""
    size = SwaySize(0.7, 0.5, 2.0, 0.02)
    moved = sway(np.arange(0.0, 40_000.0, 0.5), size, BAND_HZ, 7)
    np.testing.assert_allclose(moved.std(axis=0), size, rtol=0.04)
    assert (np.abs(moved.mean(axis=0)) < 0.05 * np.array(size)).all()
    assert np.abs(np.corrcoef(moved.T) - np.eye(4)).max() < 0.06
    every = np.linspace(1e-4, 5.0, 100_000)
    for k, order in ((0, 2), (1, 2), (2, 2), (3, 1)):
        frequency, power = welch(moved[:, k], 2.0, nperseg=1024)
        inside = (frequency > 0.02) & (frequency < 0.5)
        expected = size[k] ** 2 * departure_power(frequency, order) / np.trapezoid(departure_power(every, order), every)
        # 78 segments, averaged over eight frequencies: 4 %
        off = (power[inside] / expected[inside])[: inside.sum() // 8 * 8].reshape(-1, 8).mean(axis=1)
        np.testing.assert_allclose(off, 1.0, atol=0.15)


@pytest.mark.parametrize("pilot", [pilot for pilot in PILOTS if pilot.cyclic_noise])
@pytest.mark.parametrize("gust_mps", [0.5, 1.0])
def test_the_roll_spectrum_is_that_of_published_derivatives(gust_mps: float, pilot: tuple) -> None:
    """The share of the roll's power in octaves: bank is the second derivative of the place, over g."""
    edges = [0.0, 0.1, 0.2, 0.4, 3.0]
    reference = on_a_line(gust_mps, pilot)
    bank = departure_power(FREQUENCIES_HZ, 2) * FREQUENCIES_HZ**4

    def shares(power: np.ndarray) -> np.ndarray:
        parts = [
            np.trapezoid(np.where(np.digitize(FREQUENCIES_HZ, edges) == k, power, 0.0), FREQUENCIES_HZ)
            for k in range(1, len(edges))
        ]
        return np.array(parts) / sum(parts)

    np.testing.assert_allclose(shares(bank), shares(reference.roll_power), rtol=0, atol=0.1)


def test_a_line_is_held_as_crews_hold_it() -> None:
    """Roll, its rate and how the heading goes with it, over two lines of 5 minutes, beside published derivatives."""
    lines = [flown(seed, 8000.0) for seed in (11, 12)]
    roll = math.sqrt(np.mean([np.var(line.roll) for line in lines]))
    assert ROLL_RMS_DEG[0] < roll < ROLL_RMS_DEG[1]
    reference = [on_a_line(gust, pilot) for gust in (0.5, 1.0, 1.5) for pilot in PILOTS]
    with_hands = [line for line, pilot in zip(reference, PILOTS * 3, strict=True) if pilot.cyclic_noise]
    assert min(line.roll_deg for line in with_hands) < roll < max(line.roll_deg for line in with_hands)
    rate = math.sqrt(np.mean([np.var(line.roll_rate) for line in lines]))
    assert rate < max(line.roll_rate_dps for line in with_hands)
    assert rate > 0.8 * min(line.roll_rate_dps for line in with_hands)
    for line in lines:
        at, power = welch(line.roll, ROW_HZ, nperseg=WINDOW)
        together = weighted(at, coherence(line.roll, line.heading, ROW_HZ, nperseg=WINDOW)[1], power)
        assert min(r.coherence for r in reference) < together < max(r.coherence for r in reference)


@pytest.mark.parametrize("air", [{}, WIND])
def test_the_nose_follows_the_bank(helicopter_scenario: ScenarioOf, helicopter: Aircraft, air: dict) -> None:
    """Without sideslip the turn rate is g tan(roll) / V; gusts and pedals turn the nose by an angle beside it."""
    rates, sway_off = [], {"vertical_m": 0.0, "along_m": 0.0}
    for nose in (0.0, 1.0):
        settings = {"sway": sway_off | {"heading_deg": nose}}
        flight = fly(helicopter_scenario(LINE | {"leg_m": 6000.0}, air=air, flight=settings), helicopter)
        heading = np.unwrap(flight.carrier.attitude[:, 2])
        rate = np.gradient(heading, flight.carrier.time_s)[5:-5]
        turn = G0 * np.tan(flight.carrier.attitude[5:-5, 0]) / SPEED_MPS
        rates.append(heading)
        if nose == 0.0:
            # the airspeed differs from its mean by the sway, gravity from its standard by latitude and height
            assert np.abs(rate - turn).max() < 0.02 * np.abs(turn).max()
            assert np.degrees(np.std(heading)) == pytest.approx(0.57, rel=0.3)
            # sideslip: the nose is where the air comes from
            north, east, _ = through_air(flight).T
            assert np.abs(np.unwrap(np.arctan2(east, north)) - heading).max() < 1e-6
    assert np.degrees(np.std(rates[1] - rates[0])) == pytest.approx(1.0, rel=0.3)


def test_a_flight_sways_by_its_settings(helicopter_scenario: ScenarioOf, helicopter: Aircraft) -> None:
    """Over 12 minutes and three seeds, across the line and in height."""
    spreads = []
    for seed in (1, 2, 3):
        settings = {"sway": {"lateral_m": 1.5, "vertical_m": 0.25, "along_m": 0.0, "heading_deg": 0.5}}
        flight = fly(helicopter_scenario(LINE | {"leg_m": 20_000.0}, seed=seed, flight=settings), helicopter)
        rows = (flight.carrier.time_s > 0.0) & (flight.carrier.time_s < flight.duration_s)
        path = places(flight.carrier)[rows]
        ahead = (path[-1] - path[0]) / np.linalg.norm(path[-1] - path[0])
        right = np.cross(-path[0] / np.linalg.norm(path[0]), ahead)
        spreads.append((np.std(path @ right), np.std(flight.carrier.alt_m[rows])))
        assert [flight.notes[f"sway_{name}"] for name in ("along_m", "lateral_m", "vertical_m")] == [0.0, 1.5, 0.25]
        assert flight.notes["sway_heading_deg"] == pytest.approx(0.5)
    lateral, vertical = np.sqrt(np.mean(np.square(spreads), axis=0))
    assert lateral == pytest.approx(1.5, rel=0.15)
    assert vertical == pytest.approx(0.25, rel=0.15)


def test_sway_across_the_line_leaves_the_speed_along_it(helicopter_scenario: ScenarioOf, helicopter: Aircraft) -> None:
    """Along a line to the north the ground speed is that of the wind triangle, whatever the sway across it."""
    settings = {"sway": {"along_m": 0.0}}
    flight = fly(helicopter_scenario(LINE | {"leg_m": 3000.0}, air=WIND, flight=settings), helicopter)
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


def test_sway_along_the_line_is_speed_and_pitch(helicopter_scenario: ScenarioOf, helicopter: Aircraft) -> None:
    """The speed along a line to the north differs by the sway's, and the rotor tilts forward to gain it."""
    flights = []
    for along in (0.0, 2.0):
        settings = {"sway": {"along_m": along, "lateral_m": 0.0, "vertical_m": 0.0, "heading_deg": 0.0}}
        flights.append(fly(helicopter_scenario(LINE | {"leg_m": 6000.0}, flight=settings), helicopter))
    still, moving = flights
    speed = moving.carrier.velocity_n[:, 0] - still.carrier.velocity_n[:, 0]
    # a place of 2 m that is even up to 0.05 Hz and falls with the fourth power: 2 pi 0.05 Hz 2 m in speed
    assert np.std(speed) == pytest.approx(2.0 * math.pi * 0.05 * 2.0, rel=0.3)
    gain = np.gradient(speed, moving.carrier.time_s)[5:-5]
    tilt = (moving.carrier.attitude[:, 1] - still.carrier.attitude[:, 1])[5:-5]
    np.testing.assert_allclose(-G0 * np.tan(tilt), gain, rtol=0, atol=0.02 * np.abs(gain).max())


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
    turned = [flight.carrier.at(common).attitude for flight in flights]
    for other in turned[1:]:
        assert np.degrees(np.abs(other - turned[0])).max() < 0.01
    moved = places(fly(helicopter_scenario(LINE, flight={}, seed=2), helicopter).carrier.at(common))
    assert np.abs(moved - first).max() > 0.2

"""Errors between the rows of the log and between the steps, with the bounds of the benchmark of speed."""

from magsim.aircraft import Aircraft, load_aircraft
from magsim.flight import fly
from magsim.loading import load_scenario
from tests.benchmarks.flight_speed import LOW, MEMORY, interpolation_error_deg, memory_growth_mb, rate_convergence_deg


def test_a_moderate_log_carries_the_attitude_in_turbulence(cessna: Aircraft) -> None:
    coarse, fine = (interpolation_error_deg(cessna, log_hz, seeds=1) for log_hz in (10, 30))
    assert fine < 0.002
    # More rows, less error: what is measured is the interpolation.
    assert fine < 0.3 * coarse


def test_a_nimble_aircraft_has_a_faster_log_for_that() -> None:
    drone = load_aircraft("uav")
    fast = interpolation_error_deg(drone, seeds=1, place=LOW)
    assert fast < 0.002
    assert interpolation_error_deg(drone, 30, seeds=1, place=LOW) > 2.0 * fast


def test_the_step_rate_has_converged(cessna: Aircraft) -> None:
    assert 0.001 < rate_convergence_deg(cessna) < 0.05


def test_flights_leave_no_memory_behind() -> None:
    loaded = load_scenario("calibration_c208b")
    if MEMORY.exists():
        assert memory_growth_mb(loaded, 10) < 5.0


def test_gusty_weather_is_flown_as_it_is_shipped() -> None:
    loaded = load_scenario("gusty_c208b", ["pattern.circuits=1"])
    flight = fly(loaded.scenario, loaded.aircraft)
    assert all(abs(leg.length_m - loaded.scenario.pattern.leg_m) < 50.0 for leg in flight.segments if not leg.turn)
    assert max(flight.notes["closure_m"]) < 50.0
    for train in flight.maneuvers:
        assert abs(train.flown_deg - train.asked_deg) < 2.0

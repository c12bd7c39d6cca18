"""The figures that a calibration flight must reach, on the shipped scenarios themselves.

The whole of them, with networks and speed, is printed by the commands in ``tests/benchmarks``.
"""

from dataclasses import replace

import numpy as np
import pytest

from magsim import assets, columns, signals
from magsim.compensation import TollesLawson
from magsim.compensation.solvers import ridge
from magsim.field import compute_field
from magsim.flight import fly
from magsim.generation.comparison import Reference
from magsim.generation.description import samples
from magsim.loading import load_scenario
from magsim.simulation import record, simulate
from tests.benchmarks.compensation_accuracy import (
    CEILING,
    LINEAR_WORLD,
    PAPER_TL_NT,
    error_std,
    fitted,
    linear_residuals,
)
from tests.benchmarks.flight_accuracy import closures_m
from tests.support import scores


@pytest.fixture(scope="module")
def flight():
    loaded = load_scenario("calibration_c208b_calm")
    return fly(loaded.scenario, loaded.aircraft)


def test_legs_are_10_km_within_100_m(flight):
    legs = [segment.length_m for segment in flight.segments if not segment.turn]
    assert len(legs) == 8
    assert max(abs(length - 10_000.0) for length in legs) < 100.0


def test_legs_are_orthogonal_and_straight(flight):
    for segment in flight.segments:
        if not segment.turn:
            ends = flight.carrier.at(np.array([segment.start_s, segment.stop_s]))
            north = np.diff(ends.lat_rad)[0]
            east = np.diff(ends.lon_rad)[0] * np.cos(ends.lat_rad.mean())
            course = np.degrees(np.arctan2(east, north)) % 360.0
            assert abs((course - segment.heading_deg + 180.0) % 360.0 - 180.0) < 1.0


def test_the_propeller_is_logged_as_governed(flight):
    speed = flight.rotors["propeller"] * 30.0 / np.pi
    assert speed.shape == flight.carrier.time_s.shape
    assert np.abs(speed - 1900.0).max() < 10.0
    assert np.std(speed) > 0.01


def test_both_circuits_close(flight):
    assert max(closures_m(flight, 2)) < 100.0


def test_every_maneuver_is_flown_within_half_a_degree(flight):
    assert len(flight.maneuvers) == 24
    for maneuver in flight.maneuvers:
        assert 5.0 <= maneuver.asked_deg <= 15.0
        assert abs(maneuver.flown_deg - maneuver.asked_deg) < 0.5


def test_maneuver_amplitudes_are_in_the_recorded_attitude(calibration):
    """The sine fit by another road: half of peak to peak of the recorded true angle over whole cycles."""
    angles = {"pitch": "true_pitch_deg", "roll": "true_roll_deg", "yaw": "true_heading_deg"}
    for maneuver in calibration.meta["maneuvers"]:
        rows = (calibration.time_s >= maneuver["start_s"]) & (calibration.time_s <= maneuver["stop_s"])
        angle = np.degrees(np.unwrap(np.radians(calibration[angles[maneuver["axis"]]][rows])))
        half = 0.5 * (np.quantile(angle, 0.97) - np.quantile(angle, 0.03))
        assert half == pytest.approx(maneuver["asked_deg"], rel=0.12), maneuver


def test_no_row_is_non_finite(calibration, paper_world):
    for recording in (calibration, paper_world):
        assert all(np.isfinite(column).all() for column in recording.data.values())


def test_raw_interference_in_band_is_that_of_a_cabin(calibration):
    std = scores.band_std(calibration[columns.INTERFERENCE.name(sensor="cabin")], calibration.rate_hz)
    assert 10.0 <= std <= 25.0


def test_raw_interference_in_band_is_that_of_a_rear_ceiling(flight):
    loaded = load_scenario("calibration_c208b_calm", CEILING)
    truth = compute_field(loaded.scenario, loaded.aircraft, flight)
    label = record(loaded, flight, {"carrier": truth})[columns.INTERFERENCE.name(sensor="ceiling")]
    assert 8.0 <= scores.band_std(label, loaded.scenario.recording.rate_hz) <= 25.0


def test_tolles_lawson_leaves_what_paper_000_prints_within_a_factor_of_5(paper_world):
    test = paper_world.where(split="test")
    std = error_std(test, fitted(paper_world, TollesLawson(terms=16)).interference(test.blind()))
    assert PAPER_TL_NT / 5.0 <= std <= PAPER_TL_NT * 5.0


@pytest.mark.parametrize("scale", ["constant", "sample"])
def test_eighteen_terms_do_not_lose_to_sixteen(paper_world, scale):
    """Fluxgate beside the sensor: row by row, the sum of u_i u_i B is the reading, and 18 terms ate 95 % of it."""
    test = paper_world.where(split="test")
    params = {"target": "measured", "scale": scale}
    sixteen, eighteen = (
        error_std(test, fitted(paper_world, TollesLawson(terms=terms, **params)).interference(test.blind()))
        for terms in (16, 18)
    )
    assert eighteen < 1.02 * sixteen


def test_gradient_terms_do_not_lose_on_an_airplane_that_has_none(calibration):
    """Free, those of order 3 take errors of Tolles-Lawson in the turns: 0.266 nT are left instead of 0.243."""
    test = calibration.where(split="test")
    plain, height, beside = (
        error_std(test, fitted(calibration, TollesLawson(target="measured", **params)).interference(test.blind()))
        for params in ({}, {"vertical": True}, {"vertical": True, "order": 3})
    )
    assert beside < plain
    assert beside < 1.02 * height


def test_linear_world_is_fitted_to_the_numerical_floor():
    loaded = load_scenario("papers/000_simulated", overrides=LINEAR_WORLD)
    flown = fly(loaded.scenario, loaded.aircraft)
    truth = compute_field(loaded.scenario, loaded.aircraft, flown)
    residuals = linear_residuals(truth, record(loaded, flown, {"carrier": truth}))
    assert residuals["simulation"] < 0.002
    assert residuals["spline"] < 0.002
    assert residuals["central"] < 0.02


def test_recorded_parts_add_up_to_the_whole_field(calibration):
    for sensor in calibration.scalars:
        parts = [
            calibration.vector(columns.PART, component=component, sensor=sensor)
            for component in columns.components_of(calibration.data, sensor)
        ]
        norm = np.linalg.norm(np.sum(parts, axis=0), axis=1)
        # The norm of the filtered sum and the filtered norm differ by the curvature of the norm within the filter.
        np.testing.assert_allclose(norm, calibration[columns.TOTAL.name(sensor=sensor)], atol=0.05)


def test_a_ridge_on_the_label_finds_nothing_in_the_noise(calibration):
    """The instrument's error is independent of the maneuvers: Tolles-Lawson columns explain none of it."""
    error = calibration[columns.ERROR.name(sensor="cabin")]
    flux = calibration.vector(columns.FLUX, sensor="flux")
    cosines = flux / np.linalg.norm(flux, axis=1, keepdims=True)
    matrix = signals.band_pass(cosines, calibration.rate_hz)
    band = signals.band_pass(error, calibration.rate_hz)
    left = band - matrix @ ridge(matrix, band).coefficients
    assert left.std() > 0.99 * band.std()


def test_the_calibration_flight_is_that_of_its_data_set_within_a_ten_thousandth_of_a_nanotesla():
    """What ``magsim dataset build c208b_calibration`` finds on any machine; ``--renew`` makes the samples anew."""
    calibration = simulate(load_scenario("calibration_c208b"))
    reference = Reference.read(assets.dataset_dir("c208b_calibration"))
    (flight,) = reference.manifest.flights.values()
    assert len(calibration) == flight.rows
    now = dict(samples.take(replace(calibration, name=flight.name), reference.count))
    assert now.keys() == reference.samples.keys()
    for (_, column), line in now.items():
        wanted = reference.samples[flight.name, column]
        pairs = zip(line.values, wanted.values, strict=True)
        assert max(samples.distance(column, *pair) for pair in pairs) <= samples.tolerance(column), column
        total = samples.distance(column, line.total, wanted.total)
        assert total <= samples.sum_tolerance(column, flight.rows), column

"""People who move in their seats: how often and how far, and what it does to the field of a flight."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import kstest

from magsim.aircraft import Aircraft, load_aircraft
from magsim.field import compute_field
from magsim.field.sources.dipoles import dipole_field
from magsim.field.sources.seats import posture
from magsim.population import aircraft_of
from magsim.scenario import Scenario
from magsim.streams import stream
from magsim.trajectory import Flight
from magsim.truth import FieldTruth
from tests.field.test_flex import flight
from tests.support.scenarios import over_the_sea

__all__ = ["flight"]

MOUNT = "sgl_mag_2"
HOUR = np.arange(0.0, 36000.0, 0.1)


@pytest.fixture(scope="module")
def sat() -> np.ndarray:
    """Ten hours of a person, (n, 4)."""
    return posture(stream(3, "a person"), HOUR, (0.0, 36000.0))


@pytest.fixture(scope="module")
def today() -> Aircraft:
    return aircraft_of(load_aircraft("c208b"), 3, 2, 3000.0)


def truth_of(today: Aircraft, flight: Flight, seed: int = 1, day: int = 2, **crew: object) -> FieldTruth:
    scenario: Scenario = over_the_sea({"crew": crew}, {"scalar": [{"name": "floor", "mount": MOUNT}]})
    scenario = scenario.model_copy(update={"seed": seed, "individual": 3, "day": day})
    return compute_field(scenario, today, flight)


def test_a_posture_is_kept_for_a_while(sat: np.ndarray) -> None:
    """Nine shifts and thirteen fidgets in a quarter of an hour: the turn, which does not sway, tells them."""
    moving = np.abs(np.diff(sat[:, 3])) > 1e-9
    starts = HOUR[1:][np.diff(moving.astype(int), prepend=0) == 1]
    expected = 36000.0 / 900.0 * (9.0 + 13.0)
    # 4.5 seconds that a fidget and a shift take together hide some that begin in them.
    assert 0.9 * expected < len(starts) < expected
    assert np.mean(moving) == pytest.approx((9.0 * 1.5 + 13.0 * 3.0) / 900.0, rel=0.1)


def test_postures_are_within_their_sizes(sat: np.ndarray) -> None:
    assert np.all(np.abs(sat).max(axis=0) < [0.075, 0.075, 0.035, np.radians(10.0) * 1.9])
    held = sat[:, 3][1:][np.diff(sat[:, 3]) == 0.0]
    sizes = np.degrees(held[np.flatnonzero(np.diff(held, prepend=np.inf))])
    assert kstest(np.unique(sizes), "uniform", (-10.0, 20.0)).pvalue > 0.01


def test_nothing_jumps(sat: np.ndarray) -> None:
    """Steps of a second or two have speeds and accelerations of some cm/s and dm/s^2."""
    fine = posture(stream(3, "a person"), np.arange(0.0, 2000.0, 0.01), (0.0, 36000.0))
    np.testing.assert_allclose(fine[::10], sat[: len(fine) // 10], rtol=0, atol=1e-12)
    speed = np.diff(fine, axis=0) / 0.01
    assert np.abs(speed[:, :3]).max() < 0.3
    assert np.abs(np.diff(speed[:, :3], axis=0) / 0.01).max() < 1.0


def test_the_crew_moves_on_a_day(today: Aircraft, flight: Flight) -> None:
    """The part is the change of each seated moment; what lies in the cabin stays, and so do all other parts."""
    truth, still = truth_of(today, flight), truth_of(today, flight, enabled=False)
    place, exact = np.array(today.mounts[MOUNT]), 0.0
    logged_s = flight.carrier.time_s
    for dipole in today.magnetics.permanent:
        if not dipole.seated:
            continue
        random = stream(1, f"crew/3/2/{dipole.name}")
        at = posture(random, truth.time_s, (logged_s[0], logged_s[-1]))
        (x, y, z), angle = dipole.moment_am2, at[:, 3]
        moment = [np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y, z + 0.0 * angle]
        exact = exact + dipole_field(np.array(dipole.position_m) + at[:, :3], np.column_stack(moment), place)
        exact = exact - dipole_field(np.array(dipole.position_m), np.array(dipole.moment_am2), place)
    np.testing.assert_allclose(truth.part("crew", MOUNT), exact, rtol=0, atol=1e-10)
    assert np.abs(exact).max() > 0.05
    assert {d.name for d in today.magnetics.permanent if d.seated} == {"pilot", "second_pilot", "operator"}
    assert "crew" not in still.parts_b
    double = truth_of(today, flight, scale=-2.0).part("crew", MOUNT)
    np.testing.assert_allclose(double, -2.0 * truth.part("crew", MOUNT), rtol=1e-14)
    for name, part in still.parts_b.items():
        np.testing.assert_array_equal(truth.parts_b[name], part)


def test_each_flight_and_each_day_has_its_own(today: Aircraft, flight: Flight) -> None:
    first, again, other, later = (
        truth_of(today, flight, seed, day).part("crew", MOUNT) for seed, day in ((1, 2), (1, 2), (2, 2), (1, 3))
    )
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 0.01
    assert np.abs(first - later).max() > 0.01


def test_on_no_day_nobody_is_aboard(flight: Flight) -> None:
    nominal = load_aircraft("c208b")
    assert not any(dipole.seated for dipole in nominal.magnetics.permanent)
    assert "crew" not in truth_of(replace(nominal), flight, day=0).parts_b

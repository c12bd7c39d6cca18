"""A bird under a carrier's flight: its motion over the Earth, the angles of its rope, and what is refused."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from magsim.aircraft import Bird, load_bird
from magsim.earth import ecef_from_geodetic, rot_ne_at
from magsim.earth.gravity import gravity_n
from magsim.errors import DataError, RequestError
from magsim.flight.tow.chain import Chain, ball
from magsim.flight.tow.equilibrium import find_equilibrium, hanging_state
from magsim.flight.tow.hook import EARTH_SPIN_E, Hook
from magsim.flight.tow.integration import integrate
from magsim.flight.tow.motion import BirdMotion
from magsim.flight.tow.setup import chain_of
from magsim.flight.tow.towing import rope_angles, tow_bird, trajectory
from magsim.frames import rot_nb_from_attitude, rotate
from magsim.scenario import Tow
from magsim.trajectory import Flight, Trajectory
from tests.support.carriers import (
    ALT_M,
    along_meridian,
    along_parallel,
    carrier,
    circle,
    flight_of,
    helicopter,
    scenario,
    times,
)
from tests.support.ropes import ROPE
from tests.support.rotations import body_rates

FINE_HZ = 120


@pytest.fixture(scope="module")
def bird() -> Bird:
    return load_bird("bird")


def flown_under(path: Trajectory, chain: Chain, wind: tuple[float, ...] = (0.0, 0.0, 0.0)) -> tuple[BirdMotion, Hook]:
    """A chain under a carrier, logged finely, in a steady wind."""
    wind_n = np.tile(wind, (len(path), 1))
    hook = Hook(path, np.array([0.0, 0.0, 1.1]), wind_n, np.zeros_like(wind_n))
    first = hook.air(path.time_s[:1])[0]
    found = find_equilibrium(chain, float(np.linalg.norm(first[3:6])), float(first[9]))
    assert found is not None
    span = float(path.time_s[-1])
    settings = {"start_s": 0.0, "duration_s": [span], "step_hz": FINE_HZ, "log_hz": FINE_HZ}
    return integrate([chain], [hanging_state(chain, found, first)], [hook.air], **settings)[0], hook


def towed(path: Trajectory, bird: Bird, *, wind: Callable | None = None, **tables: object) -> Flight:
    return tow_bird(flight_of(path, wind), scenario(**tables), helicopter(), bird)


def test_velocity_and_rates_are_the_derivatives_of_place_and_attitude(bird: Bird) -> None:
    """In a turn, from the log alone; the bird swings out of its straight flight."""
    path = circle(60.0, 28.0, 20.0, 9.8, seconds=30.0)
    flown, hook = flown_under(path, chain_of(Tow(), bird))
    out = trajectory(flown, hook, (0.1, 0.0, 0.02))
    np.testing.assert_array_equal(out.reference_b, [0.1, 0.0, 0.02])
    inside = slice(60, -60)
    places = ecef_from_geodetic(out.lat_rad, out.lon_rad, out.alt_m)
    velocity_e = CubicSpline(out.time_s, places - places[0])(out.time_s, 1)
    velocity_n = rotate(rot_ne_at(out.lat_rad, out.lon_rad), velocity_e)
    np.testing.assert_allclose(out.velocity_n[inside], velocity_n[inside], atol=2e-5)
    turning = CubicSpline(out.time_s, out.attitude)(out.time_s, 1)
    rates = body_rates(out.attitude, turning)
    assert np.ptp(out.rate_b[:, 0]) > 0.1
    np.testing.assert_allclose(out.rate_b[inside], rates[inside], atol=2e-5)


def test_bird_flies_below_and_behind_its_carrier_with_its_nose_along_the_course(bird: Bird) -> None:
    """East, west, north, south; the attitude counts from north and down at the bird's own place."""
    chain = chain_of(Tow(), bird)
    for path in (along_parallel(40.0, 28.0), along_parallel(40.0, -28.0), along_meridian(-40.0, 28.0)):
        flown, hook = flown_under(path, chain)
        out = trajectory(flown, hook, (0.0, 0.0, 0.0))
        course = path.attitude[0, 2]
        off = np.degrees((out.attitude[:, 2] - course + np.pi) % (2.0 * np.pi) - np.pi)
        # Coriolis leans the chain by some hundredths of a degree
        np.testing.assert_allclose(off, 0.0, atol=0.3)
        found = find_equilibrium(chain, 28.0, float(hook.air(np.zeros(1))[0, 9]))
        assert found is not None
        np.testing.assert_allclose(out.attitude[:, 1], found.pitch, atol=math.radians(0.3))
        np.testing.assert_allclose(out.attitude[:, 0], 0.0, atol=math.radians(0.3))
        drop = path.at(out.time_s).alt_m - out.alt_m
        np.testing.assert_allclose(drop, found.hang_m[1] + 1.1, atol=0.02)
        here, there = (ecef_from_geodetic(p.lat_rad, p.lon_rad, p.alt_m) for p in (path.at(out.time_s), out))
        north, east, _ = rotate(rot_ne_at(out.lat_rad, out.lon_rad), there - here).T
        ahead = north * np.cos(course) + east * np.sin(course)
        np.testing.assert_allclose(ahead, found.hang_m[0], atol=0.1)
        np.testing.assert_allclose(out.velocity_n, path.at(out.time_s).velocity_n, atol=0.1)


def test_angles_of_the_rope_are_aft_and_to_the_right_of_the_course(bird: Bird) -> None:
    """Wind to the east: the rope trails along the flow, so a course to the north has its bird to the right of it."""
    chain = chain_of(Tow(), bird)
    for sign, path in ((1.0, along_meridian(10.0, 25.0, 30.0)), (-1.0, along_meridian(10.0, -25.0, 30.0))):
        flown, hook = flown_under(path, chain, wind=(0.0, 8.0, 0.0))
        angles = rope_angles(flown, hook)
        trail, side = np.tan(angles["trail_rad"]), np.tan(angles["side_rad"])
        assert (trail > 0.1).all()
        np.testing.assert_allclose(side / trail, sign * 8.0 / 25.0, atol=0.02)
        np.testing.assert_array_equal(angles["tension_n"], flown.tension_n[:, 0])


def test_in_a_steady_turn_the_bird_hangs_outward_by_the_bank() -> None:
    """Heavy, with little drag: along the apparent gravity, which the turn leans to the left of a right turn."""
    gravity, bank = float(gravity_n(math.radians(20.0), ALT_M)[2]), 20.0
    path = circle(20.0, 28.0, bank, gravity, seconds=200.0)
    flown, hook = flown_under(path, Chain(ROPE, ball(2000.0, 0.5), 10, EARTH_SPIN_E))
    late = flown.time_s > 150.0
    side = np.degrees(rope_angles(flown, hook)["side_rad"])[late]
    # the rope itself widens the circle: tan = v^2 / (g r) (1 + L sin / r)
    radius = 28.0**2 / (gravity * math.tan(math.radians(bank)))
    lean = math.radians(bank)
    for _ in range(20):
        lean = math.atan(math.tan(math.radians(bank)) * (1.0 + 30.0 * math.sin(lean) / radius))
    assert side.mean() == pytest.approx(-math.degrees(lean), abs=0.3)


def test_a_flight_with_its_bird_is_complete(bird: Bird) -> None:
    path = along_parallel(30.0, 28.0, 20.0)
    flight = towed(path, bird)
    assert flight.bird is not None
    assert flight.carrier is path
    np.testing.assert_array_equal(flight.bird.time_s, path.time_s)
    np.testing.assert_array_equal(flight.bird.reference_b, bird.facts.cg_t)
    assert set(flight.rope) == {"trail_rad", "side_rad", "tension_n"}
    notes = flight.notes["tow"]
    assert (notes["rope_m"], notes["links"], notes["mass_kg"]) == (30.0, 10, 80.0)
    assert math.degrees(flight.rope["trail_rad"].mean()) == pytest.approx(notes["steady_trail_deg"], abs=0.5)
    assert notes["least_tension_n"] <= flight.rope["tension_n"].min()
    assert notes["most_tension_n"] >= flight.rope["tension_n"].max()


def test_air_of_the_scenario_blows_where_the_flight_knows_none(bird: Bird) -> None:
    path, air = along_meridian(30.0, 28.0, 20.0), {"wind_east_mps": 6.0}
    known = towed(path, bird, air=air)
    given = towed(path, bird, wind=lambda time: np.tile([0.0, 6.0, 0.0], (len(time), 1)))
    np.testing.assert_allclose(known.bird.attitude, given.bird.attitude, atol=1e-9)
    assert np.degrees(known.rope["side_rad"]).min() > 1.0


def heaving(part_g: float, speed_mps: float, period_s: float = 5.0) -> Trajectory:
    """A carrier that goes up and down, more and more within 10 s."""
    time, level = times(30.0), along_parallel(30.0, speed_mps, 30.0)
    share = np.clip(time / 10.0, 0.0, 1.0)
    omega = 2.0 * np.pi / period_s
    size = part_g * 9.8 / omega**2 * share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    return carrier(time, level.lat_rad, level.lon_rad, ALT_M + size * np.sin(omega * time))


def test_a_slack_rope_is_reported_with_its_time(bird: Bird) -> None:
    with pytest.raises(DataError, match=r"^the rope went slack at t = \d+\.\d s: .*; allowed: gentler maneuvers and "):
        towed(heaving(1.3, 28.0), bird)
    flight = towed(heaving(0.5, 28.0), bird)
    assert 0.0 < flight.notes["tow"]["least_tension_n"] < 400.0


def test_air_from_beyond_the_model_of_the_bird_is_reported(bird: Bird) -> None:
    message = r"^the air met the bird \d+ deg off its axis at t = \d+\.\d s; allowed: up to 45 deg, "
    with pytest.raises(DataError, match=message):
        towed(heaving(0.9, 28.0), bird)


def test_steps_that_are_too_few_are_reported_and_more_of_them_do(bird: Bird) -> None:
    """20 links of 1.5 m bear 486 N at 30 steps a second, 1944 N at 60; the rope takes 750 N."""
    path = along_parallel(30.0, 28.0, 20.0)
    message = r"^tow\.step_hz: 30 steps a second bear 486 N in a rope of 20 links, but it .*; allowed: more steps, "
    with pytest.raises(RequestError, match=message):
        towed(path, bird, tow={"step_hz": 30, "rope": {"links": 20}})
    flight = towed(path, bird, tow={"step_hz": 60, "rope": {"links": 20}})
    assert flight.notes["tow"]["step_hz"] == 60
    # left alone it takes as many as the tension needs
    assert towed(path, bird, tow={"rope": {"links": 60}}).notes["tow"]["step_hz"] == 240


@pytest.mark.parametrize("mass_kgpm", [0.001, 0.0015])
def test_a_rope_too_light_for_any_steps_is_reported(bird: Bird, mass_kgpm: float) -> None:
    """60 links of 0.25 m: 1920 steps a second bear 461 and 691 N, it takes 730; the second is shaken slack first."""
    rope = {"links": 60, "length_m": 15.0, "mass_kgpm": mass_kgpm}
    message = rf"^the swing of the bird diverged at t = .* of 60 links of {mass_kgpm} kg/m; allowed: .* a heavier rope$"
    with pytest.raises(DataError, match=message):
        towed(along_parallel(30.0, 28.0, 5.0), bird, tow={"rope": rope})
    rope |= {"links": 20}
    assert towed(along_parallel(30.0, 28.0, 5.0), bird, tow={"rope": rope}).bird is not None


def test_a_bird_too_light_is_reported_before_it_flies(bird: Bird) -> None:
    with pytest.raises(RequestError, match=r"^tow\.body\.mass_kg: 2 kg are too light .* at least [\d.]+ kg"):
        towed(along_parallel(30.0, 55.0, 20.0), bird, speed_mps=55.0, tow={"body": {"mass_kg": 2.0}})


def test_place_of_the_bridle_is_where_the_angles_are_counted_to(bird: Bird) -> None:
    """The rope ends at the bridle, not at the center of gravity."""
    path, chain = along_parallel(5.0, 28.0, 5.0), chain_of(Tow(), bird)
    flown, hook = flown_under(path, chain)
    rot_ne = rot_ne_at(path.at(flown.time_s).lat_rad, path.at(flown.time_s).lon_rad)
    out = trajectory(flown, hook, (0.0, 0.0, 0.0))
    arm = rotate(rot_nb_from_attitude(out.attitude), np.tile(chain.body.bridle_m, (len(out), 1)))
    _, east, down = (rotate(rot_ne, flown.place_m) + arm).T
    np.testing.assert_allclose(rope_angles(flown, hook)["trail_rad"], np.arctan2(-east, down), atol=1e-5)

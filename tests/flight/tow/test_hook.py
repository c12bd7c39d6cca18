"""The tow point: apparent gravity by closed forms, its place under the carrier, air and gusts."""

import math

import numpy as np
import pytest

from magsim.earth import geodetic_from_ecef, radii_of_curvature, rot_ne_at
from magsim.earth.gravity import gravity_n
from magsim.flight.tow.hook import Hook, gusts_n
from magsim.frames import rotate
from magsim.scenario import Gusts
from magsim.trajectory import Trajectory
from tests.support.carriers import ALT_M, along_meridian, along_parallel, carrier, circle, times

SPIN = 7.292115e-5
INSIDE = np.linspace(5.0, 15.0, 41)
NOISE = 2e-5
"""Rounding of Earth-centered places, twice derived [m/s^2]."""


def hook_of(path: Trajectory, hook_b: tuple[float, ...] = (0.0, 0.0, 0.0)) -> Hook:
    still = np.zeros((len(path), 3))
    return Hook(path, np.array(hook_b), still, still)


def local(hook: Hook, time_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Latitude there, and what acts with its vectors north, east, down."""
    lat, lon, _ = geodetic_from_ecef(hook.place_e(time_s))
    air = hook.air(time_s)
    rot_ne = rot_ne_at(lat, lon)
    vectors = [rotate(rot_ne, air[:, k : k + 3]) for k in (0, 3, 6)]
    return lat, np.column_stack([*vectors, air[:, 9]])


@pytest.mark.parametrize("lat_deg", [-60.0, 0.0, 45.0, 90.0])
def test_at_rest_it_feels_normal_gravity_and_no_wind(lat_deg: float) -> None:
    one = np.ones(601)
    level = np.zeros((601, 3))
    path = carrier(times(20.0), math.radians(lat_deg) * one, 0.3 * one, 0.0 * one, level)
    _, found = local(hook_of(path), INSIDE)
    sin2 = math.sin(math.radians(lat_deg)) ** 2
    # Somigliana with the constants of WGS 84, written out
    exact = 9.7803253359 * (1.0 + 0.00193185265241 * sin2) / math.sqrt(1.0 - 0.00669437999014 * sin2)
    np.testing.assert_allclose(found[:, :3], np.tile([0.0, 0.0, exact], (41, 1)), atol=NOISE)
    np.testing.assert_allclose(found[:, 3:9], 0.0, atol=1e-6)
    np.testing.assert_allclose(found[:, 9], 1.225, rtol=1e-9)


@pytest.mark.parametrize("speed_mps", [60.0, -60.0])
@pytest.mark.parametrize("lat_deg", [0.0, 45.0, -70.0])
def test_along_a_parallel_it_feels_eotvos(lat_deg: float, speed_mps: float) -> None:
    """Faster around the Earth's axis: the centrifugal acceleration grows by (2 Omega + turn) turn r."""
    _, found = local(hook_of(along_parallel(lat_deg, speed_mps)), INSIDE)
    lat = math.radians(lat_deg)
    radius = (radii_of_curvature(lat)[1] + ALT_M) * math.cos(lat)
    more = (2.0 * SPIN + speed_mps / radius) * speed_mps
    exact = gravity_n(lat, ALT_M) + more * np.array([-math.sin(lat), 0.0, -math.cos(lat)])
    np.testing.assert_allclose(found[:, :3], np.tile(exact, (41, 1)), atol=NOISE)
    np.testing.assert_allclose(found[:, 3:6], np.tile([0.0, -speed_mps, 0.0], (41, 1)), atol=1e-6)


@pytest.mark.parametrize("speed_mps", [60.0, -60.0])
def test_along_a_meridian_it_feels_coriolis_and_the_bend_of_the_earth(speed_mps: float) -> None:
    lat, found = local(hook_of(along_meridian(45.0, speed_mps)), INSIDE)
    exact = gravity_n(lat, ALT_M)
    # to the right of the course in the northern half
    exact[:, 1] += 2.0 * SPIN * speed_mps * np.sin(lat)
    exact[:, 2] -= speed_mps**2 / (radii_of_curvature(lat)[0] + ALT_M)
    np.testing.assert_allclose(found[:, :3], exact, atol=NOISE)


def test_in_a_coordinated_turn_gravity_leans_by_the_bank() -> None:
    gravity, bank = float(gravity_n(math.radians(30.0), ALT_M)[2]), 25.0
    path = circle(30.0, 28.0, bank, gravity)
    _, found = local(hook_of(path), INSIDE)
    course = path.at(INSIDE).attitude[:, 2]
    right = np.column_stack([-np.sin(course), np.cos(course)])
    aside = np.einsum("ni,ni->n", found[:, :2], right)
    # outward, which is left; Coriolis and Eotvos are some mm/s^2
    lean = np.degrees(np.arctan2(-aside, found[:, 2]))
    np.testing.assert_allclose(lean, bank, atol=0.05)
    np.testing.assert_allclose(np.linalg.norm(found[:, :3], axis=1), gravity / math.cos(math.radians(bank)), atol=0.02)


def test_it_hangs_where_it_is_tied() -> None:
    """A banked carrier that heads west: what is below it swings to its left, that is south; what is ahead lies west."""
    one = np.ones(601)
    attitude = np.tile(np.radians([30.0, 0.0, 270.0]), (601, 1))
    path = carrier(times(20.0), 0.5 * one, 0.3 * one, ALT_M * one, attitude)
    at = hook_of(path, (2.0, 0.0, 1.1)).place_e(INSIDE) - hook_of(path).place_e(INSIDE)
    exact = [-1.1 * math.sin(math.radians(30.0)), -2.0, 1.1 * math.cos(math.radians(30.0))]
    np.testing.assert_allclose(rotate(rot_ne_at(0.5, 0.3), at), np.tile(exact, (41, 1)), atol=1e-8)


def test_it_moves_with_the_roll_of_its_carrier() -> None:
    """A hook 1.1 m below a carrier that rolls about its axis, heading north, moves on a circle."""
    time, size, omega = times(20.0), math.radians(20.0), 1.3
    roll, one = size * np.sin(omega * time), np.ones(601)
    attitude = np.column_stack([roll, 0.0 * one, 0.0 * one])
    path = carrier(time, 0.5 * one, 0.3 * one, ALT_M * one, attitude)
    _, found = local(hook_of(path, (0.0, 0.0, 1.1)), INSIDE)
    angle, rate = size * np.sin(omega * INSIDE), size * omega * np.cos(omega * INSIDE)
    turning = -(omega**2) * angle
    velocity = 1.1 * rate[:, None] * np.column_stack([-np.cos(angle), -np.sin(angle)])
    tangential = 1.1 * turning[:, None] * np.column_stack([-np.cos(angle), -np.sin(angle)])
    central = 1.1 * (rate**2)[:, None] * np.column_stack([np.sin(angle), -np.cos(angle)])
    np.testing.assert_allclose(found[:, 4:6], -velocity, atol=1e-5)
    np.testing.assert_allclose(found[:, 1:3] - gravity_n(0.5, ALT_M)[1:], -tangential - central, atol=1e-3)


def test_wind_blows_at_both_and_gusts_at_the_bird_alone() -> None:
    path = along_parallel(10.0, 30.0)
    wind, gust = np.tile([3.0, -2.0, 0.5], (601, 1)), np.tile([0.0, 0.0, 1.5], (601, 1))
    gust[300:] *= -1.0
    _, calm = local(hook_of(path), INSIDE)
    _, found = local(Hook(path, np.zeros(3), wind, gust), INSIDE)
    np.testing.assert_allclose(found[:, 3:6] - calm[:, 3:6], np.tile([3.0, -2.0, 0.5], (41, 1)), atol=1e-4)
    more = found[:, 6:9] - found[:, 3:6]
    sign = np.where(INSIDE[:, None] < 9.98, 1.0, -1.0)
    np.testing.assert_allclose(more, sign * [0.0, 0.0, 1.5], atol=1e-4)


def test_gusts_are_a_process_of_first_order_with_a_grid_of_its_own() -> None:
    gusts = Gusts(speed_mps=1.5, length_m=150.0)
    time = np.arange(8000 * 10) / 10.0
    drawn = gusts_n(gusts, time, 0.0, 30.0, 4)
    assert drawn.std(axis=0) == pytest.approx(1.5, rel=0.08)
    for lag_s in (1.0, 5.0):
        rows = round(10.0 * lag_s)
        together = np.mean(drawn[rows:] * drawn[:-rows], axis=0) / np.mean(drawn**2, axis=0)
        assert together == pytest.approx(math.exp(-lag_s / 5.0), abs=0.08)
    # other rows see the same weather
    np.testing.assert_array_equal(gusts_n(gusts, np.arange(600) / 60.0, 0.0, 30.0, 4)[::6], drawn[:100])
    np.testing.assert_allclose(gusts_n(gusts, time[50:100] - 3.0, -3.0, 30.0, 4), drawn[50:100], rtol=0, atol=1e-12)
    assert np.abs(gusts_n(gusts, time[:100], 0.0, 30.0, 5) - drawn[:100]).max() > 0.5

"""The background along the smooth track of a bird, and the change by its swing."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.aircraft import Bird
from magsim.earth import decimal_years, ecef_from_geodetic, igrf
from magsim.field import load_response
from magsim.field.composition import backgrounds_of, situation_of
from magsim.field.situation import Situation
from magsim.field.tow.steady import smoothed, steady_background, whittaker
from magsim.terrain import TangentPlane
from magsim.trajectory import Flight, Trajectory
from tests.support.rotations import body_rates
from tests.support.toy_tow import HEIGHT_M, SPEED_MPS, path_of, places_of, scenario_of


def gain_of(hertz: float) -> float:
    """Of the smoother: 1 / (1 + (sin(pi f T) / sin(pi f0 T))^6), T = 0.5 s, f0 = 0.03 Hz."""
    return 1.0 / (1.0 + (np.sin(0.5 * np.pi * hertz) / np.sin(0.5 * np.pi * 0.03)) ** 6)


def test_the_smoother_passes_parabolas() -> None:
    time = np.arange(400.0)
    rows = np.column_stack([np.ones(400), 3.0 * time - 20.0, 0.01 * time**2 - time])
    np.testing.assert_allclose(whittaker(rows, 1e7), rows, rtol=0, atol=1e-4)


@pytest.mark.parametrize(("hertz", "low", "high"), [(0.005, 0.9999, 1.0), (0.03, 0.499, 0.501), (0.3, 0.0, 2e-6)])
def test_half_of_a_motion_of_30_millihertz_is_left(hertz: float, low: float, high: float) -> None:
    """On the track of a body: a motion aside of some frequency, in the middle of eight minutes."""
    time = np.arange(-240.0, 240.01, 0.1)
    moved = still_path(time, aside_m=10.0 * np.sin(2.0 * np.pi * hertz * time))
    plain = places_of(still_path(time), np.zeros(3))
    smooth = smoothed(moved, places_of(moved, np.zeros(3)))
    aside = places_of(smooth, np.zeros(3)) - plain
    right = (places_of(moved, np.zeros(3)) - plain) / 10.0
    middle = np.abs(time) < 60.0
    share = np.einsum("ni,ni->n", aside, right)[middle].sum() / (
        10.0 * np.einsum("ni,ni->n", right, right)[middle].sum()
    )
    assert low <= share <= high
    assert share == pytest.approx(gain_of(hertz), rel=2e-3, abs=1e-6)
    np.testing.assert_allclose(smooth.velocity_n[middle, 0], SPEED_MPS, rtol=0, atol=1e-3)


def still_path(time_s: np.ndarray, aside_m: float | np.ndarray = 0.0, up_m: float | np.ndarray = 0.0) -> Trajectory:
    """Straight to the north, but for motions to the right and up; the body itself does not turn."""
    plane = TangentPlane(np.radians(48.7), np.radians(127.2), HEIGHT_M)
    lat, lon = plane.geodetic(SPEED_MPS * time_s, np.zeros(len(time_s)) + aside_m)
    place_e = ecef_from_geodetic(lat, lon, HEIGHT_M - 30.0 + up_m)
    return path_of(time_s, place_e, np.zeros((len(time_s), 3)), np.zeros(3))


def swing_of(path: Trajectory, bird: Bird) -> tuple[np.ndarray, np.ndarray, Situation]:
    """Times, clean less steady at the nose, and the situation."""
    scenario = scenario_of(earth={"departure": {"enabled": False}})
    flight = Flight(path, float(path.time_s[-1] - 4.0), 120.0, {}, (), ())
    background = backgrounds_of(scenario, flight)["carrier"]
    below = situation_of(scenario, bird, load_response(bird), background, ("nose",))
    clean = np.linalg.norm(below.background["earth"][:, 0], axis=1)
    return below.time_s, clean - steady_background(below, "nose"), below


def test_swinging_in_a_known_gradient_changes_what_it_should(bird: Bird) -> None:
    """A motion of 0.1 Hz, three meters up and down, in the vertical gradient of the main field."""
    time, hertz = np.arange(-60 * 30, 160 * 30 + 1) / 30.0, 0.1
    path = still_path(time, up_m=3.0 * np.sin(2.0 * np.pi * hertz * time))
    at, swing, below = swing_of(path, bird)
    place = below.motion
    years = decimal_years(below.scenario.start.time_utc, at)
    field, slopes = igrf(place.lat_rad, place.lon_rad, place.alt_m, years, gradient=True)
    down = np.einsum("ni,ni->n", field, slopes[:, :, 2]) / np.linalg.norm(field, axis=1)
    expected = -down * 3.0 * np.sin(2.0 * np.pi * hertz * at)
    largest = np.abs(expected).max()
    assert largest == pytest.approx(0.088, rel=0.1)
    # 7e-4 of such a motion is left in the smooth track; near its ends the track follows a part of it.
    missed = np.abs(swing - (1.0 - gain_of(hertz)) * expected) / largest
    from_end = np.minimum(at - at[0], at[-1] - at)
    assert missed[from_end > 60.0].max() < 1e-3
    assert missed[from_end > 30.0].max() < 0.03
    assert missed[from_end > 10.0].max() < 0.15


def test_a_bird_that_does_not_swing_changes_nothing(bird: Bird) -> None:
    """The path over the round Earth is a parabola: even at its ends nothing is left."""
    time = np.arange(-4 * 30, 60 * 30 + 1) / 30.0
    _, swing, _ = swing_of(still_path(time), bird)
    assert np.abs(swing).max() < 2e-5
    _, swing, _ = swing_of(still_path(time, up_m=0.2 * time + 0.001 * time**2), bird)
    assert np.abs(swing).max() < 2e-5


def test_the_mount_swings_with_the_body(bird: Bird) -> None:
    """A bird that nods about its center moves its nose, 0.95 m ahead, up and down; its tail the other way."""
    time, hertz = np.arange(-4 * 30, 60 * 30 + 1) / 30.0, 0.4
    still = still_path(time)
    nod = np.radians(5.0) * np.sin(2.0 * np.pi * hertz * time)
    attitude = np.column_stack([np.zeros_like(nod), nod, np.zeros_like(nod)])
    rates = body_rates(attitude, np.column_stack([np.zeros_like(nod), np.gradient(nod, time), np.zeros_like(nod)]))
    at, swing, below = swing_of(replace(still, attitude=attitude, rate_b=rates), bird)
    _, level, _ = swing_of(still_path(time, up_m=0.95 * np.sin(nod)), bird)
    assert np.abs(level).max() > 1e-3
    inside = (at > 5.0) & (at < 55.0)
    # The rest is that of cos, of second order and along the line.
    assert np.abs(swing - level)[inside].max() < 0.05 * np.abs(level).max() + 2e-5
    assert below.mounts == ("nose",)

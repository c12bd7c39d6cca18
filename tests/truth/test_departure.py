"""The departure of the main field against Laplace's equation, and against the published error of WMM2025."""

import math

import numpy as np
import pytest

from magsim.earth import LocalFrame, ecef_from_geodetic, rot_ne_at
from magsim.field.background.departure import (
    ERROR_NT,
    WAVES_DOWN_NT,
    DepartureField,
    departure_of,
    draw_disturbance,
)
from magsim.field.background.waves import Waves, derivatives, draw_waves
from magsim.scenario import Scenario
from magsim.streams import stream

RADIUS_M = 6_371_000.0


def world(lat_deg: float, lon_deg: float, seed: int = 1, world_seed: int = 0) -> DepartureField:
    start = {"lat_deg": lat_deg, "lon_deg": lon_deg, "alt_m": 500.0, "speed_mps": 70.0}
    table = {"schema": 1, "seed": seed, "aircraft": "c208b", "start": start, "pattern": {"kind": "box"}}
    table |= {"field": {"earth": {"departure": {"seed": world_seed}}}}
    sensors = {"scalar": [{"name": "tail", "mount": "sgl_mag_1"}]}
    return departure_of(Scenario.model_validate(table | {"sensors": sensors}))


def everywhere(count: int, seed: int) -> np.ndarray:
    directions = np.random.default_rng(seed).standard_normal((count, 3))
    return directions / np.linalg.norm(directions, axis=1)[:, None]


def potential(waves: Waves, place: np.ndarray) -> np.ndarray:
    """The sum of solid harmonics itself: (c . x)^n in the form in which c is a pair of real vectors."""
    r = np.linalg.norm(place, axis=1)
    total = np.zeros(len(place))
    for n, (u, v), a, phase in zip(waves.degree, waves.circle, waves.amplitude_nt, waves.phase, strict=True):
        first, second = place @ u / r, place @ v / r
        size = np.hypot(first, second) ** n * (RADIUS_M / r) ** (n + 1.0)
        total += a * RADIUS_M / (n + 1.0) * size * np.cos(n * np.arctan2(second, first) + phase)
    return total


@pytest.fixture(scope="module")
def waves() -> Waves:
    return draw_waves(stream(3, "departure/waves"), WAVES_DOWN_NT)


def test_field_gradient_and_second_derivatives_are_those_of_the_potential(waves):
    place = (RADIUS_M + np.array([[0.0], [80.0], [3000.0], [9000.0]])) * everywhere(4, 1)
    field, gradient, second = derivatives(waves, RADIUS_M, place)
    step = 2.0
    for axis, unit in enumerate(step * np.eye(3)):
        slope = (potential(waves, place - unit) - potential(waves, place + unit)) / (2.0 * step)
        np.testing.assert_allclose(slope, field[:, axis], rtol=0, atol=1e-4)
        ahead, behind = (derivatives(waves, RADIUS_M, place + sign * unit) for sign in (1.0, -1.0))
        for lower, upper in ((0, gradient), (1, second)):
            numeric = (ahead[lower] - behind[lower]) / (2.0 * step)
            np.testing.assert_allclose(numeric, upper[..., axis], rtol=0, atol=2e-6 * np.abs(upper).max())


def test_there_is_no_divergence_and_no_curl(waves):
    """The gradient itself, and what differences of the field make of it."""
    place = RADIUS_M * (1.0 + 1e-4 * np.arange(12.0)[:, None]) * everywhere(12, 2)
    field, gradient, second = derivatives(waves, RADIUS_M, place)
    largest = np.abs(gradient).max(axis=(1, 2))
    assert (np.abs(np.trace(gradient, axis1=1, axis2=2)) / largest).max() < 1e-12
    assert np.abs(gradient - gradient.transpose(0, 2, 1)).max() < 1e-12 * np.abs(gradient).max()
    assert np.abs(np.einsum("niij->nj", second)).max() < 1e-12 * np.abs(second).max()
    assert np.abs(second - second.transpose(0, 2, 3, 1)).max() < 1e-12 * np.abs(second).max()
    step = 1.0
    sides = [[derivatives(waves, RADIUS_M, place + sign * step * unit)[0] for sign in (1, -1)] for unit in np.eye(3)]
    numeric = np.stack([(ahead - behind) / (2.0 * step) for ahead, behind in sides], axis=2)
    assert np.abs(field).max() > 100.0
    assert (np.abs(np.trace(numeric, axis1=1, axis2=2)) / largest).max() < 1e-6
    assert (np.abs(numeric - numeric.transpose(0, 2, 1)).max(axis=(1, 2)) / largest).max() < 1e-6


@pytest.fixture(scope="module")
def drawn() -> np.ndarray:
    """Departures north, east, down at the ground, of many worlds, places and years, (n, 3) [nT]."""
    out = []
    for seed in range(30):
        up = everywhere(150, 100 + seed)
        waves_e, _, _ = derivatives(draw_waves(stream(seed, "departure/waves"), WAVES_DOWN_NT), RADIUS_M, RADIUS_M * up)
        lat, lon = np.arcsin(up[:, 2]), np.arctan2(up[:, 1], up[:, 0])
        vector_n = draw_disturbance(stream(seed, "departure/disturbance")).at(
            np.random.default_rng(seed).uniform(0.0, 3e9, 150)
        )
        out.append(np.einsum("nij,nj->ni", rot_ne_at(lat, lon), waves_e) + vector_n)
    return np.concatenate(out)


def test_each_component_has_the_published_error(drawn):
    assert ERROR_NT == (137.0, 89.0, 141.0)
    np.testing.assert_allclose(np.sqrt(np.mean(drawn**2, axis=0)), ERROR_NT, rtol=0.03)
    np.testing.assert_allclose(drawn.mean(axis=0), 0.0, atol=6.0)


@pytest.mark.parametrize("horizontal_nt", [15_000.0, 25_000.0, 40_000.0])
def test_declination_errs_as_the_components_do(drawn, horizontal_nt):
    """The published one is sqrt(0.26^2 + (5417 / H)^2) deg: its second part alone is 94.5 nT across the field.

    The first part is more than the published errors of the components make; so the drawn one lies between the two.
    """
    error_deg = np.degrees(np.arctan2(drawn[:, 1], horizontal_nt + drawn[:, 0]))
    rms = np.sqrt(np.mean(error_deg**2))
    assert rms == pytest.approx(math.degrees(89.0 / horizontal_nt), rel=0.03)
    assert 0.9 * 5417.0 / horizontal_nt < rms < math.hypot(0.26, 5417.0 / horizontal_nt)


def test_waves_are_5_to_500_km_long(waves):
    length = 2.0 * math.pi * RADIUS_M / waves.degree
    assert 5e3 <= length.min() < 5.5e3
    assert 450e3 < length.max() <= 500e3


@pytest.mark.parametrize("row", [0, -1])
def test_a_wave_repeats_along_its_circle_and_dies_out_upward(waves, row):
    one = Waves(*(getattr(waves, name)[[row]] for name in ("degree", "circle", "amplitude_nt", "phase")))
    n, (u, v) = one.degree[0], one.circle[0]
    angle = 2.0 * math.pi / n * np.array([0.0, 0.25, 1.0])
    direction = np.outer(np.cos(angle), u) + np.outer(np.sin(angle), v)
    upward = [
        np.einsum("ni,ni->n", derivatives(one, RADIUS_M, (RADIUS_M + height) * direction)[0], direction)
        for height in (0.0, 2000.0)
    ]
    assert upward[0][2] == pytest.approx(upward[0][0], rel=1e-6)
    # A quarter of a wave on, what was up is along the circle.
    assert np.hypot(upward[0][0], upward[0][1]) == pytest.approx(one.amplitude_nt[0], rel=1e-9)
    np.testing.assert_allclose(upward[1] / upward[0], (1.0 + 2000.0 / RADIUS_M) ** -(n + 2.0), rtol=1e-9)
    assert upward[1][0] / upward[0][0] == pytest.approx(math.exp(-2000.0 * n / RADIUS_M), rel=0.01)


def places_around(lat_deg: float, lon_deg: float) -> np.ndarray:
    frame = LocalFrame(*np.radians([lat_deg, lon_deg]), 300.0)
    return frame.position(np.random.default_rng(4).uniform(-5e3, 5e3, (20, 3)) * [1.0, 1.0, 0.02])


def test_the_departure_belongs_to_the_place():
    """Not to the flight's seed, nor to where within a degree it starts; another world is another field."""
    place = places_around(45.1, -75.6)
    one = world(45.1, -75.6).expanded(place)[0]
    np.testing.assert_array_equal(one, world(45.1, -75.6, seed=9).expanded(place)[0])
    np.testing.assert_array_equal(one, world(45.3, -75.9, seed=2).expanded(place)[0])
    assert np.abs(one - world(45.1, -75.6, world_seed=1).expanded(place)[0]).max() > 50.0


def test_neighbors_agree_at_the_border_of_a_degree():
    place = places_around(45.5, -75.6)
    south, north = (world(lat, -75.6).expanded(place)[0] for lat in (45.4, 45.6))
    size = np.abs(south).max()
    assert size > 30.0
    assert np.abs(north - south).max() < 0.25 * size


@pytest.mark.parametrize(
    ("one", "other"), [((10.0, 179.9), (10.0, -179.9)), ((89.9, 0.0), (89.9, 135.0)), ((-89.7, 30.0), (-90.0, -120.0))]
)
def test_no_seam_at_the_date_line_and_at_the_poles(one, other):
    place = ecef_from_geodetic(*np.radians(one), 300.0) + np.random.default_rng(5).uniform(-3e3, 3e3, (10, 3))
    first, second = (world(*start).expanded(place) for start in (one, other))
    for got, wanted in zip(first, second, strict=True):
        np.testing.assert_allclose(got, wanted, rtol=0, atol=1e-7 * np.abs(wanted).max() + 1e-15)


def test_the_vector_changes_over_hours():
    """By nanotesla in half an hour, by its whole size in weeks."""
    slow = draw_disturbance(stream(0, "departure/disturbance"))
    at = np.arange(0.0, 400.0 * 86400.0, 1800.0)
    vector = slow.at(1.7e9 + at)
    steps = np.diff(vector, axis=0)
    assert np.all((steps.std(axis=0) > 1.0) & (steps.std(axis=0) < 12.0))
    rest = np.sqrt(np.array(ERROR_NT) ** 2 - [7200.0, 7200.0, 14400.0])
    np.testing.assert_allclose(vector.std(axis=0), rest, rtol=0.2)

"""The plain peer of ``tests/benchmarks/physics_methods.py`` on an airplane whose answer is known."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.signals import band_pass, off_ends
from tests.benchmarks.physics_rows import peer
from tests.benchmarks.physics_rows.methods import PeerMethod

RATE_HZ = 10.0
MODEL_NT = np.array([39000.0, -1500.0, 17000.0])
PERMANENT_NT = np.array([800.0, -450.0, 600.0])
SKEW = np.eye(3) + 0.01 * np.array([[1.0, -0.4, 0.3], [0.6, -0.8, 0.2], [-0.5, 0.7, 0.6]])
INDUCED = 1e-3 * np.array([[6.0, -1.0, 2.0], [0.5, -4.0, 1.0], [1.5, 0.8, 3.0]])


def _flight(seed: int, *, turns: int = 4) -> tuple[peer.Flight, np.ndarray]:
    """A circuit with maneuvers; the flight without a target, and its background in body axes."""
    random = np.random.default_rng(seed)
    time_s = np.arange(turns * 60 * RATE_HZ) / RATE_HZ
    leg = np.floor(time_s / 60.0)
    swing = [sum(a * np.sin(2 * np.pi * time_s / p) for a, p in random.uniform((2, 5), (6, 9), (2, 2))) for _ in "rpy"]
    attitude = np.radians(np.column_stack([swing[0], swing[1], 90.0 * leg + swing[2]]))
    model = np.tile(MODEL_NT, (len(time_s), 1))
    nothing = np.empty((len(time_s), 0))
    flight = peer.Flight(time_s, model, model, attitude, nothing, nothing)
    field = flight.turned
    # a fluxgate with offsets and skewed axes
    flux = field @ SKEW.T + 50.0 + 0.1 * random.standard_normal(field.shape)
    return replace(flight, flux=flux), field


def _interference(field: np.ndarray) -> np.ndarray:
    return np.linalg.norm(field + PERMANENT_NT + field @ INDUCED.T, axis=1) - np.linalg.norm(field, axis=1)


def test_the_model_field_is_turned_into_body_axes():
    level = peer.Flight(
        np.arange(2.0),
        np.zeros((2, 3)),
        np.tile([1.0, 2.0, 3.0], (2, 1)),
        np.radians([[0, 0, 90], [90, 0, 0]]),
        np.empty((2, 0)),
        np.empty((2, 0)),
    )
    # heading east: forward is east, right is south; right wing down: right is down, down is to the left
    assert level.turned == pytest.approx(np.array([[2.0, -1.0, 3.0], [1.0, 3.0, -2.0]]))


def test_play_lags_by_its_half_width_and_starts_as_flown_before():
    model = np.tile([10000.0, 0.0, 0.0], (4, 1))
    flight = peer.Flight(np.arange(4.0), model, model, np.zeros((4, 3)), np.empty((4, 0)), np.empty((4, 0)))
    field = np.zeros((4, 3))
    field[:, 0] = [0.0, 2.0, 0.0, -2.0]
    # half widths 0.25, 0.75, 1.5 of the mean length; second time around
    states = np.array([[-0.25, -0.75, -0.5], [1.75, 1.25, 0.5], [0.25, 0.75, 0.5], [-1.75, -1.25, -0.5]])
    assert peer._play(field, flight)[:, 0] == pytest.approx(states.mean(axis=1))


@pytest.fixture(scope="module")
def fitted():
    flight, field = _flight(1)
    noise = 0.01 * np.random.default_rng(2).standard_normal(len(field))
    return peer.fit([replace(flight, target=_interference(field) + noise)])


def test_a_flight_that_it_has_not_seen_is_compensated_to_millis(fitted):
    flight, field = _flight(3)
    truth = _interference(field)
    left = band_pass(truth - fitted.interference(flight), RATE_HZ)[off_ends(flight.time_s)]
    raw = band_pass(truth, RATE_HZ)[off_ends(flight.time_s)]
    assert np.std(raw) > 3.0
    assert np.std(left) < 1e-3 * np.std(raw)


def test_its_background_is_sharper_than_what_it_reads(fitted):
    flight, field = _flight(3)
    assert np.std(fitted.background(flight) - field) < 0.1 * np.std(flight.flux - field)


def test_its_coefficients_are_the_most_probable_ones(fitted):
    flight, field = _flight(1)
    background = fitted.background(flight)
    vectors, priors = peer._columns(flight, background / fitted.strength_nt)
    noise = 0.01 * np.random.default_rng(2).standard_normal(len(field))
    keep = off_ends(flight.time_s)

    def left(sources):
        estimate = np.linalg.norm(background + vectors @ sources, axis=1) - np.linalg.norm(background, axis=1)
        return band_pass(_interference(field) + noise - estimate, RATE_HZ)[keep]

    sigma = max(float(np.std(left(fitted.sources))), peer.LEAST_NOISE_NT)

    def cost(sources):
        return np.sum(left(sources) ** 2) / (peer.ROWS_AS_ONE * sigma**2) + np.sum((sources / priors) ** 2)

    least = cost(fitted.sources)
    random = np.random.default_rng(4)
    for _ in range(20):
        assert cost(fitted.sources + 0.02 * priors * random.standard_normal(len(priors))) > least


def test_the_peer_is_judged_as_any_method():
    assert not PeerMethod().causal

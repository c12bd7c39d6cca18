"""Bending of a mount against the closed forms of an oscillator and of a beam."""

import numpy as np
import pytest

from magsim.field.flex import REACH_M, BendingMode, bend, moved
from magsim.field.load import specific_force
from magsim.field.sources.dipoles import dipole_field
from magsim.frames import rot_nb_from_attitude
from magsim.trajectory import Trajectory
from magsim.units import G0
from tests.support.dipoles import dipole_gradient

DOWN = np.array([0.0, 0.0, 1.0])
STEP = 1.0 / 120.0
MODE = BendingMode(DOWN, 4.0, 0.03, 1.566, np.zeros(3))
OMEGA = 2.0 * np.pi * 4.0


def force(load_g: np.ndarray) -> np.ndarray:
    """Specific force of a load factor: straight flight has (0, 0, -g)."""
    return -G0 * load_g[:, None] * DOWN


def test_straight_flight_leaves_the_mount_where_it_was_measured() -> None:
    assert not np.any(bend(MODE, force(np.ones(50)), STEP))


def test_one_more_g_bends_it_by_the_static_deflection() -> None:
    """Held for long, and from the first sample on; down, along +z."""
    out = bend(MODE, force(np.full(200, 2.0)), STEP)
    np.testing.assert_allclose(out, 1.566 * G0 / OMEGA**2, rtol=1e-12)


def test_first_mode_of_a_cantilever_sags_like_the_beam() -> None:
    """Tip of a uniform beam under its weight: w L^4 / (8 E I), and the first mode alone 1.3 % more."""
    first = 1.87510407
    sag_over = (1.566 / first**4) / (1.0 / 8.0)
    assert sag_over == pytest.approx(1.0134, abs=5e-4)


@pytest.mark.parametrize("hertz", [0.2, 1.0, 4.0, 9.0])
def test_harmonic_load(hertz: float) -> None:
    """Amplitude and phase of a driven oscillator; at resonance 1 / (2 damping) of the static deflection."""
    time = np.arange(120 * 60) * STEP
    omega = 2.0 * np.pi * hertz
    out = bend(MODE, force(1.0 + 0.3 * np.cos(omega * time)), STEP)
    gain = 1.566 * 0.3 * G0 / (OMEGA**2 - omega**2 + 2j * 0.03 * OMEGA * omega)
    # A load that is straight between samples is smaller by sinc^2 of the frequency over the rate.
    gain *= np.sinc(hertz * STEP) ** 2
    exact = (gain * np.exp(1j * omega * time)).real
    late = slice(120 * 30, None)
    assert np.abs(out - exact)[late].max() < 3e-4 * abs(gain)
    if hertz == 4.0:
        static = 1.566 * 0.3 * G0 / OMEGA**2
        assert np.abs(out[late]).max() == pytest.approx(static / 0.06, rel=0.01)


def test_free_ringing_decays() -> None:
    """A load that is let go: frequency and decrement of the damped oscillator."""
    load = np.where(np.arange(1000) < 1, 2.0, 1.0)
    out = bend(MODE, force(load), STEP)
    time = np.arange(1000) * STEP
    damped = OMEGA * np.sqrt(1.0 - 0.03**2)
    # From one sample after the step on it rings freely: x = Re(c exp(rate t)).
    rate = complex(-0.03 * OMEGA, damped)
    basis = np.exp(rate * time[1:])
    table = np.column_stack([basis.real, basis.imag])
    weights, *_ = np.linalg.lstsq(table, out[1:], rcond=None)
    assert np.abs(table @ weights - out[1:]).max() < 1e-12


def trajectory(time_s: np.ndarray, attitude: np.ndarray, rate_b: np.ndarray, velocity_n: np.ndarray) -> Trajectory:
    n = len(time_s)
    return Trajectory(time_s, np.zeros(n), np.zeros(n), np.full(n, 1000.0), velocity_n, attitude, rate_b)


def test_specific_force_of_a_level_turn() -> None:
    """Coordinated at 30 degrees: 1 / cos of the weight along the body's down axis, nothing sideways."""
    bank, speed = np.radians(30.0), 60.0
    turn = G0 * np.tan(bank) / speed
    time = np.arange(600) * STEP
    heading = turn * time
    zero = np.zeros(600)
    attitude = np.column_stack([zero + bank, zero, heading])
    rate = np.column_stack([zero, turn * np.sin(bank) + zero, turn * np.cos(bank) + zero])
    velocity = speed * np.column_stack([np.cos(heading), np.sin(heading), zero])
    motion = trajectory(time, attitude, rate, velocity)
    out = specific_force(motion, rot_nb_from_attitude(attitude), STEP, np.zeros(3))
    np.testing.assert_allclose(out, np.tile([0.0, 0.0, -G0 / np.cos(bank)], (600, 1)), atol=1e-7)


def test_specific_force_at_the_end_of_an_arm() -> None:
    """Pitching about the center of gravity: tangential and centripetal acceleration 11 m behind it."""
    time = np.arange(1200) * STEP
    omega, swing = 1.3, np.radians(6.0)
    pitch = swing * np.sin(omega * time)
    q, q_dot = swing * omega * np.cos(omega * time), -swing * omega**2 * np.sin(omega * time)
    zero = np.zeros(1200)
    attitude = np.column_stack([zero, pitch, zero])
    motion = trajectory(time, attitude, np.column_stack([zero, q, zero]), np.zeros((1200, 3)))
    rot_nb = rot_nb_from_attitude(attitude)
    arm = np.array([-11.0, 0.0, 0.0])
    there, here = (specific_force(motion, rot_nb, STEP, place) for place in (arm, np.zeros(3)))
    # (0, q', 0) x (-11, 0, 0) = (0, 0, 11 q');  q x (q x r) = (11 q^2, 0, 0).
    np.testing.assert_allclose(there - here, np.column_stack([11.0 * q**2, zero, 11.0 * q_dot]), atol=1e-6)


def test_way_times_gradient_is_the_field_there_to_second_order() -> None:
    """A dipole 1.7 m away, by its field around the mount."""
    position, moment, point = np.zeros(3), np.array([5.0, -3.0, 8.0]), np.array([1.5, 0.4, -0.7])
    places = [point + sign * REACH_M * np.eye(3)[k] for k in range(3) for sign in (1, -1)]
    around = dipole_field(position, moment, np.array(places))[None]
    slopes = (around[0, 0::2] - around[0, 1::2]) / (2.0 * REACH_M)
    np.testing.assert_allclose(slopes.T, dipole_gradient(position, moment, point), atol=5e-4 * np.abs(slopes).max())
    errors = []
    for size in (0.04, 0.02, 0.01):
        shift = size * np.array([[0.3, -0.5, 0.8]])
        exact = dipole_field(position, moment, point + shift) - dipole_field(position, moment, point)
        errors.append(np.abs(moved(around, {"mount": shift})["mount"] - exact).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 2.0, atol=0.1)

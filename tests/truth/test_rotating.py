"""What turns faster than it is sampled: means over steps, their sums over the window of a counter, its alias."""

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.interpolate import CubicSpline

from magsim.field.sources.dipoles import dipole_field
from magsim.field.sources.rotors import (
    Rotation,
    ShaftDipole,
    SpinningDipole,
    mean_moment,
    mean_tone,
    rotating_moment,
    rotation_of,
    rotor_stream,
    wander,
)
from magsim.units import MU0, NT_PER_T
from tests.support.rotations import rotate_about

TONES_HZ = (31.7, 103.0)
PART = ShaftDipole(
    position=np.array([4.0, 0.1, -0.2]),
    axis=np.array([1.0, 0.0, 0.0]),
    moment=np.array([1.5, 0.6, -0.5]),
    blade=np.array([0.0, 0.6, 0.8]),
    polarizability=np.array([3e-3, 1e-3, 2e-3]),
)
POINTS = np.array([[0.0, 0.0, 0.0], [-11.0, 0.5, -0.8]])


def steady(time_s: np.ndarray, hertz: float, phase: float = 0.7) -> Rotation:
    omega, zero = 2.0 * np.pi * hertz, np.zeros(len(time_s))
    return Rotation(phase + omega * time_s, zero + omega, zero, zero)


def windows(values: np.ndarray, count: int) -> np.ndarray:
    """Means over consecutive windows of so many steps."""
    return values[: len(values) // count * count].reshape(-1, count).mean(axis=1)


@pytest.mark.parametrize("step_hz", [120, 240])
@pytest.mark.parametrize("hertz", TONES_HZ)
def test_a_counter_over_whole_steps_reads_the_integral(hertz: float, step_hz: int) -> None:
    """100 ms of steps against the integral of the tone over the same 100 ms."""
    step = 1.0 / step_hz
    time = (np.arange(40 * step_hz // 10) + 0.5) * step
    read = windows(mean_tone(steady(time, hertz), step), step_hz // 10)
    omega, edges = 2.0 * np.pi * hertz, np.arange(41) * 0.1
    primitive = np.exp(1j * (0.7 + omega * edges)) / (1j * omega)
    exact = np.diff(primitive) / 0.1
    np.testing.assert_allclose(read, exact, rtol=1e-9)


@pytest.mark.parametrize("hertz", TONES_HZ)
def test_a_speeding_rotor(hertz: float) -> None:
    """Speed, rise and jerk of the roughest flight, by quadrature."""
    step, rise, jerk = 1.0 / 120.0, 40.0, 600.0
    time = (np.arange(12) - 5.5) * step

    def phase(t: float) -> float:
        return 0.3 + 2.0 * np.pi * hertz * t + rise * t**2 / 2.0 + jerk * t**3 / 6.0

    motion = Rotation(
        np.array([phase(t) for t in time]),
        2.0 * np.pi * hertz + rise * time + jerk * time**2 / 2.0,
        rise + jerk * time,
        np.full(12, jerk),
    )
    options = {"limit": 400, "epsabs": 1e-14, "epsrel": 1e-13}
    for k, value in enumerate(mean_tone(motion, step)):
        low, high = time[k] - 0.5 * step, time[k] + 0.5 * step
        real, imag = (quad(lambda t, f=f: f(phase(t)), low, high, **options)[0] / step for f in (math.cos, math.sin))
        assert abs(value - complex(real, imag)) < 5e-9


def test_a_rotor_at_rest_and_backward() -> None:
    """No speed: the value itself; turning back: the mean of the conjugate."""
    time, zero = np.linspace(0.0, 1.0, 50), np.zeros(50)
    rest = mean_tone(Rotation(zero + 0.4, zero, zero, zero), 0.01)
    np.testing.assert_allclose(rest, np.exp(0.4j), rtol=1e-15)
    forward, back = (
        mean_tone(Rotation(s * 200.0 * time, s * (zero + 200.0), s * (zero + 30.0), s * (zero + 500.0)), 0.01)
        for s in (1, -1)
    )
    np.testing.assert_allclose(back, forward.conj(), rtol=1e-14)


def test_small_angles_join_the_recurrence() -> None:
    """Both forms of the Bessel functions at the speed where they meet."""
    speeds = np.array([0.4999, 0.5001]) * 2.0 / 0.01
    motion = Rotation(np.zeros(2), speeds, np.full(2, 2000.0), np.full(2, 1e5))
    low, high = mean_tone(motion, 0.01)
    slope = 0.0002 * 0.35  # of j0 there, the largest change
    assert abs(low - high) < slope


@pytest.mark.parametrize(("hertz", "alias_hz"), [(31.7, 1.7), (103.0, 3.0), (83.4, 3.4), (96.2, 3.8)])
def test_alias_is_that_of_ten_rows_a_second(hertz: float, alias_hz: float) -> None:
    """A 100 ms counter read ten times a second folds the tone to |f - 10 k|, at any step of the simulation."""
    read = []
    for step_hz in (120, 240):
        time = (np.arange(100 * step_hz) + 0.5) / step_hz
        read.append(windows(mean_tone(steady(time, hertz), 1.0 / step_hz), step_hz // 10).real)
    np.testing.assert_allclose(read[0], read[1], atol=1e-12)
    spectrum = np.abs(np.fft.rfft(read[0] * np.hanning(1000)))
    peak = np.fft.rfftfreq(1000, 0.1)[spectrum.argmax()]
    assert peak == pytest.approx(alias_hz, abs=0.011)
    gain = abs(np.sinc(hertz * 0.1))
    assert np.std(read[0]) * np.sqrt(2.0) == pytest.approx(gain, rel=2e-3)


def test_phase_is_the_integral_of_the_logged_speed() -> None:
    """A speed that swings: its spline's phase against the primitive of the sine; zero time has the given phase."""
    logged = np.arange(-4.0, 64.0, 1.0 / 30.0)
    speed = CubicSpline(logged, 199.0 + 3.0 * np.sin(0.9 * logged))
    time = np.arange(-2.0, 60.0, 1.0 / 120.0)
    motion = rotation_of(time, [speed], 0.25)
    exact = 0.25 + 199.0 * time + 3.0 / 0.9 * (1.0 - np.cos(0.9 * time))
    assert np.abs(motion.phase - exact).max() < 1e-5
    assert np.interp(0.0, time, motion.phase) == pytest.approx(0.25)
    np.testing.assert_allclose(motion.rise[10:-10], 2.7 * np.cos(0.9 * time)[10:-10], atol=1e-3)


def test_wander_is_a_gauss_markov_process_of_its_seed() -> None:
    time = np.array([0.0, 40000.0])
    spline = wander(time, 2.0, 5.0, rotor_stream(3, "propeller"))
    values = spline(np.arange(0.0, 40000.0, 0.1))
    assert np.std(values) == pytest.approx(2.0, rel=0.05)
    assert np.mean(values[50:] * values[:-50]) / np.var(values) == pytest.approx(math.exp(-1.0), abs=0.05)
    again = wander(time, 2.0, 5.0, rotor_stream(3, "propeller"))(time)
    np.testing.assert_array_equal(spline(time), again)
    assert not np.any(wander(time, 2.0, 5.0, rotor_stream(4, "propeller"))(time) == again)
    assert not np.any(wander(time, 0.0, 5.0, rotor_stream(3, "propeller"))(time))


def mean_field(part: ShaftDipole, motion: Rotation, step_s: float, ambient_b: np.ndarray) -> np.ndarray:
    return SpinningDipole(part, rotating_moment(part, motion, step_s, ambient_b)).at(POINTS)


def turned(angle: np.ndarray, vector: np.ndarray) -> np.ndarray:
    return rotate_about(PART.axis, angle, vector)


def test_slow_field_is_that_of_the_turned_dipole_and_steel() -> None:
    """Hardly any turning in a step: the dipole of the turned moment, and of what the turned steel takes on."""
    angle = np.linspace(0.0, 7.0, 40)
    zero = np.zeros(40)
    ambient = np.array([30000.0, -5000.0, 20000.0]) + 100.0 * np.sin(angle)[:, None]
    field = mean_field(PART, Rotation(angle, zero, zero, zero), 1.0 / 120.0, ambient)
    side = np.cross(PART.axis, PART.blade)
    moment = turned(angle, PART.moment)
    for size, unit in zip(PART.polarizability, (PART.blade, side, PART.axis), strict=True):
        direction = turned(angle, unit)
        taken = np.einsum("ni,ni->n", direction, ambient) / NT_PER_T / MU0
        moment = moment + size * taken[:, None] * direction
    for s, point in enumerate(POINTS):
        np.testing.assert_allclose(field[:, s], dipole_field(PART.position, moment, point), rtol=1e-11)


def test_fast_field_is_the_mean_over_the_step() -> None:
    """The field of the instant, averaged over many angles of each step."""
    step, fine = 1.0 / 120.0, 2000
    time = np.arange(6) * step
    ambient = np.array([30000.0, -5000.0, 20000.0])
    field = mean_field(PART, steady(time, 103.0), step, np.tile(ambient, (6, 1)))
    inside = (np.arange(fine) + 0.5) / fine - 0.5
    still = np.zeros(fine)
    for n, t in enumerate(time):
        angle = 0.7 + 2.0 * np.pi * 103.0 * (t + inside * step)
        instants = mean_field(PART, Rotation(angle, still, still, still), step, np.tile(ambient, (fine, 1)))
        np.testing.assert_allclose(field[n], instants.mean(axis=0), atol=2e-7)


def test_moment_along_the_axis_stays() -> None:
    part = ShaftDipole(PART.position, PART.axis, 2.0 * PART.axis, PART.blade, np.zeros(3))
    time = np.arange(30) / 120.0
    field = mean_field(part, steady(time, 31.7), 1.0 / 120.0, np.zeros((30, 3)))
    exact = dipole_field(part.position, part.moment, POINTS)
    np.testing.assert_allclose(field, np.broadcast_to(exact, field.shape), rtol=1e-12)


def test_mean_over_whole_turns_is_what_long_steps_leave() -> None:
    """Of the moment over a step of many turns: the permanent part along the axis, and the mean of the steel."""
    time = np.arange(5) * 10.0
    ambient = np.array([30000.0, -5000.0, 20000.0]) + 50.0 * time[:, None]
    stepped = rotating_moment(PART, steady(time, 31.7), 10.0, ambient)
    mean = mean_moment(PART, ambient)
    assert np.abs(stepped - mean).max() < 2e-3 * np.abs(mean).max()
    bare = ShaftDipole(PART.position, PART.axis, PART.moment, PART.blade, np.zeros(3))
    np.testing.assert_allclose(mean_moment(bare, ambient), np.tile([1.5, 0.0, 0.0], (5, 1)), atol=1e-15)


def test_moving_places_and_fixed_points_agree() -> None:
    dipole = SpinningDipole(
        PART, rotating_moment(PART, steady(np.arange(4) / 120.0, 31.7), 1.0 / 120.0, np.ones((4, 3)))
    )
    np.testing.assert_allclose(dipole.along(np.tile(POINTS, (4, 1, 1))), dipole.at(POINTS), rtol=1e-12)

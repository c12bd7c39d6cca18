"""Accelerometers and gyros: the true motion in inertial space by another way, and each error against its formula."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from magsim.earth import ecef_from_geodetic, radii_of_curvature, rot_ne_at
from magsim.earth.gravity import gravity_n
from magsim.frames import rot_nb_from_attitude
from magsim.scenario import Ins
from magsim.sensors import Acquisition
from magsim.sensors.inertial import accelerometers, gyros, inertial_columns, inertial_rate, specific_force
from magsim.trajectory import Trajectory
from tests.support.allan import allan, gauss_markov_allan
from tests.support.rotations import body_rates

SPIN = 7.292115e-5
START, LOG_HZ, DURATION = -3.0, 30.0, 60.0
ACC, RATE = ([f"{kind}_{axis}_{unit}" for axis in "xyz"] for kind, unit in (("acc", "mps2"), ("rate", "dps")))


def derivative(function: Callable, t: np.ndarray) -> np.ndarray:
    h = 1e-3
    return (8.0 * (function(t + h) - function(t - h)) - (function(t + 2 * h) - function(t - 2 * h))) / (12.0 * h)


def lively(t):
    """Latitude, longitude [rad], height [m], attitude [rad]: a climbing, weaving flight at 60 degrees south."""
    lat = np.radians(-60.0) + 1.1e-5 * t + 3e-6 * np.sin(0.4 * t)
    lon = 2.0 + 1.5e-5 * t + 4e-6 * np.cos(0.5 * t)
    alt = 2500.0 + 2.0 * t + 8.0 * np.sin(0.7 * t)
    angles = [0.4 * np.sin(0.8 * t), 0.05 + 0.1 * np.sin(1.1 * t), 1.0 + 0.05 * t + 0.1 * np.sin(0.9 * t)]
    return lat, lon, alt, np.stack(angles, axis=-1)


def resting(t):
    zero = 0.0 * t
    return np.radians(35.0) + zero, 1.0 + zero, 1200.0 + zero, np.stack([0.3 + zero, -0.2 + zero, 2.0 + zero], axis=-1)


def trajectory(course=lively, stop=DURATION + 3.0, log_hz=LOG_HZ):
    t = np.arange(round(START * log_hz), round(stop * log_hz) + 1) / log_hz
    lat, lon, alt, attitude = course(t)
    rates = [derivative(lambda s, k=k: course(s)[k], t) for k in range(4)]
    meridian, normal = radii_of_curvature(lat)
    velocity = np.stack([(meridian + alt) * rates[0], (normal + alt) * np.cos(lat) * rates[1], -rates[2]], axis=-1)
    return Trajectory(t, lat, lon, alt, velocity, attitude, body_rates(attitude, rates[3]))


def spun(t):
    """Rotation from Earth-fixed to inertial axes."""
    return Rotation.from_rotvec(np.multiply.outer(t, [0.0, 0.0, SPIN]))


def place_i(t, course=lively):
    return spun(t).apply(ecef_from_geodetic(*course(t)[:3]))


def attitude_i(t, course=lively):
    lat, lon, _, attitude = course(t)
    rot_eb = np.swapaxes(rot_ne_at(lat, lon), -1, -2) @ rot_nb_from_attitude(attitude)
    return spun(t) * Rotation.from_matrix(rot_eb)


def attraction_i(t, course=lively):
    """Gravity without what turning takes off, in inertial axes."""
    lat, lon, alt, _ = course(t)
    place_e = ecef_from_geodetic(lat, lon, alt)
    pull_e = np.einsum("nji,nj->ni", rot_ne_at(lat, lon), gravity_n(lat, alt)) - SPIN**2 * place_e * [1.0, 1.0, 0.0]
    return spun(t).apply(pull_e)


def rows(rate_hz=10.0, duration=DURATION):
    t = np.arange(-360, round((duration + 3.0) * 120.0) + 1) / 120.0
    return Acquisition.of(t, duration, 120.0, rate_hz)


def triads(out, kind):
    acc, rate = (np.stack([out[f"{kind}_{name}"] for name in names], axis=1) for names in (ACC, RATE))
    return acc, rate


def truth_of(out):
    acc = np.stack([out[f"true_{name}"] for name in ACC], axis=1)
    return acc, np.stack([out[f"true_inertial_{name}"] for name in RATE], axis=1)


def test_specific_force_is_acceleration_in_inertial_space_less_attraction():
    """Second differences of the place seen from the stars: no Coriolis, no transport, no centrifugal term."""
    log = trajectory()
    t = np.linspace(0.0, 60.0, 97)
    h = 0.02
    accelerated = sum(w * place_i(t + k * h) for k, w in ((-2, -1.0), (-1, 16.0), (0, -30.0), (1, 16.0), (2, -1.0))) / (
        12.0 * h**2
    )
    wanted = attitude_i(t).inv().apply(accelerated - attraction_i(t))
    got = specific_force(log, t)
    assert np.ptp(got, axis=0).min() > 1.0
    # Places are known to 1e-9 m: differences over 0.02 s to 2e-5; the spline through 30 rows a second is as good.
    np.testing.assert_allclose(got, wanted, rtol=0, atol=1e-4)


def test_gyros_feel_what_turns_the_attitude_against_the_stars():
    t, h = np.linspace(0.0, 60.0, 97), 1e-3
    turned = (attitude_i(t - h).inv() * attitude_i(t + h)).as_rotvec() / (2.0 * h)
    np.testing.assert_allclose(inertial_rate(trajectory(), t), turned, rtol=0, atol=2e-6)


def test_at_rest_an_accelerometer_reads_minus_gravity_and_a_gyro_the_turning_earth():
    log = trajectory(resting, stop=10.0)
    t = np.array([0.0, 5.0])
    path = log.at(t)
    rot_bn = rot_nb_from_attitude(path.attitude[0]).T
    lat = np.radians(35.0)
    force, rate = specific_force(log, t), inertial_rate(log, t)
    np.testing.assert_allclose(force, [-rot_bn @ gravity_n(lat, 1200.0)] * 2, rtol=0, atol=1e-9)
    assert np.linalg.norm(force[0]) == pytest.approx(9.7933, abs=1e-3)  # 9.7973 at 35 degrees, less 0.003086 each km
    np.testing.assert_allclose(rate, [SPIN * rot_bn @ [np.cos(lat), 0.0, -np.sin(lat)]] * 2, rtol=0, atol=1e-12)
    assert np.degrees(np.linalg.norm(rate[0])) * 3600.0 == pytest.approx(15.0411, abs=1e-4)
    np.testing.assert_allclose(path.rate_b, 0.0, atol=1e-15)


@pytest.mark.parametrize("bank_deg", [20.0, -45.0])
def test_a_coordinated_turn_is_felt_straight_down(bank_deg):
    """``1 / cos(bank)`` g along the body's z axis; the Earth's turning and roundness are a thousandth of it."""
    bank, speed, g = np.radians(bank_deg), 70.0, 9.80
    turning = g * np.tan(bank) / speed
    radius = 6.37e6

    def circle(t):
        angle = turning * t
        lat = np.radians(45.0) + speed / turning * np.sin(angle) / radius
        lon = speed / turning * (1.0 - np.cos(angle)) / radius / np.cos(np.radians(45.0))
        return lat, lon, 0.0 * t, np.stack([bank + 0.0 * t, 0.0 * t, angle], axis=-1)

    log = trajectory(circle, stop=30.0)
    path = log.at(np.arange(0.0, 27.0, 0.5))
    force = specific_force(log, path.time_s) / g
    np.testing.assert_allclose(force, [[0.0, 0.0, -1.0 / np.cos(bank)]] * len(path), rtol=0, atol=0.012)
    wanted = turning * np.array([0.0, np.sin(bank), np.cos(bank)])
    np.testing.assert_allclose(inertial_rate(log, path.time_s), [wanted] * len(path), rtol=0, atol=1e-4)


def test_there_and_back():
    """Attitude, velocity and place again out of the readings alone, from where the flight began."""
    out = inertial_columns(Ins(), trajectory(), rows(20.0), 1)
    force, rate = triads(out, "ins")
    t, step = rows(20.0).time_s, 0.01
    force_at, rate_at = CubicSpline(t, force), CubicSpline(t, np.radians(rate))
    fine = np.arange(0.0, DURATION + 1e-9, step)
    attitude = attitude_i(fine[:1])[0]
    velocity, place = derivative(place_i, fine[:1])[0], place_i(fine[:1])[0]
    pull = attraction_i(fine + 0.5 * step)
    for k, start in enumerate(fine[:-1]):
        turn = step * rate_at(start + 0.5 * step)
        acceleration = (attitude * Rotation.from_rotvec(0.5 * turn)).apply(force_at(start + 0.5 * step)) + pull[k]
        place = place + step * velocity + 0.5 * step**2 * acceleration
        velocity = velocity + step * acceleration
        attitude = attitude * Rotation.from_rotvec(turn)
    end = fine[-1:]
    assert np.degrees((attitude.inv() * attitude_i(end)[0]).magnitude()) < 0.002
    np.testing.assert_allclose(velocity, derivative(place_i, end)[0], rtol=0, atol=0.01)
    np.testing.assert_allclose(place, place_i(end)[0], rtol=0, atol=0.3)


def test_a_perfect_ins_reads_the_truth_and_the_truth_is_the_flight():
    out = inertial_columns(Ins(), trajectory(), rows(), 1)
    log, t = trajectory(), rows().time_s
    for read, true in zip(triads(out, "ins"), truth_of(out), strict=True):
        np.testing.assert_array_equal(read, true)
    np.testing.assert_allclose(truth_of(out)[0], specific_force(log, t), rtol=0, atol=2e-3)
    np.testing.assert_allclose(np.radians(truth_of(out)[1]), inertial_rate(log, t), rtol=0, atol=2e-4)


@pytest.mark.parametrize("log_hz", [30.0, 60.0])
def test_what_is_faster_than_the_rows_does_not_fold(log_hz):
    """A shake at 9.7 Hz would be seen at 0.3 Hz."""

    def shaken(t):
        lat, lon, alt, attitude = resting(t)
        shake = np.sin(2.0 * np.pi * 9.7 * t)
        return lat, lon, alt + 1e-3 * shake, attitude + 1e-3 * shake[:, None]

    out = inertial_columns(Ins(), trajectory(shaken, stop=30.0, log_hz=log_hz), rows(duration=20.0), 1)
    force, rate = truth_of(out)
    assert np.abs(trajectory(shaken, stop=30.0).rate_b).max() > 0.05
    assert np.ptp(force, axis=0).max() < 2e-3  # of 3.7 m/s^2 of the shake
    assert np.ptp(rate, axis=0).max() < 2e-3  # of 3.5 deg/s


def test_each_constant_error_alone():
    keys = {
        "acc_bias_mps2": (0.1, -0.2, 0.3),
        "acc_scale_error": (0.01, 0.0, -0.02),
        "rate_bias_dps": (0.01, 0.02, -0.03),
        "rate_scale_error": (0.0, 0.01, 0.0),
    }
    out = inertial_columns(Ins(**keys), trajectory(), rows(), 1)
    for triad, true, name in zip(triads(out, "ins"), truth_of(out), ("acc", "rate"), strict=True):
        bias = keys["acc_bias_mps2" if name == "acc" else "rate_bias_dps"]
        wanted = (1.0 + np.array(keys[f"{name}_scale_error"])) * true + np.array(bias)
        np.testing.assert_allclose(triad, wanted, rtol=0, atol=1e-12)


def test_readings_are_whole_steps():
    out = inertial_columns(Ins(acc_step_mps2=0.01, rate_step_dps=0.25), trajectory(), rows(), 1)
    for triad, true, step in zip(triads(out, "ins"), truth_of(out), (0.01, 0.25), strict=True):
        np.testing.assert_allclose(triad / step, np.round(triad / step), rtol=0, atol=1e-9)
        assert 0.3 * step < np.abs(triad - true).max() <= 0.5 * step + 1e-9


@pytest.mark.parametrize("skew", [0.1, -0.1, 0.033])
def test_they_are_late_as_the_ins_is(skew):
    late = inertial_columns(Ins(skew_s=skew), trajectory(), rows(), 1)
    right = inertial_columns(Ins(), trajectory(), rows(), 1)
    for before, after in zip(truth_of(right), truth_of(late), strict=True):
        np.testing.assert_array_equal(before, after)
    for triad, true in zip(triads(late, "ins"), truth_of(right), strict=True):
        wanted = CubicSpline(rows().time_s, true)(rows().time_s[20:-20] - skew)
        np.testing.assert_allclose(triad[20:-20], wanted, rtol=0, atol=2e-4 * np.abs(true).max())


@pytest.mark.parametrize("preset", ["ins_survey", "ins_mems"])
@pytest.mark.parametrize("triad", [accelerometers, gyros])
def test_allan_deviation_of_a_preset(preset, triad):
    """White noise falls as ``d / sqrt(2 T)``, the drift adds its hump; nothing else is there."""
    instrument = triad(Ins(preset=preset))
    rate_hz = 10.0
    error = instrument(np.zeros((400_000, 3)), rate_hz, "x", 3) - np.array(instrument.bias)
    for window in (0.1, 1.0, 30.0, 300.0):
        white = instrument.noise / np.sqrt(2.0 * window)
        wanted = np.hypot(white, gauss_markov_allan(instrument.drift, instrument.correlation_s, window))
        seen = np.sqrt(np.mean([allan(error[:, k], rate_hz, window) ** 2 for k in range(3)]))
        assert seen == pytest.approx(wanted, rel=0.07), window  # 4000 windows of 300 s in all: 3 %


def test_noise_has_streams_of_its_own():
    one = inertial_columns(Ins(acc_noise_mps2_rthz=0.01), trajectory(), rows(), 1)
    both = inertial_columns(Ins(acc_noise_mps2_rthz=0.01, rate_noise_dps_rthz=0.1), trajectory(), rows(), 1)
    other = inertial_columns(Ins(acc_noise_mps2_rthz=0.01), trajectory(), rows(), 2)
    np.testing.assert_array_equal(one["ins_acc_x_mps2"], both["ins_acc_x_mps2"])
    assert not np.array_equal(one["ins_acc_x_mps2"], other["ins_acc_x_mps2"])
    error = triads(both, "ins")[1] - truth_of(both)[1]
    assert error.std() == pytest.approx(0.1 * np.sqrt(5.0), rel=0.05)
    assert abs(np.corrcoef(error[:, 0], error[:, 1])[0, 1]) < 0.12


def test_presets_are_of_their_grade():
    survey, mems = Ins(preset="ins_survey"), Ins(preset="ins_mems")
    for key in ("acc_noise_mps2_rthz", "acc_drift_mps2", "rate_noise_dps_rthz", "rate_drift_dps"):
        assert 0.0 < getattr(survey, key) < 0.5 * getattr(mems, key)

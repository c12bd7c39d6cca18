"""What each preset promises, seen in the recorded errors."""

import numpy as np
import pytest
from scipy import signal

from magsim.frames import rot_nb_from_attitude
from magsim.scenario import FluxgateSensor, Ins, ScalarSensor
from magsim.sensors import Acquisition
from magsim.sensors.fluxgate import fluxgate_columns, sensing_axes
from magsim.sensors.navigation import ins_columns
from magsim.sensors.scalar import scalar_columns
from magsim.sensors.true_motion import true_columns
from magsim.trajectory import Trajectory
from magsim.truth import FieldTruth
from tests.support.allan import allan, gauss_markov_allan

RATE, LONG = 120.0, 1200.0


def still(field_b, duration=LONG):
    """A field that rests, and the acquisition of it."""
    t = np.arange(-360, round((duration + 3.0) * RATE) + 1) / RATE
    parts = {"earth": np.broadcast_to(np.array(field_b, dtype=float), (len(t), 1, 3))}
    return FieldTruth(t, ("cabin",), parts), Acquisition.of(t, duration, RATE, 10.0)


def vapor(**keys):
    return ScalarSensor(name="cabin", mount="cabin", preset="cs_vapor", **keys)


def test_noise_of_cs_vapor():
    """0.004 nT/sqrt(Hz) through a counter of 0.1 s and in steps of 0.001 nT: white from row to row."""
    truth, acquisition = still([0.0, 35e3, 35e3])
    error = scalar_columns(vapor(), truth, acquisition, 1)["error_cabin_nt"]
    step2 = 0.001**2 / 12.0
    for window in (0.1, 1.0, 10.0):
        wanted = np.sqrt(0.004**2 / (2.0 * window) + step2 * 0.1 / window)
        assert allan(error, 10.0, window) == pytest.approx(wanted, rel=0.1), window  # 120 windows of 10 s: 6 %


def test_noise_of_cs_quiet():
    """0.6 pT/sqrt(Hz) and 0.3 pT/sqrt(Hz) at 1 Hz of 1/f noise, through a counter of 0.1 s, in steps of 0.1 pT."""
    truth, acquisition = still([0.0, 35e3, 35e3])
    quiet = ScalarSensor(name="cabin", mount="cabin", preset="cs_quiet")
    error = scalar_columns(quiet, truth, acquisition, 1)["error_cabin_nt"]
    freq, density = signal.welch(error - error.mean(), fs=10.0, nperseg=1024)
    for low, high in ((0.03, 0.1), (0.3, 1.0), (1.0, 2.0)):
        band = (freq > low) & (freq < high)
        # The counter folds white noise back onto the rows: its density stays that of the samples.
        wanted = np.mean(0.0006**2 + 0.0003**2 / freq[band]) + 0.0001**2 / 12.0 / 5.0
        assert density[band].mean() == pytest.approx(wanted, rel=0.2), low
    seen = np.abs(error - error.mean()).max()
    assert seen < 0.02


def test_heading_error_of_cs_quiet_stays_in_its_bound():
    worst = []
    for angle in np.radians(np.arange(11.0, 180.0, 4.0)):
        truth, acquisition = still([50e3 * np.sin(angle), 0.0, 50e3 * np.cos(angle)], duration=1.0)
        quiet = ScalarSensor(name="cabin", mount="cabin", preset="cs_quiet", noise_nt_rthz=0.0, flicker_nt_rthz=0.0)
        out = scalar_columns(quiet, truth, acquisition, 1)
        if out["mag_cabin_valid"][-1]:
            worst.append(abs(out["error_cabin_nt"][-1]))
    assert 0.12 < max(worst) <= 0.2


def test_heading_error_of_cs_vapor_stays_in_its_bound():
    """0.15 nT in sum over all angles at which it reads; beyond them it is marked as invalid."""
    seen, read = [], []
    angles = np.arange(1.0, 180.0, 3.0)
    for angle in np.radians(angles):
        truth, acquisition = still([50e3 * np.sin(angle), 0.0, 50e3 * np.cos(angle)], duration=1.0)
        out = scalar_columns(vapor(noise_nt_rthz=0.0), truth, acquisition, 1)
        seen.append(out["error_cabin_nt"][-1])
        read.append(out["mag_cabin_valid"][-1] == 1.0)
    seen, read = np.array(seen), np.array(read)
    off = np.minimum(angles, 180.0 - angles)
    np.testing.assert_array_equal(read, (off > 15.0) & (off < 75.0))
    # The step adds half of itself.
    assert 0.08 < np.abs(seen[read]).max() <= 0.1505


@pytest.mark.parametrize(("strength", "reads"), [(19_900.0, False), (20_100.0, True), (99e3, True), (101e3, False)])
def test_range_of_cs_vapor(strength, reads):
    truth, acquisition = still([0.0, 0.7 * strength, np.sqrt(1.0 - 0.49) * strength], duration=2.0)
    assert set(scalar_columns(vapor(), truth, acquisition, 1)["mag_cabin_valid"]) == {float(reads)}


def test_noise_of_fluxgate_survey_has_its_density_on_each_axis():
    """0.015 nT/sqrt(Hz), and the steps of 0.1 nT: white, 0.1 / sqrt(12) over 5 Hz."""
    truth, acquisition = still([20e3, -10e3, 40e3])
    out = fluxgate_columns(FluxgateSensor(name="a", mount="cabin", preset="fluxgate_survey"), truth, acquisition, 1)
    smooth = FluxgateSensor(name="a", mount="cabin", preset="fluxgate_survey", step_nt=0.0)
    fine = fluxgate_columns(smooth, truth, acquisition, 1)
    for axis in "xyz":
        error = fine[f"fluxerror_a_{axis}_nt"]
        freq, density = signal.welch(error - error.mean(), fs=10.0, nperseg=256)
        band = (freq > 0.1) & (freq < 2.4)
        assert np.sqrt(density[band].mean()) == pytest.approx(0.015, rel=0.06)
        rounding = out[f"fluxerror_a_{axis}_nt"] - error
        assert np.abs(rounding).max() <= 0.05 + 1e-9


def test_constant_errors_of_fluxgate_survey():
    """Offset, scale, angles, mounting and cross-field of a resting field, written out again."""
    field = np.array([20e3, -10e3, 40e3])
    truth, acquisition = still(field, duration=60.0)
    sensor = FluxgateSensor(name="a", mount="cabin", preset="fluxgate_survey", noise_nt_rthz=0.0, step_nt=0.0)
    out = fluxgate_columns(sensor, truth, acquisition, 1)
    mounted = rot_nb_from_attitude(np.radians([0.4, -0.3, 0.6])).T @ field
    along = (1.0 + np.array([0.002, -0.0015, 0.001])) * (sensing_axes((0.2, -0.15, 0.25)) @ mounted)
    across = np.array([along[1] ** 2 + along[2] ** 2, along[0] ** 2 + along[2] ** 2, along[0] ** 2 + along[1] ** 2])
    wanted = along + [30.0, -20.0, 40.0] + np.array([10.0, -10.0, 10.0]) * across / 50e3**2 - field
    for k, axis in enumerate("xyz"):
        np.testing.assert_allclose(out[f"fluxerror_a_{axis}_nt"], wanted[k], rtol=0, atol=1e-6)
    assert 50.0 < np.abs(wanted).max() < 1000.0


ATTITUDE = {
    "ins_survey": ((0.01, -0.01, 0.03), 0.01, 0.002, 2.0, 300.0),
    "ins_mems": ((0.15, -0.1, 0.4), 0.15, 0.02, 3.0, 120.0),
}
"""Bias, drift and noise [deg], the heading's factor, correlation time [s]: docs/instruments.md."""


@pytest.mark.parametrize("preset", ATTITUDE)
def test_attitude_of_an_ins_preset(preset):
    """Bias plus Gauss-Markov drift plus a little white noise, by its Allan deviation."""
    bias, drift, noise, factor, correlation = ATTITUDE[preset]
    rows = 400_000
    t = np.arange(rows) / 10.0
    zero, still_ = 0.0 * t, np.zeros((rows, 3))
    path = Trajectory(t, zero, zero, zero, still_, still_, still_)
    out, true = ins_columns(Ins(preset=preset, skew_s=0.0), path, 10.0, 4), true_columns(path)
    for k, (angle, times) in enumerate((("roll", 1.0), ("pitch", 1.0), ("heading", factor))):
        error = out[f"ins_{angle}_deg"] - true[f"true_{angle}_deg"]
        error = (error + 180.0) % 360.0 - 180.0
        for window in (0.1, 1.0, 60.0, 400.0):
            white = noise / np.sqrt(10.0 * window)
            wanted = times * np.hypot(white, gauss_markov_allan(drift, correlation, window))
            assert allan(error, 10.0, window) == pytest.approx(wanted, rel=0.2), (angle, window)  # 100 of 400 s: 10 %
        # 40 000 s are some hundred independent values of the drift.
        spread = times * drift * np.sqrt(2.0 * correlation / t[-1])
        assert error.mean() == pytest.approx(bias[k], abs=4.0 * spread)

"""The background of a known world: what the calibration finds, what it refuses, and files."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from magsim.compensation.background import (
    ModelField,
    background_from,
    calibration,
    fit_background,
    live_channels,
    model_along,
)
from magsim.earth import igrf
from magsim.errors import DataError, RequestError
from magsim.signals import in_band
from tests.support.inertial import HARD_NT, MATRIX, Inertial, flown
from tests.support.methods import without


def train_of(recording):
    return recording.take(recording["split"] < 2).labeled()


def error_of(background, recording):
    """In-band deviation of length and direction [nT]; a common rotation, which is of no account, is taken out."""
    truth = np.column_stack([recording[f"earth_cabin_{axis}_nt"] for axis in "xyz"])
    found = background(recording)
    length = in_band(np.linalg.norm(found, axis=1) - np.linalg.norm(truth, axis=1), recording.time_s)
    left, _, right = np.linalg.svd(truth.T @ found)
    vector = in_band(found @ (left @ right).T - truth, recording.time_s)
    return float(length.std()), float(np.abs(vector.std(axis=0)).max())


@pytest.mark.parametrize("labeled", [True, False])
def test_the_calibrated_background_is_true_to_the_noise_of_the_fluxgate(labeled):
    recording = flown()
    train = train_of(recording)
    train = train if labeled else without(train, "interference_")
    field = fit_background("calibrated", [train], "cabin")
    test = recording.where(split="test")
    length, vector = error_of(field, test)
    # 0.1 nT of white noise in each axis is 0.03 nT in band
    assert length < 0.05
    assert vector < 3.0
    assert field.lag_s == pytest.approx(0.15, abs=0.004)
    assert field.lookahead_rows == 8
    assert {channel.name for channel in field.regressors.channels} == {"cur_pump_a", "surface_aileron_deg"}


def test_the_matrix_is_the_inverse_of_what_the_fluxgate_does():
    recording = flown(Inertial(lag_s=0.0, attitude_noise_deg=0.0, flux_noise_nt=0.0))
    field = fit_background("calibrated", [train_of(recording)], "cabin")
    np.testing.assert_allclose(field.matrix[1:4].T, np.linalg.inv(MATRIX), atol=2e-5)
    np.testing.assert_allclose(field.matrix[0], -np.linalg.inv(MATRIX) @ HARD_NT, atol=1.0)


def test_what_the_field_is_more_than_the_model_is_found_for_each_flight():
    offsets = ((90.0, -60.0, 40.0), (-30.0, 80.0, 60.0))
    trains = [train_of(flown(Inertial(offset_n=offset), seed)) for seed, offset in enumerate(offsets)]
    field = fit_background("calibrated", trains, "cabin")
    # what is common to both flights is also what a fluxgate may have: only the difference is told apart
    np.testing.assert_allclose(np.diff(field.offsets_n, axis=0)[0], np.subtract(offsets[1], offsets[0]), atol=25.0)
    assert error_of(field, flown(Inertial(offset_n=offsets[0])).where(split="test"))[0] < 0.06


@pytest.mark.parametrize("labeled", [True, False])
def test_a_last_step_with_the_derivatives_of_the_step_before_misses_nothing(labeled, monkeypatch):
    train = train_of(flown())
    train = train if labeled else without(train, "interference_")
    chord = fit_background("calibrated", [train], "cabin")
    monkeypatch.setattr(calibration, "_FULL_STEPS", 3)
    full = fit_background("calibrated", [train], "cabin")
    one, other = chord(train), full(train)
    np.testing.assert_allclose(one, other, atol=0.1)
    length = in_band(np.linalg.norm(one, axis=1) - np.linalg.norm(other, axis=1), train.time_s)
    assert length.std() < 5e-5


def test_derivatives_of_the_background_are_those_of_a_spline():
    recording = flown(Inertial(flux_noise_nt=0.0))
    field = fit_background("calibrated", [train_of(recording)], "cabin")
    found = field.motion(field.regressors.read(recording), later_s=0.03)
    spline = CubicSpline(recording.time_s, field(recording))
    inside = slice(50, -50)
    for order, values in enumerate(found):
        wanted = spline(recording.time_s + 0.03, order)
        error = (values - wanted)[inside]
        # a second derivative is smoothed: its filter is designed for the noise of the fluxgate
        assert np.sqrt(np.mean(error**2)) < (0.03 if order == 2 else 0.005) * np.std(
            wanted[inside] - wanted[inside].mean(axis=0)
        ), order


def test_a_heading_from_grid_north_is_refused_with_the_remedy():
    recording = flown(Inertial(heading_error_deg=2.0))
    with pytest.raises(DataError, match="Is the heading from grid or magnetic north"):
        fit_background("calibrated", [train_of(recording)], "cabin")


def test_a_recording_without_a_date_is_refused():
    recording = flown()
    undated = replace(train_of(recording), meta={})
    with pytest.raises(RequestError, match="does not say when it was flown"):
        fit_background("calibrated", [undated], "cabin")


def test_the_model_field_is_that_of_the_place_in_the_axes_of_the_body():
    recording = flown(Inertial(attitude_noise_deg=0.0))
    aligned = model_along(recording)
    lat, lon = np.radians(recording["ins_lat_deg"][7]), np.radians(recording["ins_lon_deg"][7])
    expected = igrf(lat, lon, recording["ins_alt_m"][7], 2025.0 + 71.0 / 365.0)
    np.testing.assert_allclose(aligned.field_n[7], expected, atol=0.01)
    truth = np.column_stack([recording[f"earth_cabin_{axis}_nt"] for axis in "xyz"])
    np.testing.assert_allclose(ModelField()(recording), truth, atol=1e-6)


@pytest.mark.parametrize("direction", ["fluxgate", "ins", "calibrated"])
def test_a_background_comes_back_from_its_state(direction):
    recording = flown()
    field = fit_background(direction, [train_of(recording)], "cabin")
    np.testing.assert_array_equal(background_from(field.state())(recording), field(recording))


def test_constant_channels_are_not_used_and_the_zero_of_a_current_is_told_by_its_rest():
    recording = flown()
    noise = 0.004 * np.random.default_rng(1).standard_normal(len(recording))
    flash = np.where(np.arange(len(recording)) % 11 < 2, 9.0, 0.0) + noise
    both = {**recording.data, "cur_dead_a": np.zeros(len(recording)), "cur_steady_a": 7.0 + noise, "cur_flash_a": flash}
    channels = {channel.name: channel for channel in live_channels([replace(recording, data=both)], ["currents"])}
    assert set(channels) == {"cur_pump_a", "cur_flash_a"}
    shifted = replace(recording, data={**recording.data, "cur_pump_a": recording["cur_pump_a"] + 0.08})
    before, after = channels["cur_pump_a"](recording), channels["cur_pump_a"](shifted)
    np.testing.assert_allclose(after[700:], before[700:], atol=4e-3)
    np.testing.assert_allclose(channels["cur_flash_a"].rest, flash.mean(), atol=0.05)

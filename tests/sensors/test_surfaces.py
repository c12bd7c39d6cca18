"""Potentiometers of the control surfaces: each error against its formula, apart from the truth."""

from collections.abc import Mapping

import numpy as np
import pytest

from magsim import columns
from magsim.errors import RequestError
from magsim.loading import load_scenario
from magsim.scenario import Surfaces
from magsim.sensors import Acquisition
from magsim.sensors.surfaces import backlash, surface_columns
from tests.sensors.conftest import RATE, times

IDEAL = {
    "noise_deg_rthz": 0.0,
    "offset_deg": 0.0,
    "scale_error": 0.0,
    "backlash_deg": 0.0,
    "lag_s": 0.0,
    "step_deg": 0.0,
}
T = times()
ANGLES = {"elevator": 4.0 * np.sin(1.3 * T), "rudder": 2.0 + 0.0 * T}


def read(acquisition: Acquisition, seed: int = 1, angles: Mapping[str, np.ndarray] = ANGLES, **keys: object) -> dict:
    return surface_columns(Surfaces.model_validate(IDEAL | keys), dict(angles), T, acquisition, seed)


def errors(acquisition: Acquisition, seed: int = 1, **keys: object) -> dict[str, np.ndarray]:
    out = read(acquisition, seed, **keys)
    return {name: out[f"surface_{name}_deg"] - out[f"true_surface_{name}_deg"] for name in ANGLES}


def step_by_step(values: np.ndarray, play: float) -> np.ndarray:
    """The definition of the play operator, one sample after the other."""
    out = [values[0]]
    for value in values[1:]:
        out.append(min(max(out[-1], value - 0.5 * play), value + 0.5 * play))
    return np.array(out)


@pytest.mark.parametrize("play", [0.0, 0.3, 2.5, 40.0])
def test_backlash_is_the_play_operator(play: float) -> None:
    rng = np.random.default_rng(2)
    walk = np.cumsum(rng.standard_normal(4000))
    rests = np.repeat(walk[:300], rng.integers(1, 6, 300))
    for values in (walk, rests, np.zeros(7), np.arange(5.0), -np.arange(5.0), np.ones(1)):
        np.testing.assert_array_equal(backlash(values, play), step_by_step(values, play))


def test_backlash_cuts_a_swing_by_the_play_and_delays_its_turn() -> None:
    """A swing of 4 deg through play of 1 deg: the potentiometer swings 3.5 deg and rests while 1 deg is used up."""
    t = np.linspace(0.0, 6.0 * np.pi, 60_001)
    out = backlash(4.0 * np.sin(t), 1.0)[20_000:]
    assert (out.min(), out.max()) == pytest.approx((-3.5, 3.5), abs=1e-6)
    resting = np.mean(np.diff(out) == 0.0)
    assert resting == pytest.approx(2.0 * np.arccos(1.0 - 1.0 / 4.0) / (2.0 * np.pi), abs=1e-3)


def test_an_ideal_potentiometer_reads_the_filtered_truth(acquisition: Acquisition) -> None:
    out = read(acquisition)
    assert list(out) == [f"{p}surface_{n}_deg" for p in ("true_", "") for n in ("elevator", "rudder")]
    for name, angle in ANGLES.items():
        np.testing.assert_array_equal(out[f"true_surface_{name}_deg"], acquisition(angle))
        np.testing.assert_array_equal(out[f"surface_{name}_deg"], acquisition(angle))
    assert columns.role_of("surface_rudder_deg") == "input"
    assert columns.role_of("true_surface_rudder_deg") == "truth"


def test_the_truth_has_no_instrument_error(acquisition: Acquisition) -> None:
    plain = read(acquisition)
    worn = surface_columns(Surfaces(skew_s=0.1, jitter_s=0.01), dict(ANGLES), T, acquisition, 1)
    for name in ANGLES:
        np.testing.assert_array_equal(worn[f"true_surface_{name}_deg"], plain[f"true_surface_{name}_deg"])
        assert np.std(worn[f"surface_{name}_deg"] - plain[f"surface_{name}_deg"]) > 0.01


def test_a_channel_without_a_potentiometer_keeps_its_truth(acquisition: Acquisition) -> None:
    assert set(read(acquisition, enabled=False)) == {"true_surface_elevator_deg", "true_surface_rudder_deg"}
    one = read(acquisition, without=("rudder",))
    assert "surface_rudder_deg" not in one
    np.testing.assert_array_equal(one["surface_elevator_deg"], read(acquisition)["surface_elevator_deg"])


def test_offset_and_scale_have_their_spread_and_are_constant(acquisition: Acquisition) -> None:
    runs = [errors(acquisition, seed, offset_deg=0.3) for seed in range(200)]
    for error in runs[0].values():
        np.testing.assert_allclose(error, error[0], rtol=0, atol=1e-12)
    offsets = np.array([[run[name][0] for name in ANGLES] for run in runs])
    assert offsets.std() == pytest.approx(0.3, rel=0.15)  # 400 values: 4 %
    assert abs(np.corrcoef(offsets.T)[0, 1]) < 0.25
    scales = [errors(acquisition, seed, scale_error=0.02)["rudder"] / 2.0 for seed in range(200)]
    assert np.std([scale[0] for scale in scales]) == pytest.approx(0.02, rel=0.2)


def test_noise_has_its_density(acquisition: Acquisition) -> None:
    error = np.array([errors(acquisition, seed, noise_deg_rthz=0.05)["rudder"] for seed in range(60)])
    gain2 = np.sum(acquisition.decimator.taps**2) * RATE / 2
    assert error.std() == pytest.approx(0.05 * np.sqrt(gain2), rel=0.04)


def test_lag_is_of_first_order(acquisition: Acquisition) -> None:
    ramp = {"elevator": 3.0 * T}
    out = read(acquisition, angles=ramp, lag_s=0.08)
    late = out["surface_elevator_deg"] - out["true_surface_elevator_deg"]
    np.testing.assert_allclose(late[5:], -3.0 * 0.08, rtol=0, atol=1e-3)


def test_skew_is_of_the_clock(acquisition: Acquisition) -> None:
    skewed = read(acquisition, angles={"elevator": 3.0 * T}, skew_s=0.2)
    error = skewed["surface_elevator_deg"] - skewed["true_surface_elevator_deg"]
    np.testing.assert_allclose(error, -3.0 * 0.2, rtol=0, atol=1e-9)


def test_readings_are_whole_steps_before_the_filter(acquisition: Acquisition) -> None:
    rests = {"rudder": 2.04 + 0.0 * T}
    np.testing.assert_allclose(read(acquisition, angles=rests, step_deg=0.5)["surface_rudder_deg"], 2.0, atol=1e-9)
    ramp = read(acquisition, angles={"rudder": T}, step_deg=0.01)
    assert np.abs(ramp["surface_rudder_deg"] - ramp["true_surface_rudder_deg"]).max() < 0.005


@pytest.mark.parametrize(
    ("setting", "wanted"),
    [
        ('sensors.surfaces.without=["wing"]', r"surfaces.without\[0\]: 'wing' is not allowed; allowed: 'elevator'"),
        (
            "sensors.surfaces.backlash_deg=-1.0",
            r"sensors.surfaces.backlash_deg: -1 is not allowed; allowed: a number from 0 to 10",
        ),
        (
            'sensors.electrical.without=["toaster"]',
            r"sensors.electrical.without: there is no feeder 'toaster'; allowed: avionics",
        ),
    ],
)
def test_wrong_keys_are_reported(setting: str, wanted: str) -> None:
    with pytest.raises(RequestError, match=wanted):
        load_scenario("calibration_c208b", [setting])

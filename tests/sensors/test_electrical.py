"""Current sensors and voltmeters: what they add to the truth, and nothing else."""

import numpy as np
import pytest

from magsim.scenario import Electrical
from magsim.sensors.electrical import electrical_columns, measure
from magsim.truth import FieldTruth

IDEAL = Electrical(
    current_noise_a_rthz=0.0,
    current_offset_a=0.0,
    current_step_a=0.0,
    voltage_noise_v_rthz=0.0,
    voltage_offset_v=0.0,
    voltage_step_v=0.0,
)


@pytest.fixture
def truth(make_truth) -> FieldTruth:
    field = make_truth(earth=lambda t: (50000.0 + 0.0 * t, 0.0 * t, 0.0 * t))
    t = field.time_s
    currents = {"pump": 4.0 * (np.sin(0.3 * t) > 0.0), "strobe": 1.0 + 0.0 * t}
    voltages = {"main": 28.0 - 0.01 * currents["pump"]}
    return FieldTruth(t, field.mounts, field.parts_b, currents_a=currents, voltages_v=voltages)


def test_an_ideal_sensor_reads_the_filtered_truth(truth, acquisition):
    out = electrical_columns(IDEAL, truth, acquisition, 1)
    names = ["cur_pump_a", "cur_strobe_a", "vol_main_v"]
    assert list(out) == [*(f"true_{name}" for name in names), *names]
    np.testing.assert_array_equal(out["cur_pump_a"], acquisition(truth.currents_a["pump"]))
    np.testing.assert_array_equal(out["vol_main_v"], acquisition(truth.voltages_v["main"]))


def test_each_channel_has_an_offset_and_noise_of_its_own(truth, acquisition):
    settings = IDEAL.model_copy(update={"current_offset_a": 0.3, "current_noise_a_rthz": 0.01})
    one, again, other = (electrical_columns(settings, truth, acquisition, seed) for seed in (1, 1, 2))
    error = {name: one[f"cur_{name}_a"] - acquisition(truth.currents_a[name]) for name in truth.currents_a}
    np.testing.assert_array_equal(one["cur_pump_a"], again["cur_pump_a"])
    offsets = [error["pump"].mean(), error["strobe"].mean(), (other["cur_strobe_a"] - 1.0).mean()]
    assert len({round(offset, 3) for offset in offsets}) == 3
    assert np.corrcoef(error["pump"], error["strobe"])[0, 1] < 0.3
    np.testing.assert_array_equal(one["vol_main_v"], acquisition(truth.voltages_v["main"]))


def test_noise_has_its_density_and_offsets_their_spread():
    rng = np.random.default_rng(1)
    settings = {"density": 0.02, "offset": 0.0, "step": 0.0, "rate_hz": 120.0}
    noise = measure(np.zeros(40000), rng=rng, **settings)
    assert noise.std() == pytest.approx(0.02 * np.sqrt(60.0), rel=0.02)
    zero = {"density": 0.0, "offset": 0.5, "step": 0.0, "rate_hz": 120.0}
    offsets = [measure(np.zeros(1), rng=np.random.default_rng(i), **zero)[0] for i in range(2000)]
    assert np.std(offsets) == pytest.approx(0.5, rel=0.05)


def test_voltmeters_have_their_own_noise_offset_and_steps(truth, acquisition):
    keys = {"voltage_noise_v_rthz": 0.01, "voltage_offset_v": 0.5}
    runs = [electrical_columns(IDEAL.model_copy(update=keys), truth, acquisition, seed) for seed in range(60)]
    error = np.array([run["vol_main_v"] for run in runs]) - acquisition(truth.voltages_v["main"])
    gain2 = np.sum(acquisition.decimator.taps**2) * acquisition.rate_in_hz / 2
    # 60 x 201 rows; 60 offsets: 9 %.
    assert (error - error.mean(axis=1, keepdims=True)).std() == pytest.approx(0.01 * np.sqrt(gain2), rel=0.05)
    assert error.mean(axis=1).std() == pytest.approx(0.5, rel=0.3)
    for run in runs[:2]:
        np.testing.assert_array_equal(run["cur_pump_a"], acquisition(truth.currents_a["pump"]))
    coarse = electrical_columns(IDEAL.model_copy(update={"voltage_step_v": 2.0}), truth, acquisition, 1)
    np.testing.assert_allclose(coarse["vol_main_v"], 28.0, rtol=0, atol=1e-3)  # of 27.96 to 28 V


def test_readings_are_whole_steps():
    ramp = np.linspace(-1.0, 1.0, 999)
    reading = measure(ramp, density=0.0, offset=0.0, step=0.25, rate_hz=120.0, rng=np.random.default_rng(1))
    np.testing.assert_allclose(np.unique(reading), np.arange(-4, 5) * 0.25)
    assert np.abs(reading - ramp).max() <= 0.125 + 1e-12


def test_nobody_records_where_that_is_asked(truth, acquisition):
    plain = electrical_columns(IDEAL, truth, acquisition, 1)
    out = electrical_columns(IDEAL.model_copy(update={"enabled": False}), truth, acquisition, 1)
    assert set(out) == {"true_cur_pump_a", "true_cur_strobe_a", "true_vol_main_v"}
    for name, column in out.items():
        np.testing.assert_array_equal(column, plain[name.removeprefix("true_")])


def test_a_feeder_without_a_sensor_keeps_its_truth(truth, acquisition):
    noisy = Electrical()
    out = electrical_columns(noisy.model_copy(update={"without": ("pump",)}), truth, acquisition, 1)
    whole = electrical_columns(noisy, truth, acquisition, 1)
    assert set(whole) - set(out) == {"cur_pump_a"}
    np.testing.assert_array_equal(out["true_cur_pump_a"], acquisition(truth.currents_a["pump"]))
    np.testing.assert_array_equal(out["cur_strobe_a"], whole["cur_strobe_a"])

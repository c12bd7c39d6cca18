"""Errors of magnetometers one by one, against their formulas; noises by their Allan deviation."""

import numpy as np
import pytest

from magsim.errors import RequestError
from magsim.scenario import Cabin, FluxgateSensor, Ins, ScalarSensor
from magsim.sensors import fluxgate as flux
from magsim.sensors import scalar as vapor
from magsim.sensors.acquisition import Counter
from magsim.sensors.cabin import temperature_c
from magsim.sensors.fluxgate import fluxgate_columns
from magsim.sensors.noise import white_noise
from magsim.sensors.scalar import scalar_columns
from magsim.signals import between, first_order_lag, gauss_markov, window_mean
from magsim.streams import stream
from tests.support.allan import allan, gauss_markov_allan

RATE = 120.0


def scalar(**keys):
    return ScalarSensor(name="cabin", mount="cabin", **({"noise_nt_rthz": 0.0, "axis_b": (1.0, 0.0, 0.0)} | keys))


def fluxgate(**keys):
    return FluxgateSensor(name="flux", mount="cabin", **({"noise_nt_rthz": 0.0} | keys))


def turning(t):
    """The field of 50 000 nT turns in the plane of x and y, 18 degrees a second from x on."""
    angle = np.radians(18.0 * t)
    return 50e3 * np.cos(angle), 50e3 * np.sin(angle), 0.0


def vector(angle_deg):
    angle = np.radians(np.atleast_1d(np.asarray(angle_deg, dtype=float)))
    return 50e3 * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)


def test_heading_error_by_angle():
    sensor = scalar(heading_cos_nt=0.3, heading_cos2_nt=0.2, heading_switch_nt=0.1)
    out = vapor.measure(vector([0.0, 60.0, 90.1, 120.0, 180.0]), sensor, RATE, stream(1, "n")) - 50e3
    second = 0.3 * np.cos(np.radians(90.1)) + 0.2 * np.cos(np.radians(180.2)) - 0.1
    wanted = [0.6, 0.15 - 0.1 + 0.1, second, -0.15 - 0.1 - 0.1, -0.3 + 0.2 - 0.1]
    np.testing.assert_allclose(out, wanted, rtol=0, atol=1e-9)


def test_the_axis_need_not_be_a_unit_vector():
    one, other = (vapor.axis_cosine(vector(50.0), scalar(axis_b=axis)) for axis in ((1.0, 1.0, 0.0), (3.0, 3.0, 0.0)))
    np.testing.assert_allclose(one, np.cos(np.radians(5.0)))
    np.testing.assert_allclose(other, one)


def test_gyro_shift_of_ten_degrees_a_second():
    """0.0079 nT where the turning is about the field, nothing across it."""
    rate = np.radians([[10.0, 0.0, 0.0], [0.0, 10.0, 0.0]])
    np.testing.assert_allclose(vapor.gyro_error(vector([0.0, 0.0]), rate), [0.0079399, 0.0], atol=1e-6)
    out = [vapor.measure(vector(0.0), scalar(gyro_shift=s), RATE, stream(1, "n"), rate_b=rate[:1]) for s in (1.0, -0.5)]
    np.testing.assert_allclose(np.ravel(out) - 50e3, [0.0079399, -0.00397], atol=1e-6)


@pytest.mark.parametrize(("lag", "freq"), [(0.1, 0.5), (0.3, 0.2), (0.02, 4.0)])
def test_a_lag_has_gain_and_delay_of_first_order(lag, freq):
    t = np.arange(-3600, 3600) / RATE
    omega = 2.0 * np.pi * freq
    out = first_order_lag(1e4 + np.sin(omega * t), lag, RATE)
    wanted = 1e4 + np.sin(omega * t - np.arctan(omega * lag)) / np.hypot(1.0, omega * lag)
    # Straight lines between samples lose (w h)^2 / 12 of a sine.
    np.testing.assert_allclose(out[1200:], wanted[1200:], rtol=0, atol=(omega / RATE) ** 2 / 12 + 1e-9)
    np.testing.assert_array_equal(first_order_lag(t, 0.0, RATE), t)


def test_between_samples_polynomials_are_exact():
    x = np.arange(60) - 30.0
    place = np.array([7.0, 7.3, 20.5, 33.99, 52.0])
    for power in (0, 1, 5, 15):
        np.testing.assert_allclose(between((x / 30.0) ** power, place), ((place - 30.0) / 30.0) ** power, atol=1e-10)
    tenth = between(np.sin(0.2 * np.pi * x), place) - np.sin(0.2 * np.pi * (place - 30.0))
    quarter = between(np.sin(0.5 * np.pi * x), place) - np.sin(0.5 * np.pi * (place - 30.0))
    assert np.abs(tenth).max() < 1e-7
    assert np.abs(quarter).max() < 3e-3
    for bad in (6.9, 52.1):
        with pytest.raises(ValueError, match="need 8 of 60 samples"):
            between(x, np.array([bad]))


def test_mean_over_a_window():
    """Cell means of a sine: whole cells are exact at any frequency, others follow the sine."""
    k, h = np.arange(400), 1.0 / RATE
    for freq, atol in ((0.5, 1e-9), (7.0, 1e-9), (31.7, 4e-3)):
        omega = 2.0 * np.pi * freq
        cells = np.sinc(freq * h) * np.sin(omega * k * h)
        integral = lambda at, w=omega: -np.cos(w * at * h) / (w * h)  # noqa: E731
        for offset, limit in ((0.5, 1e-11), (0.0, atol), (0.3, atol)):
            start = np.arange(50.0, 300.0, 12.0) + offset
            wanted = (integral(start + 12.0) - integral(start)) / 12.0
            np.testing.assert_allclose(window_mean(cells, start, start + 12.0), wanted, rtol=0, atol=limit)


@pytest.mark.parametrize(("tag", "late"), [("center", 0.0), ("end", 0.05)])
def test_a_counter_has_the_gain_of_its_window_and_tags_it(make_truth, acquisition, tag, late):
    freq = 0.5
    truth = make_truth(earth=lambda t: (0.0, 0.0, 50e3 + 30.0 * np.sin(2.0 * np.pi * freq * t)))
    out = scalar_columns(scalar(counter_s=0.1, counter_tag=tag), truth, acquisition, 1)
    # The samples are instants here, not means over steps: their mean has lost a little more.
    gain = np.sinc(freq * 0.1) / np.sinc(freq / RATE)
    rows = acquisition.time_s
    wanted = 50e3 + 30.0 * gain * np.sin(2.0 * np.pi * freq * (rows - late))
    np.testing.assert_allclose(out["mag_cabin_nt"], wanted, rtol=0, atol=1e-8)
    assert np.sinc(freq * 0.1) == pytest.approx(1.0 - 0.0041, abs=1e-4)
    centered = 50e3 + 30.0 * gain * np.sin(2.0 * np.pi * freq * rows)
    np.testing.assert_allclose(out["total_cabin_nt"], centered, rtol=0, atol=1e-8)


def test_parts_add_up_through_a_counter(make_truth, acquisition):
    truth = make_truth(earth=lambda t: (30e3, 10.0 * np.sin(t), 40e3), induced=lambda t: (np.sin(5.0 * t), t, 3.0))
    out = scalar_columns(scalar(counter_s=0.1), truth, acquisition, 1)
    whole = Counter(acquisition, 0.1)(truth.total("cabin"))
    for k, axis in enumerate("xyz"):
        parts = out[f"earth_cabin_{axis}_nt"] + out[f"induced_cabin_{axis}_nt"]
        np.testing.assert_allclose(parts, whole[:, k], rtol=0, atol=1e-9)
    np.testing.assert_allclose(
        out["interference_cabin_nt"], out["total_cabin_nt"] - out["clean_cabin_nt"], rtol=0, atol=1e-9
    )


def test_dead_zones_hold_the_last_reading(make_truth, acquisition):
    """The field passes the axis at 0, 10 and 20 s and the equator at 5 and 15 s, 18 degrees a second."""
    truth = make_truth(earth=turning, permanent=lambda t: (0.0, 0.0, 1000.0 + 30.0 * t))
    out = scalar_columns(scalar(dead_polar_deg=15.0, dead_equator_deg=9.0, relock_s=0.3), truth, acquisition, 1)
    t, valid = acquisition.time_s, out["mag_cabin_valid"]
    since = {0.0: 15.0 / 18.0, 5.0: 0.5, 10.0: 15.0 / 18.0, 15.0: 0.5, 20.0: 15.0 / 18.0}
    lost = np.zeros(len(t), dtype=bool)
    sure = np.ones(len(t), dtype=bool)
    for center, half in since.items():
        lost |= (t > center - half) & (t < center + half + 0.3)
        for edge in (center - half, center + half + 0.3):
            sure &= np.abs(t - edge) > 0.07
    np.testing.assert_array_equal(valid[sure], (~lost).astype(float)[sure])
    reading, total = out["mag_cabin_nt"], out["total_cabin_nt"]
    np.testing.assert_allclose(reading[valid == 1.0], total[valid == 1.0], rtol=0, atol=1e-9)
    first = int(valid.argmax())
    assert first > 5
    np.testing.assert_array_equal(reading[:first], 0.0)
    for i in range(first + 1, len(t)):
        if valid[i] == 0.0:
            assert reading[i] == reading[i - 1]
    np.testing.assert_allclose(out["error_cabin_nt"], reading - total, rtol=0, atol=1e-9)


def test_out_of_range_drops_out(make_truth, acquisition):
    truth = make_truth(earth=lambda t: (0.0, 0.0, 49e3 + 100.0 * t))
    out = scalar_columns(scalar(range_nt=(20e3, 50e3)), truth, acquisition, 1)
    t = acquisition.time_s
    np.testing.assert_array_equal(out["mag_cabin_valid"][np.abs(t - 10.0) > 0.07], t[np.abs(t - 10.0) > 0.07] < 10.0)
    assert out["mag_cabin_nt"].max() <= 50e3
    assert "mag_cabin_valid" not in scalar_columns(scalar(), truth, acquisition, 1)


@pytest.mark.parametrize("step", [0.001, 0.5])
def test_readings_are_whole_steps_and_off_by_half_of_one(make_truth, acquisition, step):
    truth = make_truth(earth=lambda t: (0.0, 0.0, 50e3 + 37.0 * np.sin(t)))
    out = scalar_columns(scalar(step_nt=step), truth, acquisition, 1)
    counts = out["mag_cabin_nt"] / step
    np.testing.assert_allclose(counts, np.round(counts), rtol=0, atol=1e-6)
    error = out["error_cabin_nt"]
    assert np.abs(error).max() <= 0.5 * step * 1.001
    assert error.std() == pytest.approx(step / np.sqrt(12.0), rel=0.15)


def test_cross_field_is_what_lies_across():
    sensor = fluxgate(cross_field_nt=(10.0, -5.0, 2.0))
    fields = np.array([[50e3, 0.0, 0.0], [0.0, 50e3, 0.0], [0.0, -25e3, 25e3]])
    wanted = [[0.0, -5.0, 2.0], [10.0, 0.0, 2.0], [5.0, -1.25, 0.5]]
    np.testing.assert_allclose(flux.measure(fields, sensor, RATE, stream(1, "n")) - fields, wanted, rtol=0, atol=1e-9)


def test_temperature_moves_offset_and_scale():
    sensor = fluxgate(offset_drift_nt_c=(1.0, -2.0, 0.5), scale_drift_ppm_c=(0.0, 50.0, -20.0), reference_c=25.0)
    fields = np.full((2, 3), 40e3)
    out = flux.measure(fields, sensor, RATE, stream(1, "n"), np.array([25.0, 35.0])) - fields
    wanted = [[0.0, 0.0, 0.0], [10.0, -20.0 + 20.0, 5.0 - 8.0]]
    np.testing.assert_allclose(out, wanted, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(flux.measure(fields, sensor, RATE, stream(1, "n")), fields)


def test_the_cabin_warms_up_and_wanders():
    time = np.arange(-480, 600_000) / RATE
    calm = temperature_c(Cabin(start_c=5.0, settled_c=25.0, warmup_s=600.0), time, 1)
    np.testing.assert_allclose(calm, 25.0 - 20.0 * np.exp(-np.maximum(time, 0.0) / 600.0), rtol=0, atol=1e-12)
    cabin = Cabin(wander_c=0.5, wander_s=2.0)
    wander = temperature_c(cabin, time, 1) - 20.0
    # 5000 s with 2 s of correlation: 2 % for a standard deviation.
    assert wander.std() == pytest.approx(0.5, rel=0.06)
    assert np.mean(wander[:-240] * wander[240:]) / wander.var() == pytest.approx(np.exp(-1.0), abs=0.06)
    np.testing.assert_array_equal(temperature_c(cabin, time, 1) - 20.0, wander)
    assert not np.array_equal(temperature_c(cabin, time, 2) - 20.0, wander)


def test_bandwidth_is_the_frequency_of_half_the_power(make_truth, acquisition):
    truth = make_truth(earth=lambda t: (1e4 + 100.0 * np.sin(2.0 * np.pi * 1.5 * t), 0.0, 4e4))
    wide, narrow = (
        fluxgate_columns(fluxgate(bandwidth_hz=b), truth, acquisition, 1)["flux_flux_x_nt"] for b in (None, 1.5)
    )
    middle = slice(30, 190)  # 24 periods
    assert np.std(narrow[middle]) / np.std(wide[middle]) == pytest.approx(np.sqrt(0.5), rel=2e-3)


def test_saturation_and_steps_of_a_fluxgate(make_truth, acquisition):
    truth = make_truth(earth=lambda t: (7e4 + 0.0 * t, -7e4, 1234.5678))
    out = fluxgate_columns(fluxgate(range_nt=6e4, step_nt=0.5), truth, acquisition, 1)
    for axis, wanted in (("x", 6e4), ("y", -6e4), ("z", 1234.5)):
        np.testing.assert_allclose(out[f"flux_flux_{axis}_nt"], wanted, rtol=0, atol=1e-9)


def test_an_error_does_not_change_the_noise(make_truth, acquisition):
    truth = make_truth(earth=lambda t: (3e4, 0.0, 4e4))
    plain = scalar_columns(scalar(noise_nt_rthz=0.1), truth, acquisition, 1)["error_cabin_nt"]
    worn = scalar_columns(scalar(noise_nt_rthz=0.1, heading_switch_nt=3.0), truth, acquisition, 1)["error_cabin_nt"]
    np.testing.assert_allclose(worn, plain + 3.0, rtol=0, atol=1e-8)


def test_allan_deviation_of_white_noise_falls_with_the_root():
    """For a one-sided density d: d / sqrt(2 T)."""
    noise = white_noise(stream(1, "n"), (600_000,), 0.004, RATE)
    for window in (0.1, 1.0, 5.0):
        assert allan(noise, RATE, window) == pytest.approx(0.004 / np.sqrt(2.0 * window), rel=0.06)


def test_allan_deviation_of_a_gauss_markov_drift_has_its_hump():
    """Its top is at 1.89 correlation times."""
    sigma, c, rate = 0.01, 3.0, 10.0
    drift = gauss_markov(stream(2, "d"), (600_000,), sigma, c, rate)
    seen = {}
    for window in (0.5, 3.0, 5.7, 30.0):
        seen[window] = allan(drift, rate, window)
        assert seen[window] == pytest.approx(gauss_markov_allan(sigma, c, window), rel=0.06)
    assert max(seen, key=seen.get) == 5.7


def test_presets_fill_what_is_left_out():
    sensor = ScalarSensor(name="a", mount="m", preset="cs_vapor", step_nt=0.01)
    assert (sensor.counter_s, sensor.step_nt, sensor.range_nt) == (0.1, 0.01, (20e3, 100e3))
    assert FluxgateSensor(name="a", mount="m", preset="fluxgate_survey").cross_field_nt == (10.0, -10.0, 10.0)
    survey, mems = Ins(preset="ins_survey"), Ins(preset="ins_mems", skew_s=0.0)
    assert 0.01 <= survey.attitude_drift_deg <= 0.05
    assert 0.1 <= mems.attitude_drift_deg <= 0.5
    assert mems.skew_s == 0.0
    for ins in (survey, mems):
        assert ins.attitude_drift_deg > ins.attitude_noise_deg > 0.0


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("sensors.scalar[0].preset=quantum", r"sensors.scalar\[0\].preset: 'quantum' is not allowed; .*'cs_vapor'"),
        ("sensors.scalar[0].axis_b=[0.0, 0.0, 0.0]", r"axis_b: \(0, 0, 0\) points nowhere; allowed"),
        ("sensors.scalar[0].range_nt=[5.0, 1.0]", r"range_nt: \[5.0, 1.0\] is no range; allowed"),
        ("sensors.fluxgate[0].skew_s=0.7", r"sensors.fluxgate\[0\].skew_s: 0.7 .*0.5"),
        ("sensors.ins.jitter_s=-0.1", r"sensors.ins.jitter_s: -0.1 .*0"),
    ],
)
def test_wrong_keys_are_reported(text, wanted):
    from magsim.loading import load_scenario

    with pytest.raises(RequestError, match=wanted):
        load_scenario("calibration_c208b", [text])

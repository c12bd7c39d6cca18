"""Hum of 50, 60 and 400 Hz in the window of a counter: against quadrature, the analytic gain, the folded frequency."""

import numpy as np
import pytest
from scipy.integrate import quad

from magsim.errors import RequestError
from magsim.loading import load_scenario
from magsim.scenario import ScalarSensor, Tone
from magsim.sensors.scalar import scalar_columns, tone_mean


def sensor(tones, **keys):
    given = {"name": "cabin", "mount": "cabin", "noise_nt_rthz": 0.0, "counter_s": 0.1, "tones": tones}
    return ScalarSensor.model_validate(given | keys)


def still(t):
    return 3e4, 0.0, 4e4


@pytest.mark.parametrize("frequency", [49.98, 60.3, 398.0, 401.7, 7.0])
@pytest.mark.parametrize("window", [0.1, 0.08])
def test_the_mean_is_that_of_the_tone_over_the_window(frequency, window):
    tone = Tone(frequency_hz=frequency, amplitude_nt=20.0)
    taken = np.array([0.0, 0.1, 1.2345, 917.3])
    found = tone_mean(tone, taken, sensor([tone], counter_s=window), 0.7)
    for t, value in zip(taken, found, strict=True):
        # The phase at the middle is taken out first: quadrature of thousands of periods loses digits.
        start = 2.0 * np.pi * np.mod(frequency * t, 1.0) + 0.7
        mean, _ = quad(
            lambda s, start=start: np.cos(2.0 * np.pi * frequency * s + start), -window / 2, window / 2, limit=400
        )
        assert value == pytest.approx(20.0 * mean / window, abs=1e-7)


def test_whole_periods_in_the_window_leave_nothing():
    for frequency in (50.0, 60.0, 400.0):
        tone = Tone(frequency_hz=frequency, amplitude_nt=1e3)
        assert np.abs(tone_mean(tone, np.arange(50) / 10.0, sensor([tone]), 0.3)).max() < 1e-9


@pytest.mark.parametrize(("frequency", "folded"), [(49.9, 0.1), (60.3, 0.3), (398.0, 2.0), (401.7, 1.7)])
def test_rows_show_the_folded_frequency_with_the_gain_of_the_window(make_truth, acquisition, frequency, folded):
    truth = make_truth(earth=still)
    tones = [{"frequency_hz": frequency, "amplitude_nt": 500.0}]
    out = scalar_columns(sensor(tones), truth, acquisition, 1)
    error, t = out["error_cabin_nt"], acquisition.time_s
    basis = np.stack([np.cos(2 * np.pi * folded * t), np.sin(2 * np.pi * folded * t)], axis=1)
    fitted, *_ = np.linalg.lstsq(basis, error, rcond=None)
    np.testing.assert_allclose(basis @ fitted, error, rtol=0, atol=1e-7)
    wanted = 500.0 * abs(np.sin(np.pi * frequency * 0.1) / (np.pi * frequency * 0.1))
    assert np.hypot(*fitted) == pytest.approx(wanted, rel=1e-9)
    plain = scalar_columns(sensor([]), truth, acquisition, 1)
    for name in set(out) - {"mag_cabin_nt", "error_cabin_nt"}:
        np.testing.assert_array_equal(out[name], plain[name])


def test_a_tone_of_the_airframe_counts_along_the_field(make_truth, acquisition):
    """The field turns from x to y in 5 s: a tone along y grows from nothing as the sine of the angle."""
    angle = lambda t: np.radians(18.0 * t)  # noqa: E731
    truth = make_truth(earth=lambda t: (5e4 * np.cos(angle(t)), 5e4 * np.sin(angle(t)), 0.0))
    free = [{"frequency_hz": 398.0, "amplitude_nt": 500.0}]
    fixed = [{"frequency_hz": 398.0, "amplitude_nt": 500.0, "axis_b": (0.0, 2.0, 0.0)}]
    along = scalar_columns(sensor(free), truth, acquisition, 1)["error_cabin_nt"]
    turned = scalar_columns(sensor(fixed), truth, acquisition, 1)["error_cabin_nt"]
    np.testing.assert_allclose(turned, along * np.sin(angle(acquisition.time_s)), rtol=0, atol=1e-3)
    assert np.abs(along).max() > 2.0


def test_a_lag_takes_gain_and_phase(make_truth, acquisition):
    truth = make_truth(earth=still)
    tones = [{"frequency_hz": 398.0, "amplitude_nt": 500.0}]
    plain = scalar_columns(sensor(tones), truth, acquisition, 1)["error_cabin_nt"]
    lazy = scalar_columns(sensor(tones, lag_s=0.01), truth, acquisition, 1)["error_cabin_nt"]
    # 40 whole periods of the folded 2 Hz.
    assert lazy[:200].std() / plain[:200].std() == pytest.approx(
        1.0 / np.hypot(1.0, 2 * np.pi * 398.0 * 0.01), rel=1e-6
    )


def test_two_instruments_hear_one_source(make_truth, acquisition):
    truth = make_truth(earth=still)
    tones = [{"frequency_hz": 398.0, "amplitude_nt": 500.0}]
    other = sensor(tones).model_copy(update={"name": "tail"})
    one = scalar_columns(sensor(tones), truth, acquisition, 1)["error_cabin_nt"]
    np.testing.assert_allclose(scalar_columns(other, truth, acquisition, 1)["error_tail_nt"], one, rtol=0, atol=1e-9)
    assert not np.allclose(scalar_columns(sensor(tones), truth, acquisition, 2)["error_cabin_nt"], one)


def test_a_tone_without_a_counter_is_refused():
    tone = "sensors.scalar[0].tones=[{frequency_hz=400.0, amplitude_nt=10.0}]"
    with pytest.raises(
        RequestError, match=r"sensors.scalar.*tones: without counter_s the recording's filter lets no tone"
    ):
        load_scenario("calibration_c208b", [tone])
    assert (
        load_scenario("calibration_c208b", [tone, "sensors.scalar[0].counter_s=0.1"]).scenario.sensors.scalar[0].tones
    )

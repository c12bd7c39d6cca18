"""Clocks: a reading is taken at the instant that its clock gives; labels and truth stay at the tag."""

import numpy as np
import pytest

from magsim.errors import DataError
from magsim.scenario import BaseStation, Electrical, FluxgateSensor, InstrumentClock, ScalarSensor
from magsim.sensors.base_station import measure
from magsim.sensors.clocks import instants
from magsim.sensors.electrical import electrical_columns
from magsim.sensors.fluxgate import fluxgate_columns
from magsim.sensors.scalar import scalar_columns
from magsim.streams import stream
from magsim.truth import FieldTruth

TONE_HZ = 0.9
SPAN = (-10.0, 1e4)


def tone(time_s):
    return np.sin(2.0 * np.pi * TONE_HZ * time_s)


def gain(acquisition):
    taps, half = acquisition.decimator.taps, acquisition.decimator.half
    return np.sum(taps * np.cos(2.0 * np.pi * TONE_HZ * np.arange(-half, half + 1) / acquisition.rate_in_hz))


def scalar(**keys):
    return ScalarSensor(name="cabin", mount="cabin", **({"noise_nt_rthz": 0.0} | keys))


@pytest.fixture
def truth(make_truth):
    return make_truth(earth=lambda t: (0.0, 0.0, 50e3 + 20.0 * tone(t)))


@pytest.mark.parametrize("skew", [0.15, -0.15, 1.0 / 120.0, 0.0123])
def test_a_sine_is_late_by_the_skew_exactly(truth, acquisition, skew):
    out = scalar_columns(scalar(skew_s=skew), truth, acquisition, 1)
    rows = acquisition.time_s
    np.testing.assert_allclose(
        out["mag_cabin_nt"], 50e3 + 20.0 * gain(acquisition) * tone(rows - skew), rtol=0, atol=1e-7
    )
    flux = fluxgate_columns(
        FluxgateSensor(name="flux", mount="cabin", noise_nt_rthz=0.0, skew_s=skew), truth, acquisition, 1
    )
    np.testing.assert_allclose(flux["flux_flux_z_nt"], out["mag_cabin_nt"], rtol=0, atol=1e-9)


def test_labels_and_truth_stay_at_the_tag(truth, acquisition):
    right = scalar_columns(scalar(), truth, acquisition, 1)
    wrong = scalar_columns(scalar(skew_s=0.3, jitter_s=0.01, drift_ppm=100.0), truth, acquisition, 1)
    for name in right:
        if not name.startswith(("mag", "error")):
            np.testing.assert_array_equal(right[name], wrong[name])
    np.testing.assert_allclose(
        wrong["error_cabin_nt"], wrong["mag_cabin_nt"] - wrong["total_cabin_nt"], rtol=0, atol=1e-12
    )


def test_drift_grows(truth, acquisition):
    out = scalar_columns(scalar(drift_ppm=200.0), truth, acquisition, 1)["mag_cabin_nt"]
    rows = acquisition.time_s
    wanted = 50e3 + 20.0 * gain(acquisition) * tone(rows - 200e-6 * rows)
    np.testing.assert_allclose(out, wanted, rtol=0, atol=1e-7)
    assert np.ptp(out - scalar_columns(scalar(), truth, acquisition, 1)["mag_cabin_nt"]) > 0.1


def test_jitter_is_white_of_its_size_and_belongs_to_the_channel():
    tag = np.arange(20_000) / 10.0
    one, other = (tag - instants(InstrumentClock(jitter_s=0.004), tag, name, 1, SPAN) for name in ("a", "b"))
    assert one.std() == pytest.approx(0.004, rel=0.02)
    assert abs(np.corrcoef(one[1:], one[:-1])[0, 1]) < 0.03
    assert abs(np.corrcoef(one, other)[0, 1]) < 0.03
    np.testing.assert_array_equal(one, tag - instants(InstrumentClock(jitter_s=0.004), tag, "a", 1, SPAN))


def test_a_right_clock_changes_nothing():
    assert instants(InstrumentClock(), np.arange(5.0), "a", 1, SPAN) is None


def test_jitter_does_not_touch_the_noise(make_truth, acquisition):
    """In a field that rests, a jitter of 1e-12 s leaves the reading as it is."""
    still = make_truth(earth=lambda t: (0.0, 0.0, 50e3))
    keys = {"noise_nt_rthz": 0.1}
    right = scalar_columns(scalar(**keys), still, acquisition, 1)["mag_cabin_nt"]
    shaken = scalar_columns(scalar(jitter_s=1e-12, **keys), still, acquisition, 1)["mag_cabin_nt"]
    np.testing.assert_allclose(shaken, right, rtol=0, atol=1e-8)


def test_a_clock_that_leads_out_of_the_record():
    with pytest.raises(DataError, match=r"the clock of scalar/a is 0\.500 s off.*allowed: a smaller skew_s"):
        instants(InstrumentClock(skew_s=0.5), np.arange(5.0), "scalar/a", 1, (-0.2, 10.0))


def test_currents_are_late_too(acquisition, make_truth):
    time = make_truth(earth=lambda t: (0.0, 0.0, 50e3)).time_s
    truth = FieldTruth(
        time, ("cabin",), {}, currents_a={"fan": 5.0 + tone(time)}, voltages_v={"bus": 28.0 + tone(time)}
    )
    settings = Electrical(
        current_noise_a_rthz=0.0,
        current_offset_a=0.0,
        current_step_a=0.0,
        voltage_noise_v_rthz=0.0,
        voltage_offset_v=0.0,
        voltage_step_v=0.0,
        skew_s=0.08,
    )
    out = electrical_columns(settings, truth, acquisition, 1)
    late = gain(acquisition) * tone(acquisition.time_s - 0.08)
    np.testing.assert_allclose(out["cur_fan_a"], 5.0 + late, rtol=0, atol=1e-8)
    np.testing.assert_allclose(out["vol_bus_v"], 28.0 + late, rtol=0, atol=1e-8)


def test_tags_of_a_base_station():
    time = np.arange(0.0, 2000.0, 0.1)
    station = BaseStation(drift_ppm=150.0, jitter_s=0.003, delay_s=0.5, noise_nt_rthz=0.0)
    tag, reading = measure(time, time, station, stream(1, "n"), stream(1, "j"))
    late = tag - reading  # the field is the time
    shaken = late - 0.5 - 150e-6 * reading
    assert shaken.std() == pytest.approx(0.003, rel=0.06)
    assert abs(shaken.mean()) < 0.0003

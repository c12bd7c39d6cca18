"""The field that changes with time against what its parts are defined to be."""

from datetime import UTC, datetime

import numpy as np
import pytest

from magsim.field.background.variation import CLASSES, daily, draw_packets, local_hour, pulsations, variation_n
from magsim.scenario import Scenario, Variation
from magsim.streams import stream

QUIET = {"sq_nt": [0.0, 0.0, 0.0], "pc3_nt": 0.0, "pc4_nt": 0.0, "pc5_nt": 0.0, "drift_nt": 0.0}


def scenario(seed: int = 1, **settings: object) -> Scenario:
    place = {"lat_deg": 52.2, "lon_deg": 9.8, "alt_m": 244.0, "speed_mps": 70.0}
    return Scenario.model_validate(
        {
            "schema": 1,
            "seed": seed,
            "aircraft": "c208b",
            "start": place | {"time_utc": datetime(2025, 6, 2, 8, tzinfo=UTC)},
            "pattern": {"kind": "box"},
            "field": {"variation": QUIET | settings},
            "sensors": {"scalar": [{"name": "tail", "mount": "sgl_mag_1"}]},
        }
    )


def times(stop_s: float, rate_hz: float = 120.0) -> np.ndarray:
    return np.arange(-4.0 * rate_hz, stop_s * rate_hz + 1) / rate_hz


def test_daily_variation_has_its_range_its_noon_and_four_waves():
    hour = np.arange(0.0, 24.0, 0.01)
    field = daily((20.0, 40.0, -15.0), hour)
    np.testing.assert_allclose(np.ptp(field, axis=0), [20.0, 40.0, 15.0], rtol=1e-4)
    assert hour[field[:, 0].argmin()] == pytest.approx(12.0)
    assert hour[field[:, 2].argmax()] == pytest.approx(12.0)  # turned over by its sign
    assert 6.0 < hour[field[:, 1].argmax()] < 12.0 < hour[field[:, 1].argmin()] < 18.0
    lines = np.abs(np.fft.rfft(field, axis=0)) / len(hour)
    np.testing.assert_allclose(lines[0], 0.0, atol=1e-12)
    assert lines[1:5].min() > 0.1
    np.testing.assert_allclose(lines[5:], 0.0, atol=1e-12)
    np.testing.assert_allclose(daily((20.0, 40.0, -15.0), hour + 24.0), field, atol=1e-10)


def test_local_time_is_that_of_the_longitude():
    assert local_hour(scenario(), np.array([0.0, 3600.0])) == pytest.approx([8.0 + 9.8 / 15.0, 9.0 + 9.8 / 15.0])


def test_spline_holds_the_slow_parts():
    """Everything but the drift at every sample, without knots."""
    strong = scenario(sq_nt=[60.0, 60.0, 60.0], pc3_nt=10.0, pc4_nt=20.0, pc5_nt=50.0)
    time = times(1200.0)
    exact = daily((60.0, 60.0, 60.0), local_hour(strong, time)) + pulsations(strong.field.variation, 1, time)
    np.testing.assert_allclose(variation_n(strong, time), exact, rtol=0, atol=2e-5)
    assert np.ptp(exact, axis=0).min() > 5.0


@pytest.mark.parametrize("kind", CLASSES, ids=lambda kind: kind.name)
def test_packets_lie_in_their_class(kind):
    packets = draw_packets(stream(3, kind.name), kind, 2.0, 500 * kind.every_s)
    periods = np.array([1.0 / packet.frequency_hz for packet in packets])
    assert ((periods >= kind.shortest_s) & (periods <= kind.longest_s)).all()
    assert np.log(periods).mean() == pytest.approx(np.log(kind.shortest_s * kind.longest_s) / 2.0, abs=0.1)
    gaps = np.diff([packet.center_s for packet in packets])
    assert gaps.mean() == pytest.approx(kind.every_s, rel=0.15)
    peaks = np.array([packet.size_nt.max() for packet in packets])
    assert peaks.max() <= 2.0
    assert peaks.min() >= 0.4
    widths = np.array([packet.width_s for packet in packets]) / periods
    assert ((widths >= 1.0) & (widths <= 3.0)).all()


def test_power_of_a_packet_is_at_its_frequency():
    kind = CLASSES[0]
    packet = draw_packets(stream(3, "pc3"), kind, 1.0, 1000.0)[30]
    time = packet.center_s + np.arange(-400.0, 400.0, 0.5)
    power = np.abs(np.fft.rfft(packet.at(time), axis=0)) ** 2
    frequency = np.fft.rfftfreq(len(time), 0.5)
    center = (power * frequency[:, None]).sum(axis=0) / power.sum(axis=0)
    np.testing.assert_allclose(center, packet.frequency_hz, rtol=0.05)


def test_drift_is_gauss_markov():
    """Mean square of its change over t: 2 sigma^2 (1 - exp(-t / T)), over many seeds."""
    time = times(60.0, 10.0)
    runs = np.concatenate([variation_n(scenario(seed, drift_nt=2.0, drift_s=30.0), time).T for seed in range(400)])
    assert np.mean(runs**2) == pytest.approx(4.0, rel=0.08)
    for lag_s in (3.0, 20.0):
        change = runs[:, round(lag_s * 10) :] - runs[:, : -round(lag_s * 10)]
        assert np.mean(change**2) == pytest.approx(8.0 * -np.expm1(-lag_s / 30.0), rel=0.08)


def test_parts_are_independent_and_a_longer_flight_begins_the_same():
    alone, more = scenario(pc3_nt=5.0), scenario(pc3_nt=5.0, pc4_nt=5.0)
    pc3 = pulsations(alone.field.variation, 1, times(300.0, 4.0))
    pc4 = pulsations(Variation.model_validate(QUIET | {"pc4_nt": 5.0}), 1, times(300.0, 4.0))
    np.testing.assert_allclose(pulsations(more.field.variation, 1, times(300.0, 4.0)), pc3 + pc4, atol=1e-12)
    longer = pulsations(alone.field.variation, 1, times(900.0, 4.0))
    np.testing.assert_array_equal(longer[: len(pc3)], pc3)
    assert np.abs(pulsations(alone.field.variation, 2, times(300.0, 4.0)) - pc3).max() > 0.1


def test_off_is_nothing():
    assert not variation_n(scenario(enabled=False, drift_nt=5.0), times(10.0)).any()

import numpy as np
import pytest

from magsim.trajectory import Flight, ManeuverFlown, Segment, Trajectory
from magsim.truth import FieldTruth


def trajectory(rate_hz=30.0, start_s=-2.0, stop_s=20.0):
    t = np.arange(round(start_s * rate_hz), round(stop_s * rate_hz) + 1) / rate_hz
    wave = np.sin(2 * np.pi * 0.3 * t)
    columns3 = np.stack([wave, 0.5 * wave, 1.0 + t], axis=1)
    return Trajectory(t, 0.3 + 1e-6 * t, 1.9 + 2e-6 * t, 3000.0 + wave, 70.0 + columns3, 0.1 * columns3, columns3)


def test_spline_between_the_rows():
    path = trajectory()
    times = np.linspace(-1.5, 19.5, 777)
    there = path.at(times)
    np.testing.assert_allclose(there.alt_m, 3000.0 + np.sin(2 * np.pi * 0.3 * times), atol=1e-5)
    np.testing.assert_allclose(there.attitude[:, 2], 0.1 * (1.0 + times), atol=1e-12)
    np.testing.assert_allclose(there.velocity_n[:, 1], 70.0 + 0.5 * np.sin(2 * np.pi * 0.3 * times), atol=1e-5)
    np.testing.assert_allclose(path.at(path.time_s).lat_rad, path.lat_rad, rtol=0, atol=1e-15)
    assert path.rate_hz == pytest.approx(30.0)
    assert len(there) == 777


def test_spline_converges_with_the_fourth_power():
    times = np.linspace(0.0, 10.0, 501)
    errors = [
        np.abs(trajectory(rate).at(times).alt_m - 3000.0 - np.sin(2 * np.pi * 0.3 * times)).max() for rate in (10, 20)
    ]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.2)


@pytest.mark.parametrize("time", [-2.1, 20.1, np.nan])
def test_outside_the_log_is_refused(time):
    path = trajectory()
    with pytest.raises(ValueError, match=r"leave the logged"):
        path.at(np.array([0.0, time]))
    flight = Flight(path, 10.0, 120.0, {"rudder": path.alt_m}, (), ())
    with pytest.raises(ValueError, match=r"leave the logged"):
        flight.controls_at(np.array([0.0, time]))


def test_shapes_are_checked():
    path = trajectory()
    with pytest.raises(ValueError, match=r"velocity_n has shape \(5, 3\)"):
        Trajectory(path.time_s, path.lat_rad, path.lon_rad, path.alt_m, np.ones((5, 3)), path.attitude, path.rate_b)


def test_nothing_can_be_changed_from_outside():
    path = trajectory()
    lat = np.array(path.lat_rad)
    angle = np.zeros(len(path))
    other = Trajectory(path.time_s, lat, path.lon_rad, path.alt_m, path.velocity_n, path.attitude, path.rate_b)
    flight = Flight(other, 10.0, 120.0, {"rudder": angle}, [], [])
    lat[:] = angle[:] = 7.0
    assert other.lat_rad[0] == path.lat_rad[0]
    assert flight.controls["rudder"][0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        other.attitude[0] = 1.0


def test_controls():
    path = trajectory()
    flight = Flight(path, 10.0, 120.0, {"rudder": 0.1 * path.time_s, "aileron": path.alt_m}, (), ())
    out = flight.controls_at(np.array([0.015, 4.0]))
    assert list(out) == ["rudder", "aileron"]
    np.testing.assert_allclose(out["rudder"], [0.0015, 0.4], atol=1e-12)
    assert Flight(path, 10.0, 120.0, {}, (), ()).controls_at(np.array([0.0])) == {}
    with pytest.raises(ValueError, match="'rudder' has shape"):
        Flight(path, 10.0, 120.0, {"rudder": np.zeros(3)}, (), ())


def maneuver(axis, start, cycles=2, period=2.0, stop=None):
    stop = start + cycles * period if stop is None else stop
    return ManeuverFlown(axis, 1, 1, start, stop, period, cycles, 5.0, 5.0, 0.0, (0.0, 0.0))


def test_segment_columns():
    path = trajectory()
    segments = (
        Segment(1, 1, False, 0.0, 0.0, 8.0, 600.0),
        Segment(1, 1, True, 0.0, 8.0, 10.0, 100.0),
        Segment(1, 2, False, 90.0, 10.0, 20.0, 600.0),
    )
    flight = Flight(
        path, 20.0, 120.0, {}, segments, (maneuver("pitch", 1.0), maneuver("yaw", 12.0, cycles=1, stop=14.5))
    )
    t = np.arange(0, 201) / 10.0
    out = flight.segment_columns(t)
    np.testing.assert_array_equal(out["leg"], np.where(t < 10.0, 1, 2))
    np.testing.assert_array_equal(out["turn"], (t >= 8.0) & (t < 10.0))
    np.testing.assert_array_equal(out["leg_heading_deg"], np.where(t < 10.0, 0.0, 90.0))
    np.testing.assert_array_equal(out["circuit"], 1)
    assert out["maneuver"][10] == 1
    assert out["maneuver"][49] == 1
    assert out["maneuver"][50] == 0
    assert [out["cycle"][k] for k in (9, 10, 29, 30, 49, 50)] == [0, 1, 1, 2, 2, 0]
    # A maneuver that took longer than its cycles has no cycle more.
    assert out["cycle"][144] == 1
    assert set(out["maneuver"][120:145]) == {3}
    # Outside the segments the nearest one holds.
    early = flight.segment_columns(np.array([-1.0, 30.0]))
    assert early["leg"].tolist() == [1, 2]


def field_truth(**parts):
    t = np.arange(5) / 120.0
    return FieldTruth(t, ("tail", "cabin"), {name: np.full((5, 2, 3), value) for name, value in parts.items()})


def test_field_truth_adds_up():
    truth = field_truth(earth=100.0, permanent=1.0, eddy=0.5)
    np.testing.assert_array_equal(truth.platform("cabin"), np.full((5, 3), 1.5))
    np.testing.assert_array_equal(truth.total("tail"), np.full((5, 3), 101.5))
    assert truth.rate_hz == pytest.approx(120.0)
    np.testing.assert_array_equal(field_truth(earth=1.0).platform("tail"), np.zeros((5, 3)))


def test_field_truth_refuses():
    with pytest.raises(ValueError, match="'gremlins'; allowed: earth"):
        field_truth(gremlins=1.0)
    with pytest.raises(ValueError, match=r"shape \(5, 1, 3\), expected \(5, 2, 3\)"):
        FieldTruth(np.arange(5.0), ("a", "b"), {"earth": np.zeros((5, 1, 3))})

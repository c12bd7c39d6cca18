import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from magsim.earth import rot_ne_at
from magsim.frames import rot_nb_from_attitude
from magsim.trajectory import AttitudeCurve, Flight, ManeuverFlown, Segment, Trajectory, hermite_spline
from magsim.truth import FieldTruth
from tests.support.rotations import attitude_from_rot_nb, body_rates


def trajectory(rate_hz=30.0, start_s=-2.0, stop_s=20.0):
    t = np.arange(round(start_s * rate_hz), round(stop_s * rate_hz) + 1) / rate_hz
    wave = np.sin(2 * np.pi * 0.3 * t)
    columns3 = np.stack([wave, 0.5 * wave, 1.0 + t], axis=1)
    attitude, rate_b = attitude_at(t)
    return Trajectory(t, 0.3 + 1e-6 * t, 1.9 + 2e-6 * t, 3000.0 + wave, 70.0 + columns3, attitude, rate_b)


def attitude_at(t):
    """Roll, pitch, heading and the rates that belong to them."""
    omega = 2 * np.pi * 0.3
    angles = 0.1 * np.stack([np.sin(omega * t), 0.5 * np.cos(omega * t), 1.0 + t], axis=1)
    change = 0.1 * np.stack([omega * np.cos(omega * t), -0.5 * omega * np.sin(omega * t), np.ones_like(t)], axis=1)
    return angles, body_rates(angles, change)


def test_spline_between_the_rows():
    path = trajectory()
    times = np.linspace(-1.5, 19.5, 777)
    there = path.at(times)
    np.testing.assert_allclose(there.alt_m, 3000.0 + np.sin(2 * np.pi * 0.3 * times), atol=1e-5)
    attitude, rate_b = attitude_at(times)
    np.testing.assert_allclose(there.attitude, attitude, atol=1e-7)
    # The place of this path does not follow its velocity: north turns by 3e-5 rad/s less than it would.
    np.testing.assert_allclose(there.rate_b, rate_b, atol=5e-5)
    np.testing.assert_allclose(path.at(path.time_s).attitude, path.attitude, rtol=0, atol=1e-14)
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


def test_hermite_spline_has_what_goes_in_three_derivatives_and_the_sixth_order():
    t = np.linspace(0.0, 4.0, 9)
    quintic = np.polynomial.Polynomial([1.0, -2.0, 0.5, 0.3, -0.2, 0.05])
    fine = np.linspace(0.0, 4.0, 101)
    curve = hermite_spline(t, quintic(t)[:, None], quintic.deriv()(t)[:, None])
    np.testing.assert_allclose(curve(fine)[:, 0], quintic(fine), atol=1e-12)
    errors = []
    for rows in (41, 81):
        t = np.linspace(0.0, 4.0, rows)
        curve = hermite_spline(t, np.sin(5.0 * t)[:, None], 5.0 * np.cos(5.0 * t)[:, None])
        np.testing.assert_allclose(curve(t)[:, 0], np.sin(5.0 * t), atol=1e-13)
        np.testing.assert_allclose(curve(t, 1)[:, 0], 5.0 * np.cos(5.0 * t), atol=1e-12)
        for order, size in ((2, 25.0), (3, 125.0)):
            below, above = curve(t[1:-1] - 1e-9, order), curve(t[1:-1] + 1e-9, order)
            np.testing.assert_allclose(below, above, rtol=0, atol=1e-6 * size)
        fine = np.linspace(0.5, 3.5, 999)
        errors.append(np.abs(curve(fine)[:, 0] - np.sin(5.0 * fine)).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(6.0, abs=0.2)


@pytest.mark.parametrize("time", [[0.0, 1.0], [0.0, 1.0, 2.5]])
def test_hermite_spline_wants_even_rows(time):
    values = np.ones((len(time), 1))
    with pytest.raises(ValueError, match=rf"{len(time)} rows of a log, not three at least at even times"):
        hermite_spline(np.array(time), values, values)


@pytest.mark.parametrize("known_rates", [True, False])
@pytest.mark.parametrize(
    ("first", "rate"),
    [
        ((0.1, 0.05, 3.0), (0.0, 0.03, 0.4)),  # heading wraps
        ((3.0, 0.0, 1.0), (0.5, 0.0, 0.0)),  # on its back and round
        ((0.0, 1.2, 0.3), (0.02, 0.3, 0.01)),  # over the vertical
        ((0.0, 0.0, -3.1), (0.3, -0.4, 0.6)),  # tumbling
    ],
)
def test_turning_is_exact_through_every_attitude_and_over_the_pole(first, rate, known_rates):
    """A body that turns evenly relative to the Earth while it flies over the pole and the date line."""
    time = np.arange(0, 10 * 30 + 1) / 30.0
    start = Rotation.from_euler("ZYX", first[::-1])
    fine = np.linspace(1.0, 9.0, 2003)

    def place(t):
        # Straight over the pole, 1 m beside it.
        x, y = 75.0 / 6.4e6 * (t - 5.0), np.full_like(t, 1.0 / 6.4e6)
        return 0.5 * np.pi - np.arcsin(np.hypot(x, y)), np.arctan2(y, x)

    def turned(t):
        return start * Rotation.from_rotvec(t[:, None] * np.array(rate))

    def attitude(t):
        rot_nb = rotate_matrices(rot_ne_at(*place(t)), turned(t).as_matrix())
        return attitude_from_rot_nb(rot_nb)

    rates = np.broadcast_to(rate, (len(time), 3)) if known_rates else None
    found, found_rate = AttitudeCurve(time, *place(time), attitude(time), rates).at(fine, *place(fine))
    exact = rotate_matrices(rot_ne_at(*place(fine)), turned(fine).as_matrix())
    np.testing.assert_allclose(rot_nb_from_attitude(found), exact, atol=1e-10 if known_rates else 1e-7)
    np.testing.assert_allclose(found_rate, np.broadcast_to(rate, found_rate.shape), atol=1e-8 if known_rates else 1e-5)
    assert np.abs(np.diff(found[:, 2])).max() < np.pi + 0.1  # over the pole, half a turn at most


def rotate_matrices(first, second):
    return np.einsum("nij,njk->nik", first, second)


def test_heading_stays_continuous_over_many_turns():
    time = np.arange(0, 100 * 30 + 1) / 30.0
    heading = 0.5 * time - 40.0
    angles = np.stack([0.5 + 0.0 * time, 0.0 * time, heading], axis=1)
    zero = 0.0 * time
    still = np.zeros((len(time), 3))
    path = Trajectory(
        time, 0.3 + zero, 1.9 + zero, zero, still, angles, body_rates(angles, still + np.array([0.0, 0.0, 0.5]))
    )
    fine = np.linspace(0.0, 100.0, 1234)
    np.testing.assert_allclose(path.at(fine).attitude[:, 2], 0.5 * fine - 40.0, atol=1e-9)


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
    np.testing.assert_allclose(flight.controls_at(np.array([0.015, 5.0]))["rudder"], [0.0015, 0.5], atol=1e-12)
    np.testing.assert_array_equal(flight.controls_at(np.array([0.015, 4.0]))["rudder"], out["rudder"])
    assert Flight(path, 10.0, 120.0, {}, (), ()).controls_at(np.array([0.0])) == {}
    with pytest.raises(ValueError, match="'rudder' has shape"):
        Flight(path, 10.0, 120.0, {"rudder": np.zeros(3)}, (), ())


def towing():
    """A flight at 30 rows a second with a bird at 20, each with something of every kind."""
    path, below = trajectory(), trajectory(20.0, -1.95, 19.0)
    time = path.time_s
    alone = Flight(
        path,
        10.0,
        120.0,
        {"rudder": 0.1 * time},
        (Segment(1, 1, False, 0.0, 0.0, 8.0, 600.0),),
        (),
        notes={"log_hz": 30},
        wind_n=np.column_stack([time, 2.0 * time, 0.0 * time]),
        switches={"autopilot": np.sign(time)},
        rotors={"propeller": 100.0 + time},
    )
    rope = {"trail_rad": np.sin(below.time_s), "side_rad": 0.1 * below.time_s, "tension_n": 800.0 + below.time_s**2}
    return alone, alone.with_bird(below, rope, {"tow": {"rope_m": 30.0}})


def test_a_flight_gets_a_bird():
    alone, towed = towing()
    assert alone.instruments is alone.carrier
    assert alone.rope_at(np.array([1e9])) == {}
    assert towed.instruments is towed.bird
    assert towed.carrier is alone.carrier
    assert towed.notes == {"log_hz": 30, "tow": {"rope_m": 30.0}}
    at = np.linspace(-1.9, 18.9, 301)
    rope = towed.rope_at(at)
    assert list(rope) == ["trail_rad", "side_rad", "tension_n"]
    np.testing.assert_allclose(rope["trail_rad"], np.sin(at), rtol=0, atol=1e-6)
    np.testing.assert_allclose(rope["tension_n"], 800.0 + at**2, rtol=1e-12)
    with pytest.raises(ValueError, match="read-only"):
        rope["trail_rad"][0] = 0.0
    # The bird's log ends before that of the carrier.
    with pytest.raises(ValueError, match=r"leave the logged -1\.95\.\.19\.0 s"):
        towed.rope_at(np.array([19.5]))
    with pytest.raises(ValueError, match=r"rope 'trail_rad' has shape \(661,\), expected \(420,\)"):
        alone.with_bird(towed.bird, {"trail_rad": alone.carrier.time_s}, {})


def test_a_bird_flies_by_itself():
    alone, towed = towing()
    with pytest.raises(ValueError, match="the flight has no bird"):
        alone.of_bird()
    own = towed.of_bird()
    assert own.carrier is towed.bird
    assert own.bird is None
    assert own.wind_n is None
    assert (own.controls, own.switches, own.rotors, own.rope) == ({}, {}, {}, {})
    assert (own.duration_s, own.simulation_rate_hz, own.segments) == (10.0, 120.0, towed.segments)
    assert own.wind_at(np.array([0.0])) is None


def test_a_flight_can_begin_later():
    _, towed = towing()
    later = towed.since(-1.0)
    assert later.carrier.time_s[0] == pytest.approx(-1.0)
    assert later.bird.time_s[0] == pytest.approx(-1.0)
    assert (later.carrier.time_s[-1], later.bird.time_s[-1]) == (20.0, 19.0)
    first = len(towed.carrier) - len(later.carrier)
    for kind, name in (("controls", "rudder"), ("switches", "autopilot"), ("rotors", "propeller")):
        np.testing.assert_array_equal(getattr(later, kind)[name], getattr(towed, kind)[name][first:])
    np.testing.assert_array_equal(later.wind_n, towed.wind_n[first:])
    np.testing.assert_array_equal(later.rope["side_rad"], 0.1 * later.bird.time_s)
    for whole, cut in ((towed.carrier, later.carrier), (towed.bird, later.bird)):
        rows = slice(len(whole) - len(cut), None)
        for name in ("lat_rad", "lon_rad", "alt_m", "velocity_n", "attitude", "rate_b"):
            np.testing.assert_array_equal(getattr(cut, name), getattr(whole, name)[rows])
        np.testing.assert_array_equal(cut.reference_b, whole.reference_b)
    # A row at the very time stays, whatever the rounding; without a bird there is none.
    assert len(towed.since(towed.carrier.time_s[7] + 1e-10).carrier) == len(towed.carrier) - 7
    assert towing()[0].since(0.0).bird is None


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

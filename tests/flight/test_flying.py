"""Flights: legs, closures, amplitudes, kinematics, the same bytes again, and the messages when one goes wrong."""

import hashlib
import math
import os
import subprocess
import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from magsim.aircraft import Aircraft
from magsim.earth import ecef_from_geodetic, rot_ne_at
from magsim.errors import DataError, RequestError
from magsim.flight import fly
from magsim.frames import rot_nb_from_attitude
from magsim.loading import load_scenario
from magsim.scenario import Scenario
from magsim.trajectory import Flight
from tests.support.caches import without_results
from tests.support.paths import ROOT

ScenarioOf = Callable[..., Scenario]
ANGLES = {"roll": 0, "pitch": 1, "yaw": 2}

TRAINS = [
    {"axis": "pitch", "amplitude_deg": [15.0, 10.0, 15.0, 5.0], "period_s": [5.0, 8.0, 10.0, 7.0]},
    {"axis": "roll", "amplitude_deg": [15.0, 10.0, 5.0, 20.0], "period_s": [5.0, 10.0, 7.0, 9.0]},
    {"axis": "yaw", "amplitude_deg": [10.0, 15.0, 5.0, 12.0], "period_s": [10.0, 5.0, 6.0, 8.0]},
]


@pytest.fixture(scope="module")
def box(cessna: Aircraft, scenario_of: ScenarioOf) -> Flight:
    """One circuit with every axis, in wind."""
    pattern = {"kind": "box", "leg_m": 11_000.0, "maneuvers": TRAINS, "allow_beyond_crew_g": True}
    return fly(scenario_of(pattern, air={"wind_east_mps": 6.0, "wind_north_mps": -4.0}), cessna)


def fitted_deg(time: np.ndarray, angle: np.ndarray, period: float) -> float:
    """Amplitude [deg] by numpy's least squares, apart from the program's own fit."""
    basis = np.column_stack(
        [np.sin(2 * np.pi * time / period), np.cos(2 * np.pi * time / period), np.ones_like(time), time]
    )
    a, b = np.linalg.lstsq(basis, angle, rcond=None)[0][:2]
    return math.degrees(math.hypot(a, b))


def closure_m(flight: Flight, start_s: float, stop_s: float) -> float:
    ends = flight.carrier.at(np.array([start_s, stop_s]))
    points = ecef_from_geodetic(ends.lat_rad, ends.lon_rad, np.full(2, 3000.0))
    return float(np.linalg.norm(points[1] - points[0]))


def test_legs_have_their_length(box: Flight) -> None:
    legs = [segment for segment in box.segments if not segment.turn]
    assert [leg.heading_deg for leg in legs] == [0.0, 90.0, 180.0, 270.0]
    assert all(abs(leg.length_m - 11_000.0) < 50.0 for leg in legs)
    for leg in legs:
        ends = box.carrier.at(np.array([leg.start_s, leg.stop_s]))
        points = ecef_from_geodetic(ends.lat_rad, ends.lon_rad, np.full(2, 3000.0))
        assert np.linalg.norm(points[1] - points[0]) == pytest.approx(11_000.0, abs=20.0)


def test_legs_are_straight(box: Flight) -> None:
    for leg in (segment for segment in box.segments if not segment.turn):
        at = box.carrier.at(np.arange(leg.start_s, leg.stop_s, 0.5))
        points = ecef_from_geodetic(at.lat_rad, at.lon_rad, np.full(len(at), 3000.0))
        along = (points[-1] - points[0]) / np.linalg.norm(points[-1] - points[0])
        down = -points[0] / np.linalg.norm(points[0])
        off = (points - points[0]) @ np.cross(down, along)
        assert np.abs(off).max() < 30.0


def test_the_circuit_closes(box: Flight) -> None:
    assert closure_m(box, 0.0, box.segments[-1].stop_s) < 25.0
    assert box.notes["closure_m"][0] == pytest.approx(closure_m(box, 0.0, box.segments[-1].stop_s), abs=0.1)


def test_every_amplitude_is_flown(box: Flight) -> None:
    assert len(box.maneuvers) == 12
    for maneuver in box.maneuvers:
        begin, end = maneuver.start_s + maneuver.period_s, maneuver.stop_s - maneuver.period_s
        rows = (box.carrier.time_s >= begin) & (box.carrier.time_s <= end)
        angle = box.carrier.attitude[rows, ANGLES[maneuver.axis]]
        flown = fitted_deg(box.carrier.time_s[rows], angle, maneuver.period_s)
        assert flown == pytest.approx(maneuver.flown_deg, abs=0.01)
        assert flown == pytest.approx(maneuver.asked_deg, abs=0.25)
        # Half of peak to peak, the other common measure.
        half = math.degrees(np.ptp(angle)) / 2.0
        assert half == pytest.approx(maneuver.half_peak_to_peak_deg, abs=1e-9)
        assert half == pytest.approx(maneuver.asked_deg, abs=0.25)
        assert maneuver.residual_deg < 0.01 * maneuver.asked_deg + 0.05


def test_a_maneuver_leaves_the_other_axes_nearly_alone(box: Flight) -> None:
    for maneuver in box.maneuvers:
        first, second = maneuver.off_axis_deg
        if maneuver.axis == "pitch":
            assert max(first, second) < 1.0
        elif maneuver.axis == "roll":
            # The heading swings by g A / (V omega) and turns with it: that is how a coordinated turn begins.
            swing = 9.81 * maneuver.asked_deg * maneuver.period_s / (2.0 * math.pi * 75.0)
            assert first < 1.0
            assert second < 2.2 * swing
        else:
            assert first < 0.3 * maneuver.asked_deg
            assert second < 0.7


def test_maneuvers_start_on_time(box: Flight) -> None:
    legs = {segment.leg: segment for segment in box.segments if not segment.turn}
    for leg, segment in legs.items():
        pitch, roll, yaw = (m for m in box.maneuvers if m.leg == leg)
        assert pitch.start_s == pytest.approx(segment.start_s + 15.0, abs=0.02)
        assert pitch.stop_s == pytest.approx(pitch.start_s + 3.0 * pitch.period_s)
        assert roll.start_s == pytest.approx(pitch.stop_s + 6.0)
        assert yaw.start_s == pytest.approx(roll.stop_s + 6.0)
        assert yaw.stop_s < segment.stop_s


def test_labels_follow_the_flight(box: Flight) -> None:
    time = np.arange(0.0, box.duration_s, 0.1)
    labels = box.segment_columns(time)
    assert set(np.unique(labels["leg"])) == {1.0, 2.0, 3.0, 4.0}
    flown = box.carrier.at(time)
    course = np.degrees(np.arctan2(flown.velocity_n[:, 1], flown.velocity_n[:, 0]))
    off = (course - labels["leg_heading_deg"] + 180.0) % 360.0 - 180.0
    for leg in (1.0, 2.0, 3.0, 4.0):
        rows = (labels["turn"] == 0.0) & (labels["leg"] == leg)
        assert abs(off[rows].mean()) < 0.2
        assert np.abs(off[rows]).max() < 12.0
        assert np.abs(off[(labels["turn"] == 1.0) & (labels["leg"] == leg)]).max() > 85.0
    first = box.maneuvers[0]
    inside = (time >= first.start_s) & (time < first.stop_s)
    assert (labels["maneuver"][inside] == 1.0).all()
    assert set(labels["cycle"][inside]) == {1.0, 2.0, 3.0}


def test_segments_have_no_gaps(box: Flight) -> None:
    assert box.segments[0].start_s == 0.0
    for before, after in pairwise(box.segments):
        assert before.stop_s == after.start_s
    assert 0.0 <= box.segments[-1].stop_s - box.duration_s < 0.1
    assert [segment.turn for segment in box.segments] == [False, True] * 4


def test_the_first_row_is_at_the_start_point(box: Flight) -> None:
    at = box.carrier.at(np.array([0.0]))
    here = ecef_from_geodetic(at.lat_rad[0], at.lon_rad[0], 3000.0)
    start = ecef_from_geodetic(math.radians(16.72), math.radians(112.729), 3000.0)
    # Within half a log row along the course, and on the line.
    assert np.linalg.norm(here - start) < 5.0
    assert at.alt_m[0] == pytest.approx(3000.0, abs=1.0)


def test_the_log_is_whole(box: Flight) -> None:
    time = box.carrier.time_s
    np.testing.assert_allclose(np.diff(time), 1.0 / 30.0, rtol=1e-9)
    assert time[0] <= -3.0
    assert time[-1] >= box.duration_s + 3.0
    assert 0.0 in time
    table = np.column_stack([box.carrier.attitude, box.carrier.rate_b, box.carrier.velocity_n, box.carrier.alt_m])
    assert np.isfinite(table).all()
    assert np.abs(np.diff(box.carrier.attitude[:, 2])).max() < 0.1
    assert set(box.controls) == {"elevator", "aileron_left", "aileron_right", "rudder", "flap"}
    np.testing.assert_array_equal(box.controls["aileron_left"], -box.controls["aileron_right"])
    assert np.ptp(box.controls["elevator"]) > math.radians(2.0)
    assert not box.controls["flap"].any()


def test_position_velocity_attitude_and_rates_belong_together(box: Flight) -> None:
    carrier = box.carrier
    inner = slice(1, -1)
    step = 2.0 / carrier.rate_hz
    # Velocity: difference of Earth-fixed positions, seen in the local frame of the middle.
    position = ecef_from_geodetic(carrier.lat_rad, carrier.lon_rad, carrier.alt_m)
    to_n = rot_ne_at(carrier.lat_rad[inner], carrier.lon_rad[inner])
    velocity = np.einsum("nij,nj->ni", to_n, (position[2:] - position[:-2]) / step)
    assert np.abs(velocity - carrier.velocity_n[inner]).max() < 0.01
    # Rates: R' = R [w x], relative to the local frame.
    rot = rot_nb_from_attitude(carrier.attitude)
    spin = np.einsum("nji,njk->nik", rot[inner], (rot[2:] - rot[:-2]) / step)
    rate = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=-1)
    assert np.abs(rate - carrier.rate_b[inner]).max() < math.radians(0.3)
    # In the quiet before the first maneuver the differences are exact enough to see the turning of the local frame,
    # 1.2e-5 rad/s.
    quiet = (carrier.time_s[inner] > 1.0) & (carrier.time_s[inner] < 11.0)
    assert np.abs((rate - carrier.rate_b[inner])[quiet]).max() < 5e-7


def test_rates_are_those_of_the_local_frame(cessna: Aircraft, scenario_of: ScenarioOf) -> None:
    # Straight to the east at 80 degrees north the local frame turns by v tan(lat) / R: 3.8e-3 deg/s.
    pattern = {"kind": "straight", "leg_m": 2500.0}
    flight = fly(scenario_of(pattern, start={"lat_deg": 80.0, "heading_deg": 90.0}), cessna)
    rows = (flight.carrier.time_s > 2.0) & (flight.carrier.time_s < 25.0)
    turned = np.polyfit(flight.carrier.time_s[rows], flight.carrier.attitude[rows, 2], 1)[0]
    assert math.degrees(turned) == pytest.approx(3.8e-3, rel=0.3)
    assert flight.carrier.rate_b[rows, 2].mean() == pytest.approx(turned, rel=0.05)


@pytest.mark.parametrize("turn", ["right", "left"])
def test_a_cloverleaf_crosses_its_center(cessna: Aircraft, scenario_of: ScenarioOf, turn: str) -> None:
    air = {"wind_east_mps": -8.0, "wind_north_mps": 6.0, "turbulence_severity": 2}
    flight = fly(scenario_of({"kind": "cloverleaf", "leaf_m": 3000.0, "turn": turn}, air=air), cessna)
    center = ecef_from_geodetic(math.radians(16.72), math.radians(112.729), 3000.0)
    passes = [segment for segment in flight.segments if not segment.turn]
    steps = -90.0 if turn == "right" else 90.0
    assert [leg.heading_deg for leg in passes] == [(steps * i) % 360.0 for i in range(4)]
    for leg, noted in zip(passes, flight.notes["center_miss_m"], strict=True):
        assert leg.length_m == pytest.approx(6000.0, abs=20.0)
        at = flight.carrier.at(np.arange(leg.start_s, leg.stop_s, 0.02))
        places = ecef_from_geodetic(at.lat_rad, at.lon_rad, np.full(len(at), 3000.0))
        miss = np.linalg.norm(places - center, axis=1).min()
        assert miss < 25.0
        assert noted == pytest.approx(miss, abs=1.0)
    assert not flight.segments[-1].turn


def digest(flight: Flight) -> str:
    carrier = flight.carrier
    arrays = [carrier.time_s, carrier.lat_rad, carrier.lon_rad, carrier.alt_m, carrier.velocity_n]
    arrays += [carrier.attitude, carrier.rate_b, *flight.controls.values()]
    return hashlib.sha256(b"".join(array.tobytes() for array in arrays) + repr(flight.maneuvers).encode()).hexdigest()


SHORT = {
    "kind": "box",
    "leg_m": 2500.0,
    "lead_s": 5.0,
    "maneuvers": [{"axis": "roll", "amplitude_deg": 10.0, "period_s": 5.0, "cycles": 3}],
}

CHILD = """
import sys
from magsim.aircraft import load_aircraft
from magsim.flight import fly
from magsim.scenario import Scenario
from tests.flight.test_flying import digest
cessna = load_aircraft("c208b")
print(digest(fly(Scenario.model_validate_json(sys.argv[1], context={"aircraft": cessna}), cessna)))
"""


def test_the_same_flight_has_the_same_bytes(cessna: Aircraft, scenario_of: ScenarioOf, tmp_path: Path) -> None:
    rough = scenario_of(SHORT, air={"turbulence_severity": 2, "wind_east_mps": 5.0})
    first = digest(fly(rough, cessna))
    assert digest(fly(rough, cessna)) == first
    # Another process, other threads and time zone, an empty cache, another folder.
    env = os.environ | {
        "OMP_NUM_THREADS": "2",
        "OPENBLAS_NUM_THREADS": "2",
        "TZ": "Pacific/Auckland",
        "MAGSIM_CACHE": without_results(tmp_path / "cache"),
        "PYTHONPATH": str(ROOT),
    }
    child = subprocess.run(
        [sys.executable, "-c", CHILD, rough.model_dump_json(by_alias=True)],
        check=True,
        capture_output=True,
        text=True,
        env=env,
        cwd=tmp_path,
    )
    assert child.stdout.strip() == first


def test_the_seed_is_the_weather(cessna: Aircraft, scenario_of: ScenarioOf) -> None:
    pattern = {"kind": "straight", "leg_m": 2500.0}
    rough = [scenario_of(pattern, air={"turbulence_severity": 2}, seed=seed) for seed in (1, 2)]
    assert digest(fly(rough[0], cessna)) != digest(fly(rough[1], cessna))
    calm = [scenario_of(pattern, seed=seed) for seed in (1, 2)]
    assert digest(fly(calm[0], cessna)) == digest(fly(calm[1], cessna))


def test_the_shipped_flight_meets_its_figures() -> None:
    loaded = load_scenario("calibration_c208b_calm")
    flight = fly(loaded.scenario, loaded.aircraft)
    pattern = loaded.scenario.pattern
    assert len(flight.maneuvers) == 4 * pattern.circuits * len(pattern.maneuvers)
    assert max(abs(m.flown_deg - m.asked_deg) for m in flight.maneuvers) < 0.2
    assert all(abs(s.length_m - pattern.leg_m) < 50.0 for s in flight.segments if not s.turn)
    assert max(flight.notes["closure_m"]) < 25.0
    assert flight.carrier.alt_m.min() > 2950.0
    assert flight.carrier.alt_m.max() < 3050.0


def test_progress_rises_to_one(cessna: Aircraft, scenario_of: ScenarioOf) -> None:
    shares: list[float] = []
    fly(scenario_of({"kind": "straight", "leg_m": 2500.0}), cessna, progress=shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert 50 < len(shares) < 400


def test_a_flight_into_the_ground_is_reported(cessna: Aircraft, scenario_of: ScenarioOf) -> None:
    trains = [{"axis": "pitch", "amplitude_deg": 15.0, "period_s": 10.0, "cycles": 3}]
    low = scenario_of(
        {"kind": "box", "leg_m": 6000.0, "maneuvers": trains, "allow_beyond_crew_g": True}, start={"alt_m": 20.0}
    )
    with pytest.raises(DataError, match=r"the flight touched the ground at t = (1|2|3)\d\.\d s: height -?\d+ m"):
        fly(low, cessna)


def test_a_speed_below_the_stall_is_reported(cessna: Aircraft, scenario_of: ScenarioOf) -> None:
    high = scenario_of({"kind": "box", "leg_m": 2500.0}, start={"alt_m": 7600.0, "speed_mps": 50.0})
    with pytest.raises(RequestError, match=r"start.speed_mps: .* no straight and level flight at 50 m/s and 7600 m"):
        fly(high, cessna)


def test_maneuvers_that_the_wind_shortens_are_refused(cessna: Aircraft, scenario_of: ScenarioOf) -> None:
    pattern = {"kind": "box", "leg_m": 8800.0, "maneuvers": TRAINS, "allow_beyond_crew_g": True}
    windy = scenario_of(pattern, air={"wind_north_mps": 29.0})
    with pytest.raises(RequestError, match=r"with the wind of \[air\], leg 1 of circuit 1 is flown in \d+ s"):
        fly(windy, cessna)


def test_the_aircraft_folder_is_left_alone(cessna: Aircraft, scenario_of: ScenarioOf) -> None:
    folder = ROOT / "aircraft"
    before = {path: path.stat().st_mtime_ns for path in folder.rglob("*")}
    fly(scenario_of({"kind": "straight", "leg_m": 2500.0}), cessna)
    assert {path: path.stat().st_mtime_ns for path in folder.rglob("*")} == before

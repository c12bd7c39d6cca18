"""Crust, targets and variation along a flight: places, axes, switches, refusals; the base station's field."""

from collections.abc import Callable
from datetime import UTC, datetime

import numpy as np
import pytest

from magsim.aircraft import load_aircraft
from magsim.earth import LocalFrame, decimal_year, ecef_from_geodetic, geodetic_from_ecef, igrf, rot_ne_at
from magsim.errors import DataError
from magsim.field import AircraftResponse, compute_field, load_response
from magsim.field.background.crust import crust_of
from magsim.field.background.station import station_field
from magsim.field.background.targets import sources_of
from magsim.field.background.variation import variation_n
from magsim.frames import rot_nb_from_attitude
from magsim.scenario import BaseStation, Scenario
from magsim.terrain import Flat, Fractal, Ground, TangentPlane
from magsim.trajectory import Flight, Trajectory
from magsim.truth import FieldTruth
from tests.support.rotations import body_rates

START = {"lat_deg": 52.2, "lon_deg": 9.8, "alt_m": 224.0, "speed_mps": 70.0, "heading_deg": 20.0}
GROUND = Ground(Flat(80.0), 44.0)
REFERENCE_B = np.array([-5.0, 0.0, 0.4])
AIRCRAFT = load_aircraft("c208b")

SURFACES = ("elevator", "aileron_left", "aileron_right", "rudder", "flap")

CRUST = {"rms_nt": 200.0, "depth_m": 50.0}
WRECK = {"kind": "dipole", "name": "wreck", "depth_m": 5.0, "moment_am2": [2e4, 0.0, 6e4]}
WRECK |= {"north_m": 1100.0, "east_m": 420.0}
DIKE = {"kind": "prism", "name": "dike", "north_m": 2000.0, "east_m": 800.0, "depth_m": 230.0, "length_m": 1500.0}
DIKE |= {"width_m": 20.0, "height_m": 400.0, "heading_deg": 110.0, "susceptibility": 0.03}
ORE = {"kind": "sphere", "name": "ore", "depth_m": 60.0, "radius_m": 20.0, "susceptibility": 1.0}
ORE |= {"north_m": 2700.0, "east_m": 900.0}


@pytest.fixture(scope="module")
def flight() -> Flight:
    """A minute of level flight 100 m above the ground, swung and shaken about all axes up to 1.2 Hz."""
    time = np.arange(-4 * 30, 64 * 30 + 1) / 30.0
    random, attitude, rates = np.random.default_rng(7), np.zeros((len(time), 3)), np.zeros((len(time), 3))
    for hertz, size_deg in ((0.13, 10.0), (0.4, 1.5), (0.8, 0.7), (1.2, 0.4)):
        phase = random.uniform(0.0, 2.0 * np.pi, 3)
        angle = 2.0 * np.pi * hertz * time[:, None] + phase
        attitude += np.radians(size_deg) * np.sin(angle)
        rates += np.radians(size_deg) * 2.0 * np.pi * hertz * np.cos(angle)
    attitude[:, 2] += np.radians(20.0)
    course = np.array([np.cos(np.radians(20.0)), np.sin(np.radians(20.0))])
    plane = TangentPlane(np.radians(52.2), np.radians(9.8), 224.0)
    lat, lon = plane.geodetic(*(70.0 * time[:, None] * course).T)
    bob = 3.0 * np.sin(2.0 * np.pi * 0.15 * time)
    climb = -3.0 * 2.0 * np.pi * 0.15 * np.cos(2.0 * np.pi * 0.15 * time)
    velocity = np.column_stack([np.outer(np.ones(len(time)), 70.0 * course), climb])
    carrier = Trajectory(time, lat, lon, 224.0 + bob, velocity, attitude, body_rates(attitude, rates), REFERENCE_B)
    return Flight(carrier, 60.0, 120.0, {name: np.zeros(len(time)) for name in SURFACES}, (), ())


@pytest.fixture(scope="module")
def response() -> AircraftResponse:
    return load_response(AIRCRAFT)


def scenario(seed: int = 1, **field: object) -> Scenario:
    return Scenario.model_validate(
        {
            "schema": 1,
            "seed": seed,
            "aircraft": "c208b",
            "start": START,
            "pattern": {"kind": "box"},
            "field": field,
            "sensors": {"scalar": [{"name": "tail", "mount": "sgl_mag_1"}, {"name": "cabin", "mount": "cabin_center"}]},
        }
    )


@pytest.fixture(scope="module")
def run(flight: Flight, response: AircraftResponse) -> Callable[..., FieldTruth]:
    return lambda ground=GROUND, **field: compute_field(scenario(**field), AIRCRAFT, flight, response, ground=ground)


def at_own_place(flight: Flight, truth: FieldTruth, mount: str, field_e: Callable, rows: slice) -> np.ndarray:
    """A field evaluated at every wanted sample at the mount's own Earth-fixed position; body axes."""
    path = flight.carrier.at(truth.time_s[rows])
    rot_be = np.einsum("nij,nik->njk", rot_nb_from_attitude(path.attitude), rot_ne_at(path.lat_rad, path.lon_rad))
    arm = np.array(AIRCRAFT.mounts[mount]) - REFERENCE_B
    place_e = ecef_from_geodetic(path.lat_rad, path.lon_rad, path.alt_m) + np.einsum("njk,j->nk", rot_be, arm)
    return np.einsum("njk,nk->nj", rot_be, field_e(place_e))


INSIDE = slice(480, -480, 7)


def test_crust_at_each_own_place(run: Callable, flight: Flight) -> None:
    truth, field = run(crust=CRUST), crust_of(scenario(crust=CRUST), GROUND)
    for mount in truth.mounts:
        exact = at_own_place(flight, truth, mount, field.field_e, INSIDE)
        assert np.abs(truth.part("crust", mount)[INSIDE] - exact).max() < 1e-4
    # Tail and cabin are 11 m apart: the difference is thousands of times the error of the spline.
    assert np.abs(truth.part("crust", "sgl_mag_1") - truth.part("crust", "cabin_center")).max() > 0.5


def test_targets_at_each_own_place(run: Callable, flight: Flight) -> None:
    settings = {"targets": [WRECK, DIKE, ORE]}
    truth, sources = run(**settings), sources_of(scenario(**settings), GROUND)
    for mount in truth.mounts:
        exact = sum(at_own_place(flight, truth, mount, source.field_e, INSIDE) for source in sources)
        assert np.abs(truth.part("target", mount)[INSIDE] - exact).max() < 1e-4
        assert np.abs(exact).max() > 20.0


def test_variation_is_the_same_vector_everywhere(run: Callable, flight: Flight) -> None:
    truth = run(variation={"drift_nt": 5.0})
    exact = variation_n(scenario(variation={"drift_nt": 5.0}), truth.time_s)
    path = flight.carrier.at(truth.time_s)
    rot_en = np.swapaxes(rot_ne_at(path.lat_rad, path.lon_rad), 1, 2)
    there = rot_ne_at(*np.radians([52.2, 9.8])) @ rot_en @ rot_nb_from_attitude(path.attitude)
    for mount in truth.mounts:
        turned = np.einsum("nij,nj->ni", there, truth.part("variation", mount))
        np.testing.assert_allclose(turned, exact, rtol=0, atol=1e-10)


def test_new_parts_leave_the_others_alone(run: Callable) -> None:
    plain, full = run(), run(crust=CRUST, targets=[WRECK], variation={})
    assert set(full.parts_b) - set(plain.parts_b) == {"crust", "target", "variation"}
    for part in ("earth", "permanent", "hinged"):
        np.testing.assert_array_equal(plain.parts_b[part], full.parts_b[part])
    # What is induced is induced by the whole background.
    assert np.abs(full.parts_b["induced"] - plain.parts_b["induced"]).max() > 0.1


def test_parts_that_are_off_are_absent(run: Callable) -> None:
    truth = run(crust=CRUST | {"enabled": False}, variation={"enabled": False}, targets=[])
    assert not {"crust", "target", "variation"} & set(truth.parts_b)


def test_a_flight_below_the_plane_is_refused_with_the_remedy(run: Callable) -> None:
    wanted = r"at \d+\.\d s the flight is 7\d\.\d m below .*allowed: plane_m = 2[12]\d or lower"
    with pytest.raises(DataError, match=wanted) as e:
        run(crust=CRUST | {"plane_m": 295.0})
    plane = float(str(e.value).rsplit("= ", 1)[1].split(" ")[0])
    assert "crust" in run(crust=CRUST | {"plane_m": plane}).parts_b


def test_heights_count_from_the_ground_at_the_start() -> None:
    plane = TangentPlane(np.radians(52.2), np.radians(9.8))
    hills = Fractal(
        plane, np.random.default_rng(1), mean_m=300.0, relief_m=200.0, longest_m=5e3, shortest_m=300.0, hurst=0.8
    )
    ground = Ground(hills, 44.0)
    here = float(ground.height(np.radians(52.2), np.radians(9.8)))
    assert crust_of(scenario(crust=CRUST), ground).frame.alt_m == here
    assert crust_of(scenario(crust=CRUST), GROUND).frame.alt_m == 124.0
    assert crust_of(scenario(crust=CRUST), None).frame.alt_m == 0.0
    assert crust_of(scenario(crust=CRUST | {"plane_m": 50.0}), ground).frame.alt_m == 50.0
    field = crust_of(scenario(crust=CRUST), GROUND)
    assert field.height(ecef_from_geodetic(*np.radians([52.2, 9.8]), 224.0)) == pytest.approx(100.0)


def test_shortest_wavelength_is_that_of_the_band() -> None:
    modes = crust_of(scenario(crust=CRUST), GROUND).modes
    assert 2.0 * np.pi / modes.wavenumber.max() == pytest.approx(70.0 / 0.6, rel=0.02)
    assert 2.0 * np.pi / modes.wavenumber.max() >= 70.0 / 0.6


def test_a_crust_of_its_own_seed_is_shared_by_scenarios() -> None:
    shared = [crust_of(scenario(seed, crust=CRUST | {"seed": 5}), GROUND).modes for seed in (1, 2)]
    np.testing.assert_array_equal(shared[0].phase, shared[1].phase)
    apart = [crust_of(scenario(seed, crust=CRUST), GROUND).modes for seed in (1, 2)]
    assert not np.array_equal(apart[0].phase, apart[1].phase)


@pytest.mark.parametrize(
    "body",
    [
        WRECK | {"depth_m": -100.0},
        ORE | {"radius_m": 110.0, "depth_m": 0.0},
        DIKE | {"depth_m": 0.0},
    ],
    ids=lambda body: body["kind"],
)
def test_a_sensor_inside_a_body_is_refused_with_name_and_place(run: Callable, flight: Flight, body: dict) -> None:
    """The body is put on the path of the cabin's mount at half a minute."""
    path = flight.carrier.at(np.array([30.0]))
    rot_be = np.einsum("ij,ik->jk", rot_nb_from_attitude(path.attitude)[0], rot_ne_at(path.lat_rad, path.lon_rad)[0])
    arm = np.array(AIRCRAFT.mounts["cabin_center"]) - REFERENCE_B
    place_e = ecef_from_geodetic(path.lat_rad, path.lon_rad, path.alt_m)[0] + arm @ rot_be
    lat, lon, alt = geodetic_from_ecef(place_e)
    there = {key: value for key, value in body.items() if key not in ("north_m", "east_m")}
    there |= {"lat_deg": float(np.degrees(lat)), "lon_deg": float(np.degrees(lon))}
    if body["kind"] == "dipole":
        there["depth_m"] = 124.0 - float(alt)
    wanted = rf"is inside the {body['kind']} '{body['name']}' at \d\d\.\d s, at 52\.\d+, 9\.\d+ deg, 22\d"
    with pytest.raises(DataError, match=wanted):
        run(targets=[there])


def test_base_station_feels_everything_at_its_own_place() -> None:
    station = BaseStation(north_m=-3000.0, east_m=500.0, height_m=3.0)
    settings = {"crust": CRUST, "targets": [ORE], "variation": {"drift_nt": 3.0}}
    model = {"earth": {"departure": {"enabled": False}}}
    full, time = scenario(**settings, **model), np.arange(-480, 7200) / 120.0
    got = station_field(station, full, GROUND, time)
    lat, lon = TangentPlane(*np.radians([52.2, 9.8])).geodetic(np.array(-3000.0), np.array(500.0))
    frame = LocalFrame(float(lat), float(lon), 127.0)
    constant_e = sum(
        field_e(frame.origin_e[None])[0]
        for field_e in (crust_of(full, GROUND).field_e, *(source.field_e for source in sources_of(full, GROUND)))
    )
    main = igrf(frame.lat_rad, frame.lon_rad, 127.0, decimal_year(full.start.time_utc))
    turn = frame.rot_ne @ rot_ne_at(*np.radians([52.2, 9.8])).T
    exact = main + frame.rot_ne @ constant_e + variation_n(full, time) @ turn.T
    np.testing.assert_allclose(got, exact, rtol=0, atol=1e-3)  # a minute of secular variation
    quiet = station_field(station, scenario(**model), GROUND, time)
    np.testing.assert_allclose(quiet, np.broadcast_to(main, quiet.shape), rtol=0, atol=1e-3)


def test_base_station_in_wrong_places() -> None:
    time = np.arange(-480, 1200) / 120.0
    with pytest.raises(DataError, match=r"station 'ground' stands 48\.0 m below .*plane_m = 126 or lower"):
        station_field(BaseStation(), scenario(crust=CRUST | {"plane_m": 174.0}), GROUND, time)
    above = {key: ORE[key] for key in ("kind", "name", "radius_m", "susceptibility")}
    above |= {"north_m": 0.0, "east_m": 0.0, "depth_m": 10.0}
    with pytest.raises(DataError, match="station 'ground' is inside the sphere 'ore'"):
        station_field(BaseStation(), scenario(targets=[above]), GROUND, time)


@pytest.mark.parametrize(
    ("start", "wanted"),
    [
        (datetime(2029, 12, 31, 23, 59, 30, tzinfo=UTC), r"flight ends at 2030-01-01 00:00:\d\d UTC, .*1900 to 2030"),
        (datetime(1900, 1, 1, tzinfo=UTC), r"flight begins at 1899-12-31 23:59:5\d UTC, .*1900 to 2030"),
    ],
)
def test_a_flight_out_of_the_years_of_the_model_is_refused(
    flight: Flight, response: AircraftResponse, start: datetime, wanted: str
) -> None:
    table = scenario().model_dump(by_alias=True)
    late = Scenario.model_validate(table | {"start": table["start"] | {"time_utc": start}})
    with pytest.raises(DataError, match=wanted):
        compute_field(late, AIRCRAFT, flight, response, ground=GROUND)
    with pytest.raises(DataError, match=wanted):
        station_field(BaseStation(), late, GROUND, np.arange(-480, 7680) / 120.0)


def test_crust_and_variation_over_a_pole(response: AircraftResponse) -> None:
    """North turns by half a circle within the flight; fields of the ground do not."""
    time = np.arange(-4 * 30, 64 * 30 + 1) / 30.0
    frame = LocalFrame(np.radians(89.98), 0.0, 300.0)
    place = np.column_stack([70.0 * time + 100.0, np.full(len(time), 40.0), np.zeros(len(time))])
    lat, lon, alt = geodetic_from_ecef(frame.position(place))
    lon = np.unwrap(lon)
    straight_n = rot_ne_at(lat, lon) @ frame.rot_ne.T @ np.array([1.0, 0.0, 0.0])
    attitude = np.column_stack([np.zeros((len(time), 2)), np.unwrap(np.arctan2(straight_n[:, 1], straight_n[:, 0]))])
    rates = np.gradient(attitude, time, axis=0)
    carrier = Trajectory(time, lat, lon, alt, 70.0 * straight_n, attitude, rates, REFERENCE_B)
    flight = Flight(carrier, 60.0, 120.0, {name: np.zeros(len(time)) for name in SURFACES}, (), ())
    table = scenario(crust=CRUST, variation={}).model_dump(by_alias=True)
    polar = Scenario.model_validate(table | {"start": table["start"] | {"lat_deg": 89.98, "lon_deg": 0.0}})
    truth = compute_field(polar, AIRCRAFT, flight, response, ground=GROUND)
    exact = at_own_place(flight, truth, "sgl_mag_1", crust_of(polar, GROUND).field_e, INSIDE)
    assert np.abs(truth.part("crust", "sgl_mag_1")[INSIDE] - exact).max() < 1e-4
    # The aircraft flies straight, so a vector that is one in space hardly turns in body axes.
    turned = truth.part("variation", "sgl_mag_1") - variation_n(polar, truth.time_s)
    assert np.abs(turned).max() < 0.05

"""What moves in flight: controls, the engine on its mounts, floors that give; each with its switch and its column."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.aircraft import Aircraft, load_aircraft
from magsim.columns import FLEX
from magsim.errors import RequestError
from magsim.field import compute_field, load_response
from magsim.field.load import specific_force
from magsim.field.metal.steel.model import load_steel
from magsim.field.sources.dipoles import dipole_field
from magsim.field.sources.moving import dipole_gradient
from magsim.frames import rot_nb_from_attitude
from magsim.scenario import Scenario
from magsim.sensors import Acquisition
from magsim.sensors.scalar import part_columns
from magsim.trajectory import Flight
from magsim.truth import FieldTruth
from tests.field.test_flex import flight
from tests.support.scenarios import over_the_sea

__all__ = ["flight"]

MOUNT = "sgl_mag_2"
ROWS = np.arange(10, 700, 23)
ON = {"enabled": True}


@pytest.fixture(scope="module")
def aircraft() -> Aircraft:
    return load_aircraft("c208b")


def scenario_of(**field: object) -> Scenario:
    return over_the_sea(
        field,
        {"scalar": [{"name": "floor", "mount": MOUNT}, {"name": "tail", "mount": "sgl_mag_1"}]},
    )


@pytest.fixture(scope="module")
def plain(aircraft: Aircraft, flight: Flight) -> FieldTruth:
    return compute_field(scenario_of(), aircraft, flight)


def loads(aircraft: Aircraft, flight: Flight, time_s: np.ndarray, place_m: tuple[float, ...]) -> np.ndarray:
    """Loads along the axes by the accelerometer's reading, less that at rest, as what gives way goes, (n, 3) [g]."""
    motion = flight.carrier.at(time_s)
    force = specific_force(motion, rot_nb_from_attitude(motion.attitude), 1.0 / 120.0, np.array(place_m))
    return -(force / 9.80665 + [0.0, 0.0, 1.0])


def test_off_by_default(plain: FieldTruth) -> None:
    assert not {"controls", "suspension"} & set(plain.parts_b)
    assert not plain.bent_b


def test_controls_follow_the_logged_surfaces(aircraft: Aircraft, flight: Flight, plain: FieldTruth) -> None:
    """Ways and turns of the file, dipole by dipole; no other part changes."""
    truth = compute_field(scenario_of(controls=ON), aircraft, flight)
    rows = np.arange(0, len(truth.time_s), 90)
    angles = {name: np.degrees(angle[rows]) for name, angle in flight.controls_at(truth.time_s).items()}
    place, exact = np.array(aircraft.mounts[MOUNT]), np.zeros((len(rows), 3))
    for dipole in aircraft.magnetics.controls:
        at = np.array(dipole.position_m) + 1e-3 * np.outer(angles[dipole.surface], dipole.travel_mmpdeg)
        moment = np.tile(dipole.moment_am2, (len(rows), 1))
        if dipole.turn_degpdeg:
            turn = np.radians(dipole.turn_degpdeg * angles[dipole.surface])
            cos, sin = np.cos(turn)[:, None], np.sin(turn)[:, None]
            assert dipole.turn_axis == (1.0, 0.0, 0.0)
            ahead, across = np.array([1.0, 0.0, 0.0]), np.diag([0.0, 1.0, 1.0])
            arm = np.array(dipole.position_m) - dipole.turn_point_m
            turned = [
                v * ahead + cos * (across @ v) + sin * np.cross(ahead, v) for v in (arm, np.array(dipole.moment_am2))
            ]
            at, moment = dipole.turn_point_m + turned[0], turned[1]
        exact += dipole_field(at, moment, place)
    np.testing.assert_allclose(truth.part("controls", MOUNT)[rows], exact, rtol=0, atol=1e-10)
    assert np.ptp(exact, axis=0).max() > 0.5
    for name, part in plain.parts_b.items():
        np.testing.assert_array_equal(truth.parts_b[name], part)


def test_the_engine_hangs_on_rubber(aircraft: Aircraft, flight: Flight, plain: FieldTruth) -> None:
    """A load upward pushes it down by its compliance, with its steel and its propeller."""
    truth = compute_field(scenario_of(suspension=ON), aircraft, flight)
    mounts = aircraft.magnetics.suspensions["engine"]
    way = 1e-3 * np.array(mounts.compliance_mmpg) * loads(aircraft, flight, truth.time_s, mounts.position_m)
    assert np.ptp(way[:, 2]) > 1e-3
    steel, hub = load_steel(aircraft).only(["engine"]), np.array(aircraft.magnetics.rotating[0].position_m)
    for mount in truth.mounts:
        place, ambient = np.array(aircraft.mounts[mount]), truth.background(mount)
        kernel = np.stack([dipole_field(hub, unit, place) for unit in np.eye(3)], axis=1)
        turning = truth.part("propeller", mount) @ np.linalg.inv(kernel).T
        exact = dipole_field(hub + way, turning, place) - dipole_field(hub, turning, place)
        for dipole in aircraft.magnetics.permanent:
            if dipole.suspension == "engine":
                at, moment = np.array(dipole.position_m), np.array(dipole.moment_am2)
                exact += dipole_field(at + way, moment, place) - dipole_field(at, moment, place)
        at, gone = (steel.at(seen, gradient=False).induced for seen in (place[None], place - way[ROWS]))
        metal = np.einsum("nij,nj->ni", gone - at, ambient[ROWS])
        got = truth.part("suspension", mount)[ROWS]
        np.testing.assert_allclose(got, exact[ROWS] + metal, rtol=0, atol=5e-3 * np.abs(exact).max())
        assert np.abs(metal).max() > 0.03 * np.abs(exact).max()
    np.testing.assert_array_equal(truth.parts_b["permanent"], plain.parts_b["permanent"])


def test_a_floor_follows_the_load(aircraft: Aircraft, flight: Flight, plain: FieldTruth) -> None:
    """0.4 mm for each g down, in the gradient of every part; what all parts change by is a column of its own."""
    truth = compute_field(scenario_of(flex=ON), aircraft, flight)
    assert set(truth.bent_b) == {MOUNT, "sgl_mag_1"}
    change = sum(truth.part(name, MOUNT) - plain.part(name, MOUNT) for name in plain.parts_b)
    np.testing.assert_allclose(truth.bent_b[MOUNT], change, rtol=0, atol=1e-9)
    way = loads(aircraft, flight, truth.time_s, aircraft.mounts[MOUNT]) * [0.0, 0.2e-3, 0.4e-3]
    place, exact = np.array([aircraft.mounts[MOUNT]]), np.zeros((len(way), 3))
    for dipole in aircraft.magnetics.permanent:
        exact += way @ dipole_gradient(np.array(dipole.position_m), np.array(dipole.moment_am2), place)[0]
    found = truth.part("permanent", MOUNT) - plain.part("permanent", MOUNT)
    np.testing.assert_allclose(found, exact, rtol=0, atol=5e-3 * np.abs(exact).max())
    assert np.abs(exact).max() > 1.0
    acquisition = Acquisition.of(truth.time_s, 4.0, 120.0, 10.0)
    columns = part_columns("floor", MOUNT, truth, acquisition)
    np.testing.assert_array_equal(columns[FLEX.name(sensor="floor", axis="z")], acquisition(truth.bent_b[MOUNT])[:, 2])
    assert FLEX.name(sensor="floor", axis="z") not in part_columns("floor", MOUNT, plain, acquisition)


def test_the_gradient_at_the_front_floor_is_what_it_was_said_to_be(aircraft: Aircraft) -> None:
    """37 nT/mm: of the aircraft's own permanent field and its steel in 43000 nT."""
    place, step = np.array(aircraft.mounts[MOUNT]), 1e-3
    gradient = sum(
        dipole_gradient(np.array(d.position_m), np.array(d.moment_am2), place[None])[0]
        for d in aircraft.magnetics.permanent
    )
    assert np.linalg.norm(gradient, axis=1).max() * step == pytest.approx(37.0, rel=0.25)


def test_a_control_whose_surface_is_not_logged_is_named(aircraft: Aircraft, flight: Flight) -> None:
    without = replace(flight, controls={name: a for name, a in flight.controls.items() if name != "rudder"})
    off = {"hinged": {"enabled": False}}
    with pytest.raises(RequestError, match=r"'pedal_left' of \[\[controls\]\] .*field.controls.enabled = false"):
        compute_field(scenario_of(controls=ON, **off), aircraft, without, load_response(aircraft))

"""A bent mount in the composed field: every part at the place where it is, and a fluxgate that looks elsewhere."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.aircraft import Aircraft, load_aircraft
from magsim.field import compute_field, load_response, response_at
from magsim.field.composition import backgrounds_of, situation_of
from magsim.field.flex import Bending
from magsim.field.situation import used_mounts
from magsim.frames import turned_back
from magsim.scenario import Scenario
from magsim.sensors import Acquisition
from magsim.sensors.fluxgate import fluxgate_columns
from magsim.trajectory import Flight, Trajectory
from magsim.truth import FieldTruth
from tests.support.rotations import rotate_about
from tests.support.scenarios import over_the_sea

MOUNT = "sgl_mag_1"
SURFACES = ("elevator", "aileron_left", "aileron_right", "rudder", "flap")


@pytest.fixture(scope="module")
def aircraft() -> Aircraft:
    return load_aircraft("c208b")


@pytest.fixture(scope="module")
def flight() -> Flight:
    """Eight seconds of swinging in all angles, hard enough to bend the stinger by centimeters."""
    time = np.arange(-60, 181) / 30.0
    phase = time[:, None] * [1.1, 1.6, 1.3]
    swing = np.radians([12.0, 8.0, 6.0])
    attitude, rate = swing * np.sin(phase), swing * [1.1, 1.6, 1.3] * np.cos(phase)
    velocity = 75.0 * np.column_stack([np.cos(attitude[:, 2]), np.sin(attitude[:, 2]), -np.sin(attitude[:, 1])])
    path = np.cumsum(velocity, axis=0) / 30.0
    carrier = Trajectory(
        time_s=time,
        lat_rad=np.radians(16.72) + path[:, 0] / 6.36e6,
        lon_rad=np.radians(112.729) + path[:, 1] / 6.1e6,
        alt_m=3000.0 - path[:, 2],
        velocity_n=velocity,
        attitude=attitude,
        rate_b=rate,
        reference_b=np.array([-0.15, 0.0, 0.25]),
    )
    controls = {name: 0.1 * np.sin(0.8 * time + i) for i, name in enumerate(SURFACES)}
    return Flight(carrier, 4.0, 120.0, controls, (), ())


def scenario_of(**flex: object) -> Scenario:
    return over_the_sea(
        {"flex": flex} if flex else {},
        {
            "scalar": [{"name": "cabin", "mount": "cabin_center"}],
            "fluxgate": [{"name": "tail", "mount": MOUNT, "noise_nt_rthz": 0.0}],
        },
    )


def with_stiff_cabin(aircraft: Aircraft) -> Aircraft:
    """Return the same aircraft, but for a stand in the cabin that does not give."""
    mounts = dict(aircraft.magnetics.mounts)
    mounts["cabin_center"] = mounts["cabin_center"].model_copy(update={"flex": ()})
    return replace(aircraft, magnetics=aircraft.magnetics.model_copy(update={"mounts": mounts}))


def bending_of(scenario: Scenario, aircraft: Aircraft, flight: Flight) -> Bending:
    background = backgrounds_of(scenario, flight)["carrier"]
    return Bending.of(situation_of(scenario, aircraft, load_response(aircraft), background, used_mounts(scenario)))


def test_off_by_default_and_rigid_where_no_mode_is_told(aircraft: Aircraft, flight: Flight) -> None:
    assert not bending_of(scenario_of(), aircraft, flight).shifts_b
    stiff = with_stiff_cabin(aircraft)
    assert set(bending_of(scenario_of(enabled=True), stiff, flight).shifts_b) == {MOUNT}
    plain = compute_field(scenario_of(), aircraft, flight)
    rigid = compute_field(scenario_of(enabled=True, scale=0.0), aircraft, flight)
    for name, part in plain.parts_b.items():
        np.testing.assert_array_equal(rigid.parts_b[name], part)
    bent = compute_field(scenario_of(enabled=True), stiff, flight)
    for name, part in plain.parts_b.items():
        np.testing.assert_array_equal(bent.part(name, "cabin_center"), part[:, bent.mounts.index("cabin_center")])


def test_every_part_is_that_of_the_place_to_second_order(aircraft: Aircraft, flight: Flight) -> None:
    """The aircraft with its mount at the place of one moment, rigid; twice the way, four times the error."""
    plain = compute_field(scenario_of(), aircraft, flight)
    moment = len(plain.time_s) // 2 + 17
    errors = []
    for scale in (0.5, 1.0):
        scenario = scenario_of(enabled=True, scale=scale)
        shift = bending_of(scenario, aircraft, flight).shifts_b[MOUNT][moment]
        assert np.linalg.norm(shift) > 0.004 * scale
        bent = compute_field(scenario, aircraft, flight)
        places = dict(aircraft.mounts)
        places[MOUNT] = np.array(places[MOUNT]) + shift
        there = compute_field(scenario_of(), aircraft, flight, response_at(aircraft, places))
        change = {name: there.part(name, MOUNT)[moment] - plain.part(name, MOUNT)[moment] for name in plain.parts_b}
        found = {name: bent.part(name, MOUNT)[moment] - plain.part(name, MOUNT)[moment] for name in plain.parts_b}
        for name, exact in change.items():
            assert np.abs(found[name] - exact).max() < 0.05 * np.abs(exact).max() + 1e-9, name
        errors.append(np.linalg.norm(sum(change.values()) - sum(found.values())))
    assert 3.0 < errors[1] / errors[0] < 5.0


def test_tilt_is_the_slope_of_the_tip(aircraft: Aircraft, flight: Flight) -> None:
    """Tip down and starboard of a boom to the rear: nose up about +y, and to port about -z; radians by the length."""
    bending = bending_of(scenario_of(enabled=True), aircraft, flight)
    shift, tilt = bending.shifts_b[MOUNT], bending.tilts_b[MOUNT]
    assert not np.any(shift[:, 0])
    slope = 1.3765 / 3.09
    np.testing.assert_allclose(tilt, slope * np.column_stack([0.0 * shift[:, 0], shift[:, 2], -shift[:, 1]]), rtol=2e-4)


def test_a_tilted_fluxgate_reads_turned_components(aircraft: Aircraft) -> None:
    """A constant tilt against the rotation of the field by the inverse; the truth of the parts is not turned."""
    time = np.arange(-240, 481) / 120.0
    field, tilt = np.array([30000.0, -2000.0, 20000.0]), np.array([0.0, 0.02, -0.01])
    parts = {"earth": np.tile(field, (len(time), 1, 1))}
    truth = FieldTruth(time, (MOUNT,), parts, tilts_b={MOUNT: np.tile(tilt, (len(time), 1))})
    sensor = scenario_of().sensors.fluxgate[0]
    acquisition = Acquisition.of(time, 1.0, 120.0, 10.0)
    columns = fluxgate_columns(sensor, truth, acquisition, 1)
    angle = np.linalg.norm(tilt)
    expected = rotate_about(tilt / angle, np.array([-angle]), field)[0]
    np.testing.assert_allclose([columns[f"flux_tail_{axis}_nt"][5] for axis in "xyz"], expected, rtol=1e-12)
    np.testing.assert_allclose([columns[f"earth_tail_{axis}_nt"][5] for axis in "xyz"], field, rtol=1e-12)
    straight = fluxgate_columns(sensor, replace(truth, tilts_b={}), acquisition, 1)
    np.testing.assert_allclose([straight[f"flux_tail_{axis}_nt"][5] for axis in "xyz"], field, rtol=1e-12)


def test_turned_back_undoes_a_rotation() -> None:
    axis, angles = np.array([0.6, 0.0, 0.8]), np.array([0.0, 1e-9, 0.3, -2.0, 3.1])
    vector = np.array([1.0, -2.0, 0.5])
    turned = rotate_about(axis, angles, vector)
    back = turned_back(angles[:, None] * axis, turned)
    np.testing.assert_allclose(back, np.tile(vector, (5, 1)), atol=1e-15)

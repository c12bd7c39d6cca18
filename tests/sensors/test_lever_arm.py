"""What follows from the place of an INS and from the bending between it and a fluxgate, and its error after turns."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from magsim.earth import ecef_from_geodetic
from magsim.errors import RequestError
from magsim.frames import rot_nb_from_attitude
from magsim.loading import load_scenario
from magsim.scenario import FluxgateSensor, Ins
from magsim.sensors import MeasuredFlight
from magsim.sensors.fluxgate import fluxgate_columns
from magsim.sensors.fluxgate import read as read_fluxgates
from magsim.sensors.inertial import inertial_columns, load_factor
from magsim.sensors.navigation import maneuver_error, read_ins
from magsim.trajectory import Flight, Trajectory
from magsim.units import G0
from tests.sensors.test_inertial import (
    attitude_i,
    attraction_i,
    derivative,
    place_i,
    rows,
    trajectory,
    triads,
    truth_of,
)
from tests.support.measured import flight, loaded, truth
from tests.trajectory.test_moved import ARM, place_e


def read(ins: Ins) -> dict[str, np.ndarray]:
    path = trajectory()
    whole = Flight(path, 60.0, 120.0, {}, (), ())
    settings = loaded().scenario.sensors.model_copy(update={"ins": ins})
    return read_ins(MeasuredFlight(settings, 1, whole, {}, rows()))


def place_of(out: dict[str, np.ndarray]) -> np.ndarray:
    return ecef_from_geodetic(np.radians(out["ins_lat_deg"]), np.radians(out["ins_lon_deg"]), out["ins_alt_m"])


def test_position_and_velocity_are_those_of_the_place():
    out, plain, t = read(Ins(position_m=tuple(ARM))), read(Ins()), rows().time_s
    np.testing.assert_allclose(place_of(out), place_e(t), atol=2e-5)
    assert np.linalg.norm(place_of(out) - place_of(plain), axis=1) == pytest.approx(np.linalg.norm(ARM), abs=1e-4)
    speed = np.sqrt(sum(out[f"ins_v{axis}_mps"] ** 2 for axis in "ned"))
    np.testing.assert_allclose(speed, np.linalg.norm(derivative(place_e, t), axis=1), atol=1e-4)
    # Weaving at 0.32 rad/s swings a point 6.5 m away by some m/s.
    assert np.std(out["ins_vd_mps"] - plain["ins_vd_mps"]) > 0.3
    np.testing.assert_allclose(out["ins_roll_deg"], plain["ins_roll_deg"], atol=1e-3)


def test_an_error_of_the_lever_arm_moves_position_and_velocity_alone():
    error = (0.3, -0.2, 0.1)
    both = read(Ins(position_m=tuple(ARM), lever_error_m=error))
    np.testing.assert_allclose(place_of(both), place_e(rows().time_s, ARM + error), atol=2e-5)
    path = trajectory()
    felt = [
        inertial_columns(Ins(position_m=tuple(ARM), lever_error_m=e), path, rows(), 1) for e in (error, (0.0, 0.0, 0.0))
    ]
    for name, column in felt[0].items():
        np.testing.assert_array_equal(column, felt[1][name])


def test_accelerometers_feel_the_acceleration_of_their_place():
    """Second differences of the place in inertial axes, less attraction, in body axes."""
    out = inertial_columns(Ins(position_m=tuple(ARM)), trajectory(), rows(), 1)
    acc, rate = triads(out, "ins")
    acc_cg, rate_cg = truth_of(out)
    t = rows().time_s[20:-20]
    place = lambda s: place_i(s) + attitude_i(s).apply(ARM)  # noqa: E731
    second = derivative(lambda s: derivative(place, s), t)
    wanted = attitude_i(t).inv().apply(second - attraction_i(t))
    np.testing.assert_allclose(acc[20:-20], wanted, atol=5e-3)
    assert np.abs(acc - acc_cg).max() > 0.3
    np.testing.assert_allclose(rate, rate_cg, atol=1e-3)


def test_a_place_off_the_hull_is_refused():
    with pytest.raises(
        RequestError, match=r"ins.position_m: \[8500.0, 0.0, 0.0\] is off the hull; allowed: -31.74 to 31.74 m"
    ):
        load_scenario("calibration_c208b", ["sensors.ins.position_m=[8500.0, 0.0, 0.0]"])


# ---- heading after maneuvers ------------------------------------------------------------------------------------


def test_heading_error_follows_its_equation():
    path, coupling, recovery = trajectory(), np.array([0.002, -0.001, 0.004]), 20.0
    ins = Ins(heading_coupling=tuple(coupling), heading_recovery_s=recovery)
    rate = lambda t: np.degrees(path.at(np.array([t])).rate_b[0]) @ coupling  # noqa: E731
    start = path.time_s[0]
    solved = solve_ivp(lambda t, e: rate(t) - e / recovery, (start, 30.0), [0.0], rtol=1e-8, atol=1e-10, max_step=0.05)
    found = maneuver_error(ins, path, np.array([10.0, 20.0, 30.0]))
    np.testing.assert_allclose(found, np.interp([10.0, 20.0, 30.0], solved.t, solved.y[0]), atol=3e-5)


def test_a_turn_leaves_its_share_and_is_forgotten():
    """A turn of 90 degrees in 10 s with 0.1 %: 0.09 degree, less what 60 s took back of it meanwhile."""
    t = np.arange(-120, 9000) / 30.0
    turning = ((t >= 10.0) & (t < 20.0)) * 9.0
    still = np.zeros((len(t), 3))
    rate = np.radians(np.stack([0.0 * t, 0.0 * t, turning], axis=1))
    path = Trajectory(t, 0.0 * t, 0.0 * t, 0.0 * t, still, still, rate)
    ins = Ins(heading_coupling=(0.0, 0.0, 0.001))
    found = maneuver_error(ins, path, np.array([5.0, 20.0, 140.0]))
    end = 0.009 * 60.0 * (1.0 - np.exp(-10.0 / 60.0))
    np.testing.assert_allclose(found, [0.0, end, end * np.exp(-2.0)], rtol=5e-3, atol=1e-9)


def test_heading_alone_is_off():
    plain, out = read(Ins()), read(Ins(heading_coupling=(0.001, 0.0, 0.0)))
    changed = {name for name in out if not np.array_equal(out[name], plain[name])}
    assert changed == {"ins_heading_deg"}
    assert 0.005 < np.abs(out["ins_heading_deg"] - plain["ins_heading_deg"]).max() < 0.1


# ---- flexure ----------------------------------------------------------------------------------------------------


def test_load_factor_of_a_pull_up():
    """Level at first, then a circle upward of 500 m at 70 m/s: 1 + v^2 / (r g) at its bottom."""
    t = np.arange(-90, 360) / 30.0
    up = -np.where(t > 3.0, 70.0 * np.sin(70.0 / 500.0 * (t - 3.0)), 0.0)
    north = np.where(t > 3.0, 70.0 * np.cos(70.0 / 500.0 * (t - 3.0)), 70.0)
    pitch = np.where(t > 3.0, 70.0 / 500.0 * (t - 3.0), 0.0)
    zero = 0.0 * t
    place = (0.5 + zero, 1.0 + zero, 3000.0 + zero)
    rate = np.where(t > 3.0, 0.14, 0.0)
    stacked = [np.stack(three, axis=1) for three in ((north, zero, up), (zero, pitch, zero), (zero, rate, zero))]
    path = Trajectory(t, *place, *stacked)
    found = load_factor(path, np.array([0.0, 3.5]))
    angle = 0.14 * 0.5
    assert found[0] == pytest.approx(1.0, abs=3e-3)  # gravity of place and height, and the turning Earth
    assert found[1] == pytest.approx(np.cos(angle) + 70.0**2 / 500.0 / G0, abs=5e-3)


def test_the_fluxgate_turns_with_the_load(make_truth, acquisition):
    """0.2 degree about y for each g: at 2 g, 0.2 degree of 50 000 nT."""
    field = make_truth(earth=lambda t: (3e4, 0.0, 4e4))
    load = np.full(len(field.time_s), 2.0)
    bent = FluxgateSensor(name="flux", mount="cabin", noise_nt_rthz=0.0, flexure_deg_g=(0.0, 0.2, 0.0))
    out = fluxgate_columns(bent, field, acquisition, 1, load_g=load)
    wanted = rot_nb_from_attitude(np.radians([0.0, 0.2, 0.0])).T @ [3e4, 0.0, 4e4]
    for k, axis in enumerate("xyz"):
        np.testing.assert_allclose(out[f"flux_flux_{axis}_nt"], wanted[k], rtol=0, atol=1e-6)
    assert out["fluxerror_flux_x_nt"][50] == pytest.approx(-4e4 * np.sin(np.radians(0.2)) - 0.18, abs=0.05)
    level = fluxgate_columns(bent, field, acquisition, 1, load_g=np.ones(len(load)))
    np.testing.assert_allclose(level["fluxerror_flux_x_nt"], 0.0, atol=1e-9)


def test_a_flight_bends_it_by_its_own_load():
    whole = flight(16.0)
    bent = loaded([{"name": "cabin", "mount": "cabin_center"}]).scenario.sensors
    flux = bent.fluxgate[0].model_copy(update={"flexure_deg_g": (0.3, 0.0, 0.0), "noise_nt_rthz": 0.0})
    field = truth(16.0)
    measured = MeasuredFlight(bent.model_copy(update={"fluxgate": (flux,)}), 1, whole, {"carrier": field}, _rows(field))
    straight = bent.model_copy(update={"fluxgate": (flux.model_copy(update={"flexure_deg_g": (0.0, 0.0, 0.0)}),)})
    plain = read_fluxgates(MeasuredFlight(straight, 1, whole, {"carrier": field}, _rows(field)))
    moved = read_fluxgates(measured)["flux_flux_y_nt"] - plain["flux_flux_y_nt"]
    load = load_factor(whole.carrier, field.time_s) - 1.0
    angle = np.radians(0.3) * load
    wanted = _rows(field)(
        np.sin(angle) * field.total("cabin_rear")[:, 2] + (np.cos(angle) - 1.0) * field.total("cabin_rear")[:, 1]
    )
    np.testing.assert_allclose(moved, wanted, rtol=0, atol=1e-6)
    assert np.std(moved) > 0.1


def _rows(field):
    from magsim.sensors import Acquisition

    return Acquisition.of(field.time_s, 16.0, 120.0, 10.0)

"""Currents of a flight, their field at the mounts, and the voltages that they leave."""

import dataclasses

import numpy as np
import pytest

from magsim.aircraft import Aircraft, load_aircraft
from magsim.aircraft.magnetics import Bus, Feeder, Magnetics
from magsim.errors import RequestError
from magsim.field import compute_field, load_response
from magsim.field.metal.coils import Loop
from magsim.field.wiring import wires
from magsim.field.wiring.electronics import Clock, currents, voltages
from magsim.field.wiring.harness import Wiring
from magsim.loading import load_scenario
from magsim.scenario import Scenario
from magsim.trajectory import Flight, Trajectory

RATE = 120.0
LOG = 30


def flown(**switches) -> Flight:
    """One minute straight and level, with an elevator that swings."""
    time = np.arange(-4 * LOG, 64 * LOG + 1) / LOG
    still = np.zeros(len(time))
    carrier = Trajectory(
        time_s=time,
        lat_rad=np.full(len(time), 0.3) + 75.0 * time / 6.36e6,
        lon_rad=np.full(len(time), 2.0),
        alt_m=np.full(len(time), 3000.0),
        velocity_n=np.tile([75.0, 0.0, 0.0], (len(time), 1)),
        attitude=np.column_stack([still, still, still]),
        rate_b=np.zeros((len(time), 3)),
    )
    controls = {"elevator": np.radians(5.0) * np.sin(2.0 * np.pi * time / 6.0)}
    return Flight(carrier, 60.0, RATE, controls, (), (), switches=switches)


def clock(flight: Flight, seed: int = 1) -> Clock:
    time = np.arange(-4 * 120, 64 * 120 + 1) / RATE
    return Clock(time, 1.0 / RATE, flight, seed)


def load(**settings) -> Feeder:
    return Feeder.model_validate({"name": "x", "wire_radius_m": 0.001, "load": settings, "source": "a test"})


def current(flight: Flight, seed: int = 1, **settings) -> np.ndarray:
    return currents((load(**settings),), clock(flight, seed))["x"]


def test_strobe_of_two_milliseconds_has_its_mean():
    # 60 whole periods of 68 s: the steps cover -4 - 1/240 s to 64 + 1/240 s.
    drawn = current(flown(), kind="pulse", current_a=9.0, period_s=1.0, width_s=0.002, phase_s=0.3, idle_a=0.5)
    inside = drawn[: 60 * 120]
    assert inside.mean() == pytest.approx(0.5 + 9.0 * 0.002, rel=1e-11)
    assert inside.max() == pytest.approx(0.5 + 9.0 * 0.002 * RATE, rel=1e-9)


def test_flap_motor_runs_while_its_switch_is_on():
    time = np.arange(-4 * LOG, 64 * LOG + 1) / LOG
    on = ((time >= 10.0) & (time < 13.0)).astype(float)
    settings = {"kind": "switch", "switch": "flap_motor", "current_a": 12.0}
    drawn = current(flown(flap_motor=on), **settings)
    at = clock(flown()).time_s
    assert drawn.sum() / RATE == pytest.approx(36.0, rel=1e-9)
    assert not drawn[(at < 9.97) | (at > 13.0)].any()
    peak = current(flown(flap_motor=on), **settings, rise_s=0.01, inrush=3.0, inrush_s=0.2)
    assert 20.0 < peak.max() < 36.0
    # The peak brings (3 - 1) 12 A x 0.2 s of charge beside the steady current, and the lag takes nothing.
    assert peak.sum() / RATE == pytest.approx(36.0 + 24.0 * 0.2, rel=1e-6)


def test_what_a_flight_does_not_log():
    for unlogged, amperes in ((False, 0.0), (True, 2.0)):
        drawn = current(flown(), kind="switch", switch="autopilot", current_a=2.0, unlogged=unlogged)
        np.testing.assert_array_equal(drawn, amperes)
    np.testing.assert_allclose(current(flown(), kind="motor", full_a=20.0, unlogged=0.25), 5.0)
    np.testing.assert_array_equal(current(flown(), kind="servo", surface="rudder", idle_a=0.2, per_dps_a=1.0), 0.2)


def test_motor_follows_the_throttle():
    time = np.arange(-4 * LOG, 64 * LOG + 1) / LOG
    flight = flown(throttle=0.5 + 0.4 * np.sin(2.0 * np.pi * time / 10.0))
    at = clock(flight).time_s
    drawn = current(flight, kind="motor", idle_a=1.0, full_a=21.0, exponent=2.0)
    np.testing.assert_allclose(drawn, 1.0 + 20.0 * (0.5 + 0.4 * np.sin(2.0 * np.pi * at / 10.0)) ** 2, atol=0.02)
    # A lag of 1 s at 0.1 Hz: amplitude by 1 / (1 + (w tau)^2)^1/2.
    late = current(flight, kind="motor", full_a=20.0, rise_s=1.0)[30 * 120 :]
    assert 0.5 * np.ptp(late) == pytest.approx(20.0 * 0.4 / np.hypot(1.0, 0.2 * np.pi), rel=1e-3)


def test_servo_draws_by_motion_and_deflection():
    at = clock(flown()).time_s
    swing = 2.0 * np.pi * at / 6.0
    drawn = current(flown(), kind="servo", surface="elevator", idle_a=0.1, per_dps_a=0.03, per_deg_a=0.2)
    exact = 0.1 + 0.03 * 5.0 * 2.0 * np.pi / 6.0 * np.abs(np.cos(swing)) + 0.2 * 5.0 * np.abs(np.sin(swing))
    np.testing.assert_allclose(drawn[20:-20], exact[20:-20], atol=1e-4)


def test_charge_decays():
    at = clock(flown()).time_s
    drawn = current(flown(), kind="charge", current_a=40.0, float_a=2.0, decay_s=50.0, before_s=20.0)
    np.testing.assert_allclose(drawn, 2.0 + 38.0 * np.exp(-(at + 20.0) / 50.0), rtol=1e-12)


def test_pump_cycles_by_the_seed_and_its_own_name():
    settings = {"kind": "duty", "current_a": 4.0, "on_s": 6.0, "off_s": 9.0, "jitter": 0.2}
    one, again, other = (current(flown(), seed, **settings) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, again)
    assert np.abs(one - other).max() == pytest.approx(4.0)
    pump = load(**settings)
    both = currents((pump, pump.model_copy(update={"name": "y"})), clock(flown()))
    np.testing.assert_array_equal(both["x"], one)
    assert np.abs(both["x"] - both["y"]).max() == pytest.approx(4.0)
    assert 0.25 < one.mean() / 4.0 < 0.6


def test_sums_voltages_and_loads_that_are_off():
    feeders = (
        load(kind="constant", current_a=3.0),
        load(kind="constant", current_a=4.0).model_copy(update={"name": "y"}),
        load(kind="sum", of=["x", "y"], current_a=1.5).model_copy(update={"name": "z"}),
    )
    drawn = currents(feeders, clock(flown()))
    np.testing.assert_allclose(drawn["z"], 8.5)
    buses = (
        Bus(name="main", open_circuit_v=28.0, resistance_ohm=0.1, feeders=("z",), source="a test"),
        Bus(name="far", fed_by="main", resistance_ohm=0.5, feeders=("x", "y"), source="a test"),
    )
    bus = voltages(buses, drawn)
    np.testing.assert_allclose(bus["main"], 28.0 - 0.85)
    np.testing.assert_allclose(bus["far"], 28.0 - 0.85 - 3.5)
    np.testing.assert_allclose(currents(feeders, clock(flown()), frozenset({"x"}))["z"], 5.5)


def scenario(**electronics) -> Scenario:
    return Scenario.model_validate(
        {
            "schema": 1,
            "seed": 1,
            "aircraft": "c208b",
            "start": {"lat_deg": 16.72, "lon_deg": 112.729, "alt_m": 3000.0, "speed_mps": 75.0},
            "pattern": {"kind": "box"},
            "field": {"hinged": {"enabled": False}, "electronics": electronics},
            "sensors": {
                "scalar": [{"name": "tail", "mount": "sgl_mag_1"}, {"name": "cabin", "mount": "cabin_center"}],
            },
        },
        context={"aircraft": load_aircraft("c208b")},
    )


@pytest.fixture(scope="module")
def aircraft() -> Aircraft:
    return load_aircraft("c208b")


def test_field_is_the_sum_of_gains_and_currents(aircraft):
    flight = flown()
    truth = compute_field(scenario(scale=-2.0), aircraft, flight)
    feeders = aircraft.magnetics.feeders
    assert tuple(truth.currents_a) == tuple(feeder.name for feeder in feeders)
    assert tuple(truth.voltages_v) == tuple(bus.name for bus in aircraft.magnetics.buses)
    place = np.array([aircraft.mounts["cabin_center"]])
    total = np.zeros((len(truth.time_s), 3))
    for name, amperes in truth.currents_a.items():
        wiring = Wiring(tuple(feeder for feeder in Wiring.of(aircraft.magnetics).conductors if feeder.name == name))
        total += amperes[:, None] * wiring.at(place)[0, :, 0]
    np.testing.assert_allclose(truth.part("electronics", "cabin_center"), -2.0 * total, atol=1e-9)
    assert np.abs(total).max() > 10.0
    generator = truth.currents_a["generator"]
    np.testing.assert_allclose(truth.voltages_v["main"], 28.5 - 0.006 * generator, rtol=1e-12)


def test_off_means_no_field_no_current_no_voltage(aircraft):
    truth = compute_field(scenario(enabled=False), aircraft, flown())
    assert "electronics" not in truth.parts_b
    assert not truth.currents_a
    assert not truth.voltages_v


def test_an_aircraft_without_wiring_has_no_such_part(aircraft):
    bare = aircraft.magnetics.model_copy(update={"feeders": (), "buses": ()})
    truth = compute_field(scenario(), dataclasses.replace(aircraft, magnetics=bare), flown())
    assert "electronics" not in truth.parts_b
    assert "permanent" in truth.parts_b


def test_a_scenario_changes_single_feeders(aircraft):
    plain = compute_field(scenario(), aircraft, flown()).currents_a
    changed = compute_field(
        scenario(feeders={"strobe": {"period_s": 0.5, "current_a": 4.0}, "pitot_heater": {"enabled": False}}),
        aircraft,
        flown(),
    ).currents_a
    assert not changed["pitot_heater"].any()
    assert changed["strobe"].max() < 0.6 * plain["strobe"].max()
    np.testing.assert_array_equal(changed["fuel_pump"], plain["fuel_pump"])
    feeder = plain["panel_feeder"] - plain["strobe"] - 7.0
    np.testing.assert_allclose(changed["panel_feeder"] - changed["strobe"], feeder, atol=1e-9)


@pytest.mark.parametrize(
    ("override", "text"),
    [
        ("feeders.strob.period_s=1.0", "feeders.strob: c208b has no such feeder; allowed: avionics, com_1, strobe"),
        (
            "feeders.strobe.on_s=1.0",
            "its load is of kind 'pulse' and has no such key; allowed: enabled, current_a, period",
        ),
        ("feeders.strobe.period=1.0", "unknown key (did you mean 'period_s'?)"),
        ("feeders.strobe.width_s=-1.0", "-1 is not allowed; allowed: a number above 0"),
        ("feeders.strobe.width_s=3.0", "width_s = 3 is not below period_s = 1.15"),
        ("feeders.strobe.current_a='much'", "'much' is text; allowed: a number"),
    ],
)
def test_wrong_settings_are_told(override, text):
    with pytest.raises(RequestError) as caught:
        load_scenario("calibration_c208b", [f"field.electronics.{override}"])
    assert text in str(caught.value)
    assert str(caught.value).startswith("--set field.electronics.feeders.")


def test_response_has_the_gains_of_every_mount(aircraft):
    gains = load_response(aircraft).wiring_nt_per_a
    places = np.array(list(aircraft.mounts.values()))
    np.testing.assert_allclose(gains, Wiring.of(aircraft.magnetics).at(places), rtol=1e-12)


def test_paths_become_polygons():
    magnetics = Magnetics.model_validate(
        {
            "datum": "somewhere",
            "mounts": {"here": {"position_m": [3.0, 1.0, 0.5], "source": "a test"}},
            "feeders": [
                {
                    "name": "lamp",
                    "wire_radius_m": 0.001,
                    "load": {"kind": "constant", "current_a": 1.0},
                    "source": "a test",
                    "paths": [
                        {"kind": "pair", "vertices_m": [[0, 0.5, 0], [2, 0.5, 0]], "offset_m": [0, 0, 0.1]},
                        {"kind": "loop", "vertices_m": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "share": 0.5, "mirror": True},
                    ],
                }
            ],
        }
    )
    points = np.array([[3.0, 1.0, 0.5], [0.0, -2.0, 1.0]])
    strip = Loop(np.array([[0, 0.5, 0], [2, 0.5, 0], [2, 0.5, 0.1], [0, 0.5, 0.1]]), 0.001)
    right, left = (Loop(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, y, 0.0]]), 0.001) for y in (1.0, -1.0))
    expected = wires.field([wires.Conductor("all", (strip, right, left), (1.0, 0.5, 0.5))], points)
    np.testing.assert_allclose(Wiring.of(magnetics).at(points), expected, rtol=1e-12)

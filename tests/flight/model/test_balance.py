"""Mass and balance: what JSBSim flies is what the facts say, loaded, burning and with flaps."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from magsim.aircraft import Aircraft
from magsim.errors import RequestError
from magsim.flight import fly
from magsim.flight.model.aero import flap_curve, inertia
from magsim.flight.model.airframe import body_from_inches
from magsim.flight.model.instance import load
from magsim.flight.model.plant import Plant
from magsim.flight.model.setup import PlantSetup
from magsim.flight.model.trim import trim
from magsim.loading import load_scenario
from magsim.scenario import Scenario
from magsim.units import G0, LB, SLUG_FT2

LOADS = [(None, None, 0.0), (700.0, 1000.0, 0.2), (300.0, 150.0, 0.0), (1100.0, 400.0, 0.5)]


@pytest.mark.parametrize(("payload", "fuel", "aft"), LOADS)
def test_jsbsim_flies_the_load(cessna: Aircraft, payload: float | None, fuel: float | None, aft: float) -> None:
    facts = cessna.facts.loaded(payload, fuel, aft)
    fdm = load(facts, 120)
    fdm.run_ic()
    assert fdm["inertia/weight-lbs"] * LB == pytest.approx(facts.mass_kg, rel=1e-6)
    center = body_from_inches([fdm[f"inertia/cg-{axis}-in"] for axis in "xyz"], facts)
    np.testing.assert_allclose(center, facts.cg_b, atol=1e-6)
    moments = inertia(facts)
    for name, value in (("ixx", moments.xx), ("iyy", moments.yy), ("izz", moments.zz)):
        assert fdm[f"inertia/{name}-slugs_ft2"] * SLUG_FT2 == pytest.approx(value, rel=1e-6)
    # Whatever is carried, the moments refer to the same point of the airframe.
    reference = body_from_inches([fdm[f"metrics/aero-rp-{axis}-in"] for axis in "xyz"], facts)
    np.testing.assert_allclose(reference, cessna.facts.aerodynamic_reference_b, atol=1e-9)


def test_center_of_gravity_is_the_mean_of_the_parts(cessna: Aircraft) -> None:
    balance = cessna.facts.mass.balance
    x = (
        balance.empty.value * balance.empty_position.value[0]
        + 500.0 * balance.payload_position.value[0]
        + 800.0 * balance.fuel_positions[0].value[0]
    ) / (balance.empty.value + 1300.0)
    assert cessna.facts.loaded(500.0, 800.0).cg_b[0] == pytest.approx(x, abs=1e-12)


def test_a_load_farther_aft_needs_less_tail_down(cessna: Aircraft) -> None:
    # Moment of the shifted weight, balanced by the elevator.
    setup = PlantSetup(0.0, 0.0, 3000.0, 0.0, 75.0)
    aft = cessna.facts.loaded(None, None, 0.4)
    names = ("fcs/elevator-cmd-norm", "fcs/pitch-trim-cmd-norm")
    before, after = (sum(trim(facts, setup).commands[n] for n in names) for facts in (cessna.facts, aft))
    assert after > before + 0.01


@pytest.mark.parametrize(
    ("payload", "fuel", "aft", "message"),
    [
        (1500.0, None, 0.0, r"weighs 4164 kg with it; allowed: up to 3969, that is 195 kg less"),
        (None, 1200.0, 0.0, r"1200 kg of fuel; allowed: up to 1009"),
        (None, None, 2.0, r"lies at station 5\.\d+ m at 3629 kg; allowed: 4\.912 to 5\.190"),
        (900.0, 1000.0, -2.0, r"center of gravity.* lies at station 4\.\d+ m at 3964 kg"),
        (1000.0, 900.0, 0.8, r"without fuel lies at station"),
    ],
)
def test_loads_outside_the_limits_are_refused(
    cessna: Aircraft, payload: float | None, fuel: float | None, aft: float, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        cessna.facts.loaded(payload, fuel, aft)


def test_fuel_is_burned_on_request(cessna: Aircraft) -> None:
    setup = PlantSetup(0.0, 0.0, 3000.0, 0.0, 75.0)
    held, burning = Plant(cessna.facts, setup), Plant(cessna.facts, PlantSetup(0.0, 0.0, 3000.0, 0.0, 75.0, burn=True))
    for plant in (held, burning):
        for _ in range(600):
            plant.run(12)
    assert held.fuel_kg == pytest.approx(600.0, abs=1e-6)
    rate = burning._fdm["propulsion/engine/fuel-flow-rate-pps"] * LB
    assert 600.0 - burning.fuel_kg == pytest.approx(60.0 * rate, rel=0.02)
    assert burning._fdm["inertia/weight-lbs"] * LB == pytest.approx(3629.0 - 600.0 + burning.fuel_kg, rel=1e-6)


@pytest.mark.parametrize("flap_deg", [10.0, 30.0])
def test_flaps_take_over_lift(cessna: Aircraft, flap_deg: float) -> None:
    # Level flight at the same speed: the flaps' lift replaces that of the angle of attack.
    facts, alt, speed = cessna.facts, 1000.0, 55.0
    clean, flapped = (
        trim(facts, PlantSetup(0.0, 0.0, alt, 0.0, speed, flap_rad=math.radians(f))) for f in (0.0, flap_deg)
    )
    points = flap_curve(facts)
    lift = float(np.interp(math.radians(flap_deg), [p[0] for p in points], [p[1] for p in points]))
    assert clean.pitch - flapped.pitch == pytest.approx(lift / 5.7, rel=0.1)


def test_flap_lift_is_raymers(cessna: Aircraft) -> None:
    # 0.9 x 1.3 x 1.1 x 0.75 for the whole travel.
    assert flap_curve(cessna.facts)[-1][:2] == pytest.approx((math.radians(30.0), 0.96525))


def test_flaps_are_flown_and_recorded(cessna: Aircraft, scenario_of: Callable[..., Scenario]) -> None:
    start = {"alt_m": 1000.0, "speed_mps": 58.0, "flap_deg": 20.0}
    loading = {"fuel_kg": 500.0, "burn_fuel": True}
    flight = fly(scenario_of({"kind": "box", "circuits": 1, "leg_m": 3000.0}, start=start, loading=loading), cessna)
    np.testing.assert_allclose(flight.controls["flap"], math.radians(20.0), atol=1e-12)
    assert flight.carrier.alt_m[0] == pytest.approx(1000.0, abs=1.0)
    assert flight.notes["mass_kg"] == pytest.approx(2064.0 + 965.0 + 500.0)
    assert 450.0 < flight.notes["fuel_left_kg"] < 499.0
    np.testing.assert_allclose(flight.carrier.reference_b, cessna.facts.loaded(None, 500.0).cg_b)


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("start.flap_deg=35", "35 is beyond the travel of c208b; allowed: 0 to 30"),
        ("start.flap_deg=30", "30 deg of flap at 75 m/s, 64.6 m/s indicated; allowed at this deflection: up to 64.3"),
        ("loading.fuel_kg=1500", "loading: 1500 kg of fuel; allowed: up to 1009"),
        ("loading.payload_kg=1500", "loading: Cessna 208B Grand Caravan weighs 4164 kg"),
    ],
)
def test_a_scenario_is_held_to_the_limits(override: str, message: str) -> None:
    with pytest.raises(RequestError, match=message):
        load_scenario("calibration_c208b", (override,))


def test_weight_is_carried_at_every_load(cessna: Aircraft) -> None:
    # A lighter aircraft flies at a smaller angle of attack: the lift over the slope.
    setup = PlantSetup(0.0, 0.0, 3000.0, 0.0, 75.0)
    light = cessna.facts.loaded(300.0, 300.0)
    less = (cessna.facts.mass_kg - light.mass_kg) * G0 / (0.5 * 0.909 * 75.0**2 * 25.96)
    assert trim(cessna.facts, setup).pitch - trim(light, setup).pitch == pytest.approx(less / 5.65, rel=0.15)

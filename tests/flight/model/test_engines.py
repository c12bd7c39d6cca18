"""Engines: what is certified of the turboprop, its governor and its twin, and direct thrust as before."""

import math

import jsbsim
import pytest

from magsim.aircraft import Aircraft, Facts
from magsim.aircraft.engine import DirectEngine
from magsim.flight.model.engines import available_power, available_thrust, lever_of
from magsim.flight.model.plant import Plant
from magsim.flight.model.setup import PlantSetup
from magsim.flight.model.start import start
from magsim.flight.model.trim import trim
from magsim.units import FT, HP, LBF

SETUP = PlantSetup(lat_rad=0.3, lon_rad=2.0, alt_m=3000.0, course=1.0, speed_mps=75.0)


@pytest.fixture(scope="module")
def direct(cessna: Aircraft) -> Facts:
    """The Cessna with a thrust that depends on speed and height alone."""

    def fact(value: float, unit: str) -> dict:
        return {"value": value, "unit": unit, "source": "estimate"}

    curve = {"at": [0.0, 9000.0], "at_unit": "m", "value": [1.0, 0.5], "unit": "1", "source": "estimate"}
    engine = {
        "kind": "direct",
        "power": fact(503000.0, "W"),
        "propeller_efficiency": fact(0.84, "1"),
        "static_thrust": fact(8500.0, "N"),
        "height_factor": curve,
        "position": {"value": [3.2, 0.0, 0.0], "unit": "m", "source": "estimate"},
    }
    return cessna.facts.model_copy(update={"engine": DirectEngine.model_validate(engine)})


def full_power(cessna: Aircraft, alt_m: float) -> jsbsim.FGFDMExec:
    """The lever forward for 15 s, level with the autopilot's height loop."""
    fdm = start(cessna.facts, PlantSetup(0.3, 2.0, alt_m, 1.0, 75.0))
    fdm["fcs/throttle-cmd-norm"] = 2.0
    for _ in range(15 * 120):
        fdm.run()
    return fdm


def test_torque_speed_and_power_are_one_statement(cessna: Aircraft) -> None:
    # TCDS A37CE gives 675 shp, 1865 ft-lb and 1900 rpm: two of them make the third.
    engine = cessna.facts.engine
    assert engine.torque.value * engine.propeller.speed.value == pytest.approx(engine.power.value, rel=1e-3)
    assert engine.power.value / HP == pytest.approx(675.0, rel=1e-4)


@pytest.mark.parametrize("alt_m", [300.0, 1500.0])
def test_low_down_the_engine_is_flat_rated(cessna: Aircraft, alt_m: float) -> None:
    fdm = full_power(cessna, alt_m)
    assert fdm["propulsion/engine/power-hp"] == pytest.approx(675.0, abs=1.0)
    assert fdm["propulsion/engine/propeller-rpm"] == pytest.approx(1900.0, abs=2.0)
    assert fdm["propulsion/engine/propeller-torque-ftlb"] == pytest.approx(-1865.0, abs=8.0)


def test_high_up_the_power_falls_with_density(cessna: Aircraft) -> None:
    # ICAO standard atmosphere at 20 000 ft: density ratio 0.5328.
    engine = cessna.facts.engine
    assert available_power(engine, 0.5328 * 1.225) == pytest.approx(585000.0 * 0.5328**0.7, rel=1e-6)
    assert full_power(cessna, 20000.0 * FT)["propulsion/engine/power-hp"] == pytest.approx(
        585000.0 * 0.5328**0.7 / HP, rel=0.01
    )


def test_lever_and_thrust_are_inverse(cessna: Aircraft) -> None:
    engine = cessna.facts.engine
    most = available_thrust(engine, 75.0, 0.909)
    assert lever_of(engine, most, 75.0, 0.909) == pytest.approx(1.0, abs=1e-6)
    assert 0.0 < lever_of(engine, 0.3 * most, 75.0, 0.909) < lever_of(engine, 0.6 * most, 75.0, 0.909) < 1.0


@pytest.mark.parametrize(("alt_m", "speed_mps"), [(500.0, 60.0), (3000.0, 75.0), (5000.0, 85.0)])
def test_a_plant_begins_in_quiet_flight(cessna: Aircraft, alt_m: float, speed_mps: float) -> None:
    setup = PlantSetup(0.3, 2.0, alt_m, 1.0, speed_mps)
    plant = Plant(cessna.facts, setup)
    rpm = plant._fdm["propulsion/engine/propeller-rpm"]
    for _ in range(100):
        plant.run(12)
        assert plant.value("alt") == pytest.approx(alt_m, abs=1.0)
        assert plant.value("airspeed") == pytest.approx(speed_mps, abs=0.2)
        assert abs(math.degrees(plant.value("roll"))) < 0.2
    assert rpm == pytest.approx(1900.0, abs=1.0)


def test_a_plant_begins_at_its_setup(cessna: Aircraft) -> None:
    plant = Plant(cessna.facts, SETUP)
    assert plant.value("lat") == pytest.approx(0.3, abs=2e-6)  # 13 m
    assert plant.value("lon") == pytest.approx(2.0, abs=2e-6)
    assert plant.value("heading") == pytest.approx(1.0, abs=math.radians(0.2))


def test_the_twin_pulls_like_the_turboprop(cessna: Aircraft) -> None:
    # Level flight needs the same thrust from both: trim of the one, settled flight of the other.
    trimmed = trim(cessna.facts, SETUP)
    fdm = start(cessna.facts, SETUP)
    for _ in range(40 * 120):
        fdm.run()
    assert fdm["fcs/throttle-pos-norm"] == pytest.approx(trimmed.commands["fcs/throttle-cmd-norm"], abs=0.01)
    assert fdm["attitude/theta-rad"] == pytest.approx(trimmed.pitch, abs=math.radians(0.1))


def test_direct_thrust_is_an_engine_of_its_own(direct: Facts) -> None:
    plant = Plant(direct, SETUP)
    thrust = plant._fdm["propulsion/engine/thrust-lbs"] * LBF
    for _ in range(300):
        plant.run(12)
    assert plant.value("alt") == pytest.approx(3000.0, abs=0.5)
    assert plant.value("airspeed") == pytest.approx(75.0, abs=0.1)
    assert thrust == pytest.approx(available_thrust(direct.engine, 75.0, 0.909) * 0.75, rel=0.2)

"""Speed of the propeller in the log."""

import numpy as np
import pytest

from magsim.aircraft import load_aircraft
from magsim.aircraft.engine import FixedPropeller
from magsim.flight.model.channels import TO_SI
from magsim.flight.model.engines import turning_speed
from magsim.flight.model.plant import Plant
from magsim.flight.model.setup import PlantSetup
from magsim.flight.pilot.log import Log

RPM = np.pi / 30.0


def flown(name: str, setup: PlantSetup, seconds: int = 15) -> np.ndarray:
    """Revolutions a minute at ten rows a second, of a flight straight on."""
    facts = load_aircraft(name).facts
    plant = Plant(facts, setup)
    table = np.array([plant.run(12) for _ in range(10 * seconds)]) * TO_SI
    return Log(np.arange(len(table)) / 10.0, table).rotors(facts.engine)["propeller"] / RPM


def test_the_governor_holds_1900_turns_a_minute() -> None:
    speed = flown("c208b", PlantSetup(lat_rad=0.3, lon_rad=2.0, alt_m=3000.0, course=1.0, speed_mps=75.0))
    assert np.abs(speed - 1900.0).max() < 5.0


def test_speed_of_a_fixed_propeller_gives_its_thrust() -> None:
    """Back through the thrust coefficient, at speeds from rest to fast."""
    propeller = load_aircraft("uav").facts.engine.propeller
    speed, density = np.array([0.0, 15.0, 25.0, 32.0]), np.array([1.225, 1.2, 1.1, 1.0])
    thrust = np.array([82.0, 40.0, 20.0, 0.0])
    hertz = turning_speed(propeller, thrust, speed, density) / (2.0 * np.pi)
    diameter, advance = 0.508, speed / (hertz * 0.508)
    factor = 0.09357 - 0.06044 * advance - 0.1079 * advance**2
    np.testing.assert_allclose(density * hertz**2 * diameter**4 * factor, thrust, atol=1e-10)
    # McLain's motor: 145 rpm for each volt of 44.4 without load is 107 Hz; at rest it gives nearly all of them.
    assert 95.0 < hertz[0] < 107.3


def test_the_drone_turns_faster_when_it_flies_faster() -> None:
    """Straight on the speed is that of the trim: thrust against drag; 44.4 V and 145 rpm/V are the most."""
    slow, fast = (
        flown("uav", PlantSetup(lat_rad=0.3, lon_rad=2.0, alt_m=50.0, course=1.0, speed_mps=speed)).mean()
        for speed in (22.0, 28.0)
    )
    assert 4000.0 < slow < fast < 6438.0


def test_a_thrust_that_two_speeds_give_is_refused() -> None:
    raw = load_aircraft("uav").facts.engine.propeller.model_dump()
    raw["thrust_coefficient"]["value"] = [0.09, -0.06, 0.1]
    with pytest.raises(ValueError, match="has not one speed for each thrust; allowed"):
        FixedPropeller.model_validate(raw)

"""The propeller against momentum theory, which no propeller beats, and its own limits."""

import math

import numpy as np
import pytest

from magsim.aircraft import Aircraft
from magsim.aircraft.engine import Propeller
from magsim.flight.model.propeller import ADVANCE, PITCH_DEG, coefficients, governed_thrust, tables


@pytest.fixture(scope="module")
def propeller(cessna: Aircraft) -> Propeller:
    return cessna.facts.engine.propeller


def ideal_power(thrust: np.ndarray, advance: np.ndarray) -> np.ndarray:
    """Froude's actuator disk: T (V + v) with v from the momentum, in terms of C_T, J and C_P."""
    induced = 0.5 * (np.sqrt(advance**2 + 8.0 * thrust / math.pi) - advance)
    return thrust * (advance + induced)


def test_no_blade_beats_the_actuator_disk(propeller: Propeller) -> None:
    thrust, power = tables(propeller)
    advance = np.repeat(np.array(ADVANCE)[:, None], len(PITCH_DEG), axis=1)
    pulling = thrust > 0.01
    assert (power[pulling] > ideal_power(thrust, advance)[pulling]).all()


def test_many_slender_blades_without_drag_come_near_the_actuator_disk(propeller: Propeller) -> None:
    # With light load, no section drag and no tip loss what remains is swirl and uneven load: a few percent.
    blades = propeller.blades.model_copy(update={"value": 60.0})
    chord = propeller.chord.model_copy(update={"value": tuple(0.02 * c for c in propeller.chord.value)})
    none = propeller.profile_drag.model_copy(update={"value": 0.0})
    slender = propeller.model_copy(update={"blades": blades, "chord": chord, "profile_drag": none, "drag_rise": none})
    advance = np.array([1.0])
    thrust, power = coefficients(slender, advance, np.radians([26.0]))
    ideal = ideal_power(thrust, advance)
    assert 0.002 < thrust[0] < 0.05
    assert power[0] == pytest.approx(ideal[0], rel=0.05)
    assert power[0] > ideal[0]


def test_a_finer_blade_gives_less_thrust_and_a_windmill_gives_power(propeller: Propeller) -> None:
    thrust, power = coefficients(propeller, np.full(3, 1.0), np.radians([5.0, 15.0, 25.0]))
    assert (np.diff(thrust) > 0.0).all()
    assert thrust[0] < 0.0
    assert power[0] < 0.0


def test_efficiencies_are_those_of_good_propellers(propeller: Propeller) -> None:
    # Constant-speed propellers of this class: 0.83 to 0.88 in cruise, 0.55 to 0.75 of the ideal thrust at rest.
    power, density = 503347.0, 0.9046
    assert 0.83 < governed_thrust(propeller, power, 94.7, density) * 94.7 / power < 0.88
    disk = 0.25 * math.pi * propeller.diameter.value**2
    ideal = (2.0 * 1.225 * disk * power**2) ** (1.0 / 3.0)
    assert 0.55 < (governed_thrust(propeller, power, 0.0, 1.225) / ideal) ** 1.5 < 0.75

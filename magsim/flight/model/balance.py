"""Mass and balance for JSBSim: the dry aircraft and its tanks, so that fuel may be burned.

JSBSim adds the inertia of dry mass and fuel about the common center of gravity to the dry inertia. The inertia of the
textbook formulas is that of the loaded aircraft at the beginning of the flight; the dry one is the rest.
"""

from collections.abc import Sequence

import numpy as np

from magsim.aircraft.facts import Facts

FUEL_SHARE = 0.0125
"""Part of the mass that counts as fuel if the aircraft file has no balance; it is in the center of gravity."""


def tanks(facts: Facts) -> tuple[tuple[tuple[float, float, float], float, float], ...]:
    """Return position in body axes from the datum [m], contents and capacity [kg] of each tank."""
    balance = facts.mass.balance
    if balance is None:
        fuel = FUEL_SHARE * facts.mass_kg
        return ((facts.cg_b, fuel, fuel),)
    count = len(balance.fuel_positions)
    return tuple(
        (place.value, balance.fuel.value / count, balance.fuel_capacity.value / count)
        for place in balance.fuel_positions
    )


def dry_mass(facts: Facts) -> float:
    """Return the mass with empty tanks [kg]."""
    return facts.mass_kg - sum(fuel for _, fuel, _ in tanks(facts))


def dry_inertia(facts: Facts, whole: np.ndarray) -> np.ndarray:
    """Return the inertia (3, 3) [kg m^2] of the dry aircraft about its own center of gravity.

    Parameters
    ----------
    facts : Facts
    whole : (3, 3) [kg m^2]
        Inertia of the loaded aircraft about its center of gravity.
    """
    parts = [(dry_mass(facts), facts.dry_cg_b), *((fuel, place) for place, fuel, _ in tanks(facts))]
    return whole - sum(_about(mass, place, facts.cg_b) for mass, place in parts)


def _about(mass: float, place: Sequence[float], center: Sequence[float]) -> np.ndarray:
    """Return the inertia of a point about another one (Steiner)."""
    arm = np.array(place) - np.array(center)
    return mass * (float((arm * arm).sum()) * np.eye(3) - np.outer(arm, arm))

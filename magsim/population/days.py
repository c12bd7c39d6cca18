"""The days of an individual: what its magnets, its metal and what it carries are like on one of them."""

import math
from dataclasses import replace
from typing import TypeVar

import numpy as np

from magsim.aircraft import Vehicle
from magsim.aircraft.magnetics import DIPOLE_CLEARANCE_M, Carried, Coil, Dipole, FixedDipole, Magnetics, Skin
from magsim.config import Vector
from magsim.earth.atmosphere import standard_temperature_c
from magsim.population.draws import Draws, between, direction, lognormal, normal, vector
from magsim.population.spreads import ALUMINUM_PER_K, DAY, MAGNETS, REFERENCE_C

V = TypeVar("V", bound=Vehicle)
D = TypeVar("D", bound=Dipole)

SEAT_REACH_M = 0.1
"""How far off the mean posture a person may be: 0.06 in a posture, with a fidget and sway on top."""

TRIES = 1000
"""Most places that are tried for what is carried."""


def departure_k(draws: Draws, day: int) -> float:
    """Return how much warmer the air of a day is than the standard atmosphere [K]."""
    return DAY["air"].size[0] * normal(replace(draws, attempt=0)(f"day/{day}/air"))


def outside_c(draws: Draws, day: int, alt_m: float) -> float:
    """Return the temperature of the air at a height [m] on a day [degC]."""
    return standard_temperature_c(alt_m) + departure_k(draws, day)


def on_day(vehicle: V, number: int, day: int, air_c: float) -> V:
    """Return an individual as it is on one of its days.

    The remanence of each part walks from day to day: day d adds a step to day d - 1, the same whichever day is asked
    for. Temperature, joints, crew and cases are those of the day alone.

    Parameters
    ----------
    vehicle : Aircraft or Bird
        The individual as built.
    number : int
        Of the individual.
    day : int
        0 is the individual as built.
    air_c : float [degC]
        Of the air outside, which magnets and metal have taken on.
    """
    if day == 0:
        return vehicle
    draws, built = Draws(vehicle.name, number), vehicle.magnetics
    worn = {
        "permanent": tuple(_worn(dipole, draws, day, air_c) for dipole in built.permanent)
        + tuple(_carried(part, built, draws(f"day/{day}/carried/{part.name}")) for part in built.carried),
        "hinged": tuple(_worn(dipole, draws, day, air_c) for dipole in built.hinged),
        "controls": tuple(_worn(dipole, draws, day, air_c) for dipole in built.controls),
        "rotating": tuple(_worn(dipole, draws, day, air_c) for dipole in built.rotating),
        "carried": (),
        "coils": tuple(_coil(coil, air_c) for coil in built.coils),
        "skin": None if built.skin is None else _skin(built.skin, draws, day, air_c),
    }
    magnetics = Magnetics.model_validate(built.model_copy(update=worn).model_dump(mode="json"))
    return replace(vehicle, magnetics=magnetics, nominal=vehicle.nominal or vehicle)


def _worn(dipole: D, draws: Draws, day: int, air_c: float) -> D:
    moment = np.array(dipole.moment_am2)
    if dipole.magnet is None:
        moment = moment + np.linalg.norm(moment) * walk(draws(f"remanence/{dipole.name}"), day)
    else:
        moment = moment * (1.0 + MAGNETS[dipole.magnet][0] * (air_c - REFERENCE_C))
    return dipole.model_copy(update={"moment_am2": vector(moment)})


def walk(random: np.random.Generator, day: int) -> np.ndarray:
    """Return the change of a moment since day 0, over its size then, (3,): the sum of the steps of all days."""
    median, late = DAY["remanence"].size
    sigma = math.log(late / median) / 1.6448536269514722  # the 95th percentile of a normal number
    numbers = random.standard_normal((day, 4))  # the numbers of a day do not depend on how many follow
    sizes = median * np.exp(sigma * numbers[:, 0])
    ways = numbers[:, 1:] / np.linalg.norm(numbers[:, 1:], axis=1, keepdims=True)
    return sizes @ ways


def _carried(part: Carried, magnetics: Magnetics, random: np.random.Generator) -> FixedDipole:
    """Return what is carried as a dipole somewhere in its box, off every mount.

    A box without such a place leaves the last one, which the rules of aircraft files then refuse.
    """
    place: Vector = part.center_m
    clearance = DIPOLE_CLEARANCE_M + (SEAT_REACH_M if part.seated else 0.0)
    for _ in range(TRIES):
        place = vector(np.array(part.center_m) + np.array(part.size_m) * random.uniform(-0.5, 0.5, 3))
        if all(math.dist(place, mount.position_m) >= clearance for mount in magnetics.mounts.values()):
            break
    moment = between(random, part.moment_am2) * direction(random)
    return FixedDipole(
        name=part.name, position_m=place, moment_am2=vector(moment), seated=part.seated, source=part.source
    )


def _conductivity(air_c: float) -> float:
    """Return the conductivity of aluminum over that of the aircraft's file."""
    return 1.0 / (1.0 + ALUMINUM_PER_K * (air_c - REFERENCE_C))


def _coil(coil: Coil, air_c: float) -> Coil:
    key = "conductivity_spm" if coil.time_constant_s is None else "time_constant_s"
    return coil.model_copy(update={key: getattr(coil, key) * _conductivity(air_c)})


def _skin(skin: Skin, draws: Draws, day: int, air_c: float) -> Skin:
    parts = []
    for part in skin.parts:
        random = draws(f"day/{day}/skin/{part.name}")
        seams = tuple(seam * lognormal(random, DAY["seam"].size[0]) for seam in part.seams_ohm_m)
        update = {"conductivity_spm": part.conductivity_spm * _conductivity(air_c), "seams_ohm_m": seams}
        parts.append(part.model_copy(update=update))
    return skin.model_copy(update={"parts": tuple(parts)})

"""Individuals of a type: the same drawings, built with other sheets, wires and hands."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

import numpy as np
from pydantic import ValidationError

from magsim.aircraft import Vehicle
from magsim.aircraft.magnetics import Coil, Dipole, Feeder, FixedDipole, Magnetics, Mount, Skin, Steel
from magsim.aircraft.magnetics.feeders import LoopPath, PairPath, Path, TwistedPath
from magsim.errors import RequestError
from magsim.population.draws import Draws, box, direction, lognormal, normal, turned, vector
from magsim.population.spreads import INDIVIDUAL

V = TypeVar("V", bound=Vehicle)
D = TypeVar("D", bound=Dipole)

ATTEMPTS = 50
"""Most draws of an individual until one can be built."""


def individual_of(vehicle: V, number: int) -> V:
    """Return an individual of a type.

    Geometry of steel and skin is that of the type, so that its response follows from that of the type.

    Parameters
    ----------
    vehicle : Aircraft or Bird
        As its folder describes it.
    number : int
        0 is the type's own nominal vehicle.

    Raises
    ------
    RequestError
        If no individual can be built: parts of the file stand so close that their scatter brings them together.
    """
    if number == 0:
        return vehicle
    return built(vehicle, number, _magnetics)


def built(vehicle: V, number: int, draw: Callable[[Magnetics, Draws], Magnetics]) -> V:
    """Return a vehicle with drawn magnetics, drawn again as long as they break a rule of aircraft files."""
    text = ""
    for attempt in range(ATTEMPTS):
        drawn = draw(vehicle.magnetics, Draws(vehicle.name, number, attempt))
        try:
            magnetics = Magnetics.model_validate(drawn.model_dump(mode="json"))
        except ValidationError as error:
            text = error.errors(include_url=False)[0]["msg"]
            continue
        return replace(vehicle, magnetics=magnetics, nominal=vehicle.nominal or vehicle)
    msg = f"no individual {number} of {vehicle.name} can be built: {text}; allowed: parts farther apart"
    raise RequestError(msg)


def _magnetics(nominal: Magnetics, draws: Draws) -> Magnetics:
    most = int(INDIVIDUAL["seat"].size[0])
    notches = int(draws("seats").integers(-most, most, endpoint=True))
    return nominal.model_copy(
        update={
            "mounts": {name: _mount(mount, draws(f"mount/{name}")) for name, mount in nominal.mounts.items()},
            "permanent": tuple(_seated(_dipole(dipole, draws), notches) for dipole in nominal.permanent),
            "hinged": tuple(_dipole(dipole, draws) for dipole in nominal.hinged),
            "controls": tuple(_dipole(dipole, draws) for dipole in nominal.controls),
            "rotating": tuple(_dipole(dipole, draws) for dipole in nominal.rotating),
            "steel": tuple(_steel(part, draws(f"steel/{part.name}")) for part in nominal.steel),
            "coils": tuple(_coil(coil, draws(f"coil/{coil.name}")) for coil in nominal.coils),
            "skin": None if nominal.skin is None else _skin(nominal.skin, draws),
            "feeders": tuple(_feeder(feeder, draws) for feeder in nominal.feeders),
        }
    )


def _mount(mount: Mount, random: np.random.Generator) -> Mount:
    moved = np.array(mount.position_m) + box(random, INDIVIDUAL["mount"].size[0])
    return mount.model_copy(update={"position_m": vector(moved)})


def _dipole(dipole: D, draws: Draws) -> D:
    random, moment = draws(f"moment/{dipole.name}"), np.array(dipole.moment_am2)
    if dipole.kind == "machine":
        size, angle_deg = INDIVIDUAL["machine"].size
        moment = turned(random, moment * (1.0 + size * normal(random)), angle_deg)
    else:
        size = lognormal(random, INDIVIDUAL["fitting"].size[0]) * float(np.linalg.norm(moment))
        moment = size * direction(random)
    return dipole.model_copy(update={"moment_am2": vector(moment)})


def _seated(dipole: FixedDipole, notches: int) -> FixedDipole:
    if dipole.notch_m is None:
        return dipole
    moved = np.array(dipole.position_m) + notches * np.array(dipole.notch_m)
    return dipole.model_copy(update={"position_m": vector(moved)})


def _steel(part: Steel, random: np.random.Generator) -> Steel:
    update: dict[str, float] = {}
    update["mu_r"] = 1.0 + (part.mu_r - 1.0) * lognormal(random, INDIVIDUAL["susceptibility"].size[0])
    thickness = getattr(part, "thickness_m", None)
    if thickness is not None:
        update["thickness_m"] = thickness * _rolled(random)
    return part.model_copy(update=update)


def _rolled(random: np.random.Generator) -> float:
    """Return the thickness of a sheet over its nominal one."""
    return 1.0 + INDIVIDUAL["thickness"].size[0] * normal(random)


def _skin(skin: Skin, draws: Draws) -> Skin:
    median, sigma = INDIVIDUAL["seam"].size
    parts = []
    for part in skin.parts:
        random = draws(f"skin/{part.name}")
        thickness = part.thickness_m * _rolled(random)
        seams = part.seams_ohm_m or (median,) * len(part.seam_places_m)
        seams = tuple(seam * lognormal(random, sigma) for seam in seams)
        parts.append(part.model_copy(update={"thickness_m": thickness, "seams_ohm_m": seams}))
    return skin.model_copy(update={"parts": tuple(parts)})


def _coil(coil: Coil, random: np.random.Generator) -> Coil:
    """Return a loop with another sheet, and with the resistance of joints."""
    median, sigma = INDIVIDUAL["loop"].size
    factor = _rolled(random) / (1.0 + median * lognormal(random, sigma))
    key = "section_m2" if coil.time_constant_s is None else "time_constant_s"
    return coil.model_copy(update={key: getattr(coil, key) * factor})


def _feeder(feeder: Feeder, draws: Draws) -> Feeder:
    paths = [_path(path, draws(f"wire/{feeder.name}/{number}")) for number, path in enumerate(feeder.paths)]
    return feeder.model_copy(update={"paths": tuple(paths)})


def _path(path: Path, random: np.random.Generator) -> Path:
    reach, corners = INDIVIDUAL["wire"].size[0], np.array(path.vertices_m)
    update: dict[str, object] = {}
    if isinstance(path, LoopPath):
        # The way back through the chassis moves with the wire; what it encloses scatters with its share of the current.
        corners = corners + box(random, reach)
        spread = INDIVIDUAL["chassis"].size[0]
        update["share"] = path.share * (1.0 + float(random.uniform(-spread, spread)))
    else:
        corners = corners + np.stack([box(random, reach) for _ in corners])
    if isinstance(path, PairPath):
        update["offset_m"] = vector(_around(np.array(path.offset_m), corners[-1] - corners[0], random))
    elif isinstance(path, TwistedPath):
        update["pitch_m"] = path.pitch_m * lognormal(random, INDIVIDUAL["pitch"].size[0])
    update["vertices_m"] = tuple(vector(corner) for corner in corners)
    return path.model_copy(update=update)


def _around(offset: np.ndarray, line: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Return an offset turned by any angle about a line, (3,)."""
    axis, angle = line / np.linalg.norm(line), random.uniform(0.0, 2.0 * math.pi)
    along = axis * (axis @ offset)
    across = offset - along
    return along + math.cos(angle) * across + math.sin(angle) * np.cross(axis, across)

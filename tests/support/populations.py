"""How a drawn population scatters beside what it is stated to: probabilities of Kolmogorov and Smirnov."""

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.stats import chisquare, kstest, norm

from magsim.aircraft import Magnetics, Vehicle
from magsim.aircraft.magnetics import Dipole
from magsim.population import DAY, INDIVIDUAL, on_day


def dipoles(magnetics: Magnetics, kind: str | None = None) -> list[Dipole]:
    """Return all moments, or those of a kind."""
    every = [*magnetics.permanent, *magnetics.hinged, *magnetics.controls, *magnetics.rotating]
    return [dipole for dipole in every if kind in (None, dipole.kind)]


def pairs(nominal: Vehicle, fleet: Sequence[Vehicle], of: str, within: str = "") -> list[tuple]:
    """Return each part of each individual beside that of the type: ``of`` names a list of the magnetic file."""

    def parts(vehicle: Vehicle) -> Sequence:
        found = getattr(vehicle.magnetics, of)
        return getattr(found, within) if within else found

    return [pair for one in fleet for pair in zip(parts(one), parts(nominal), strict=True)]


def _even(values: np.ndarray, reach: float) -> float:
    return float(kstest(np.ravel(values) / (2.0 * reach) + 0.5, "uniform").pvalue)


def _normal(values: np.ndarray) -> float:
    return float(kstest(np.ravel(values), "norm").pvalue)


def _moments(nominal: Vehicle, fleet: Sequence[Vehicle], kind: str) -> tuple[np.ndarray, np.ndarray]:
    own = np.array([dipole.moment_am2 for one in fleet for dipole in dipoles(one.magnetics, kind)])
    of_type = np.array([dipole.moment_am2 for dipole in dipoles(nominal.magnetics, kind)])
    return own, np.tile(of_type, (len(fleet), 1))


def _of_moments(nominal: Vehicle, fleet: Sequence[Vehicle]) -> Iterator[tuple[str, float]]:
    own, of_type = _moments(nominal, fleet, "fitting")
    sizes = np.linalg.norm(own, axis=1)
    yield "fitting_size", _normal(np.log(sizes / np.linalg.norm(of_type, axis=1)) / INDIVIDUAL["fitting"].size[0])
    unit = own / sizes[:, None]
    yield "fitting_cosine", _even(unit[:, 2], 1.0)
    yield "fitting_azimuth", _even(np.arctan2(unit[:, 1], unit[:, 0]), np.pi)
    own, of_type = _moments(nominal, fleet, "machine")
    size, turn_deg = INDIVIDUAL["machine"].size
    yield "machine_size", _normal((np.linalg.norm(own, axis=1) / np.linalg.norm(of_type, axis=1) - 1.0) / size)
    turns = np.degrees(np.arctan2(np.linalg.norm(np.cross(own, of_type), axis=1), np.einsum("ni,ni->n", own, of_type)))
    yield "machine_angle", float(kstest(turns / turn_deg, lambda x: 2.0 * norm.cdf(x) - 1.0).pvalue)


def _of_metal(nominal: Vehicle, fleet: Sequence[Vehicle]) -> Iterator[tuple[str, float]]:
    steel, skin = pairs(nominal, fleet, "steel"), pairs(nominal, fleet, "skin", "parts")
    heats = np.log([(own.mu_r - 1.0) / (of_type.mu_r - 1.0) for own, of_type in steel])
    yield "susceptibility", _normal(heats / INDIVIDUAL["susceptibility"].size[0])
    sheets = [o.thickness_m / t.thickness_m for o, t in [*steel, *skin] if getattr(t, "thickness_m", None)]
    yield "thickness", _normal((np.array(sheets) - 1.0) / INDIVIDUAL["thickness"].size[0])
    median, sigma = INDIVIDUAL["seam"].size
    yield "seam", _normal(np.log(np.concatenate([own.seams_ohm_m for own, _ in skin]) / median) / sigma)


def _of_places(nominal: Vehicle, fleet: Sequence[Vehicle]) -> Iterator[tuple[str, float]]:
    moved = [np.array(one.mounts[name]) - place for one in fleet for name, place in nominal.mounts.items()]
    yield "mount", _even(np.array(moved), INDIVIDUAL["mount"].size[0])
    slid = [(o, t) for o, t in pairs(nominal, fleet, "permanent") if t.notch_m]
    steps = [round((o.position_m[0] - t.position_m[0]) / t.notch_m[0]) for o, t in slid]
    most = int(INDIVIDUAL["seat"].size[0])
    yield "seat", float(chisquare(np.bincount(np.array(steps) + most, minlength=2 * most + 1)).pvalue)


def _of_wires(nominal: Vehicle, fleet: Sequence[Vehicle]) -> Iterator[tuple[str, float]]:
    paths = [
        pair for own, of_type in pairs(nominal, fleet, "feeders") for pair in zip(own.paths, of_type.paths, strict=True)
    ]
    off = [np.array(own.vertices_m) - np.array(of_type.vertices_m) for own, of_type in paths]
    # a loop is moved as a whole
    moved = [row[:1] if own.kind == "loop" else row for row, (own, _) in zip(off, paths, strict=True)]
    yield "wire", _even(np.concatenate(moved), INDIVIDUAL["wire"].size[0])
    shares = [own.share / of_type.share - 1.0 for own, of_type in paths if own.kind == "loop"]
    yield "chassis", _even(np.array(shares), INDIVIDUAL["chassis"].size[0])
    pitches = [np.log(own.pitch_m / of_type.pitch_m) for own, of_type in paths if own.kind == "twisted"]
    yield "pitch", _normal(np.array(pitches) / INDIVIDUAL["pitch"].size[0])


def individual_p_values(nominal: Vehicle, fleet: Sequence[Vehicle]) -> dict[str, float]:
    """Return the probability of each quantity that scatters from individual to individual.

    Parameters
    ----------
    nominal : Vehicle
        A type with a skin, a seat and all kinds of wires.
    fleet : sequence of Vehicle
        Its individuals.
    """
    found = (_of_moments, _of_metal, _of_places, _of_wires)
    return dict(pair for of in found for pair in of(nominal, fleet))


def day_p_values(built: Vehicle, number: int, days: int) -> dict[str, float]:
    """Return the probability of remanence and joints from one day of an individual to the next."""
    fleet = [on_day(built, number, day, 20.0) for day in range(days + 1)]
    names = [dipole.name for dipole in dipoles(built.magnetics) if dipole.magnet is None]
    moments = np.array(
        [[{d.name: d.moment_am2 for d in dipoles(one.magnetics)}[name] for name in names] for one in fleet]
    )
    steps = np.linalg.norm(np.diff(moments, axis=0), axis=2) / np.linalg.norm(moments[0], axis=1)
    median, late = DAY["remanence"].size
    joints = [
        np.log(np.array(own.seams_ohm_m) / np.array(first.seams_ohm_m))
        for own, first in pairs(built, fleet[1:], "skin", "parts")
    ]
    return {
        "remanence_step": _normal(np.log(steps / median) / (np.log(late / median) / norm.ppf(0.95))),
        "joint_of_a_day": _normal(np.concatenate(joints) / DAY["seam"].size[0]),
    }

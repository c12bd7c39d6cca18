"""Levels of the field of an aircraft or a bird at each mount, as ``aircraft/<name>/README.md`` prints them.

Run ``python tests/benchmarks/aircraft_levels.py [NAME]``. Four level headings in the Earth's field of Ottawa; for a
bird also what its swing makes of them in the field of paper 002, for a helicopter the places where a bird hangs.
"""

import itertools
import sys

import numpy as np

from magsim import assets
from magsim.aircraft import Bird, KinematicFacts, Vehicle, load_aircraft, load_bird
from magsim.field import AircraftResponse, load_response
from magsim.field.response import response_at
from magsim.field.wiring.electronics import Clock, currents
from magsim.frames import rot_nb_from_attitude, rotate_back

EARTH_N = np.array([18193.0, -4077.0, 49954.0])
"""Ottawa, where the published levels come from: IGRF-14, middle of 2025, 300 m [nT]."""

EARTH_002_N = np.array([22271.0, -4694.0, 51893.0])
"""Where paper 002 flew: IGRF-14 at 48.7 N, 126.6 E, 1250 m, middle of 2020 [nT]; 56665 nT, inclination 66.3 degrees."""

SWING_DEG = (8.0, 6.0, 6.0)
"""Roll, pitch and yaw of a swinging bird, three standard deviations: a swing of 2.6 degrees, a vibration of 2."""

VIBRATION_DEG = 2.0
"""Standard deviation of pitch and of yaw of a bird that vibrates."""

BELOW_M = {"below the hook": (0.0, 0.0, 31.0), "trailing": (-6.0, 0.0, 30.0)}
"""Where a bird hangs on 30 m of rope: at rest, and at 25 m/s and more."""

HEADINGS = np.radians([0.0, 90.0, 180.0, 270.0])


def vehicle(name: str) -> Vehicle:
    """A shipped aircraft or bird."""
    return load_bird(name) if name in assets.list_birds() else load_aircraft(name)


def _digits(size: float) -> int:
    return 0 if size >= 100.0 else 1 if size >= 1.0 else 2


def lines(response: AircraftResponse) -> list[str]:
    """One line for each mount: permanent, induced, largest entries of D and E, change of the scalar reading."""
    attitude = np.stack([np.zeros(4), np.zeros(4), HEADINGS], axis=-1)
    ambient = rotate_back(rot_nb_from_attitude(attitude), EARTH_N)
    out = []
    for s, mount in enumerate(response.mounts):
        permanent = response.permanent_nt[s]
        induced = np.einsum("ij,nj->ni", response.induced[s], ambient)
        size = np.linalg.norm(induced, axis=1)
        scalar = np.linalg.norm(ambient + permanent + induced, axis=1) - np.linalg.norm(ambient, axis=1)
        strong = np.linalg.norm(permanent)
        digits = 0 if strong >= 10.0 else _digits(strong)
        small, few = _digits(size.max()), _digits(np.abs(scalar).max())
        slow = 1e3 * np.abs(response.eddy_slow_s[s]).max()
        out.append(
            f"| {mount} | {strong:.{digits}f} | {size.min():.{small}f} to {size.max():.{small}f} "
            f"| {np.abs(response.induced[s]).max():.1e} | {slow:.{2 if slow >= 0.005 else 4}f} "
            f"| {scalar.min():.{few}f} to {scalar.max():.{few}f} |"
        )
    return out


def steady_nt(body: Vehicle, response: AircraftResponse) -> np.ndarray:
    """Field that turns with the body at each mount, (s, 3) [nT]: permanent, and that of the mean currents."""
    # Loads without controls follow the clock and the seed: no flight is needed.
    clock = Clock(time_s=np.arange(0.0, 3600.0, 0.1), step_s=0.1, flight=None, seed=1)
    drawn = currents(body.magnetics.feeders, clock)
    mean = np.array([drawn[feeder.name].mean() for feeder in body.magnetics.feeders])
    return response.permanent_nt + response.wiring_nt_per_a @ mean


def scalar_change(steady_b: np.ndarray, induced: np.ndarray, attitude_deg: np.ndarray) -> np.ndarray:
    """Change of the scalar reading at attitudes (..., 3) [deg] in the field of paper 002, (...) [nT].

    Parameters
    ----------
    steady_b : (3,) [nT]
    induced : (3, 3)
    attitude_deg : (..., 3) [deg]
        Roll, pitch, heading.
    """
    ambient = rotate_back(rot_nb_from_attitude(np.radians(attitude_deg)), EARTH_002_N)
    whole = ambient + steady_b + np.einsum("ij,...j->...i", induced, ambient)
    return np.linalg.norm(whole, axis=-1) - np.linalg.norm(ambient, axis=-1)


def swing_nt(body: Vehicle, response: AircraftResponse) -> dict[str, tuple[float, float, float, float]]:
    """What headings and swings make of the scalar reading at each mount, in the field of paper 002 [nT].

    Peak to peak over four level headings; over a swing on all of them, every combination of roll, pitch and yaw within
    ``SWING_DEG``; over the swing on one of them, the mean of the four. Last, the standard deviation that
    ``VIBRATION_DEG`` makes in pitch and yaw, independent of each other, root of the mean square over the headings.
    """
    grid = np.array(list(itertools.product(np.linspace(-1.0, 1.0, 9), repeat=3))) * SWING_DEG
    step = np.eye(3)[1:]  # a degree of pitch, a degree of yaw
    out = {}
    for mount, steady, induced in zip(response.mounts, steady_nt(body, response), response.induced, strict=True):
        ahead = np.column_stack([np.zeros((4, 2)), np.degrees(HEADINGS)])
        level, swung = (scalar_change(steady, induced, ahead[:, None] + turns) for turns in (np.zeros((1, 3)), grid))
        up, down = (scalar_change(steady, induced, ahead[:, None] + sign * step) for sign in (0.5, -0.5))
        vibration = VIBRATION_DEG * np.sqrt(((up - down) ** 2).sum(axis=1).mean())
        out[mount] = (float(np.ptp(level)), float(np.ptp(swung)), float(np.ptp(swung, axis=1).mean()), float(vibration))
    return out


def swing_lines(body: Vehicle, response: AircraftResponse) -> list[str]:
    """One line for each mount of what ``swing_nt`` gives."""
    return [
        f"| {mount} | " + " | ".join(f"{value:.{_digits(value)}f}" for value in values) + " |"
        for mount, values in swing_nt(body, response).items()
    ]


if __name__ == "__main__":
    body = vehicle(sys.argv[1] if len(sys.argv) > 1 else "c208b")
    head = "| mount | permanent nT | induced nT | max D | max E ms | scalar nT |"
    response = load_response(body)
    tables = [[head, *lines(response)]]
    if isinstance(body.facts, KinematicFacts):
        tables.append([head.replace("mount", "place"), *lines(response_at(body, BELOW_M))])
    if isinstance(body, Bird):
        tables.append(["| mount | headings nT | with swings nT | one heading nT | vibration nT |"])
        tables[-1] += swing_lines(body, response)
    sys.stdout.write("\n\n".join("\n".join(table) for table in tables) + "\n")

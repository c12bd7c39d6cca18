"""Levels of an aircraft's field at each mount, as ``aircraft/<name>/README.md`` prints them.

Run ``python tests/benchmarks/aircraft_levels.py [AIRCRAFT]``. Four level headings in the Earth's field of Ottawa.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

from magsim.aircraft import load_aircraft
from magsim.field import AircraftResponse, load_response
from magsim.frames import rot_nb_from_attitude, rotate_back

EARTH_N = np.array([18193.0, -4077.0, 49954.0])
"""Ottawa, where the published levels come from: IGRF-14, middle of 2025, 300 m [nT]."""


def lines(response: AircraftResponse) -> list[str]:
    """One line for each mount: permanent, induced, largest entries of D and E, change of the scalar reading."""
    headings = np.radians([0.0, 90.0, 180.0, 270.0])
    attitude = np.stack([np.zeros(4), np.zeros(4), headings], axis=-1)
    ambient = rotate_back(rot_nb_from_attitude(attitude), EARTH_N)
    out = []
    for s, mount in enumerate(response.mounts):
        permanent = response.permanent_nt[s]
        induced = np.einsum("ij,nj->ni", response.induced[s], ambient)
        size = np.linalg.norm(induced, axis=1)
        scalar = np.linalg.norm(ambient + permanent + induced, axis=1) - np.linalg.norm(ambient, axis=1)
        strong = np.linalg.norm(permanent)
        digits = 0 if strong >= 10.0 else 1
        small = 0 if size.max() >= 100.0 else 1
        few = 0 if np.abs(scalar).max() >= 100.0 else 1
        out.append(
            f"| {mount} | {strong:.{digits}f} | {size.min():.{small}f} to {size.max():.{small}f} "
            f"| {np.abs(response.induced[s]).max():.1e} | {1e3 * np.abs(response.eddy_slow_s[s]).max():.2f} "
            f"| {scalar.min():.{few}f} to {scalar.max():.{few}f} |"
        )
    return out


if __name__ == "__main__":
    name = sys.argv[1] if len(sys.argv) > 1 else "c208b"
    sys.stdout.write("| mount | permanent nT | induced nT | max D | max E ms | scalar nT |\n")
    sys.stdout.write("\n".join(lines(load_response(load_aircraft(name)))) + "\n")

"""Modes of motion of an aircraft, as ``aircraft/<name>/README.md`` prints them.

Run ``python tests/benchmarks/aircraft_modes.py [AIRCRAFT]``. JSBSim linearizes the trimmed twin with direct thrust, the
autopilot off; the eigenvalues are those of the longitudinal and of the lateral states.
"""

import math
import sys

import jsbsim
import numpy as np

from magsim.aircraft import Facts, load_aircraft
from magsim.flight.model.setup import PlantSetup
from magsim.flight.model.trim import trimmed_twin

CONDITIONS = {"c208b": ((60.0, 300.0), (75.0, 3000.0), (90.0, 5000.0))}
"""True airspeed [m/s] and height [m]."""

HEAD = "| at | short period | Dutch roll | roll | phugoid | spiral |"


def modes(facts: Facts, speed_mps: float, alt_m: float) -> dict[str, complex]:
    """Eigenvalue [1/s] of each mode, of a pair the one with positive imaginary part."""
    linear = jsbsim.FGLinearization(trimmed_twin(facts, PlantSetup(0.0, 0.0, alt_m, 0.0, speed_mps)))
    names, matrix = list(linear.x_names), np.asarray(linear.system_matrix)

    def values(*states: str) -> list[complex]:
        index = [names.index(name) for name in states]
        return sorted((complex(v) for v in np.linalg.eigvals(matrix[np.ix_(index, index)])), key=abs)

    longitudinal = [v for v in values("Vt", "Alpha", "Theta", "Q") if v.imag >= 0.0]
    lateral = values("Beta", "Phi", "P", "R")
    real = [v for v in lateral if v.imag == 0.0]
    return {
        "short_period": longitudinal[-1],
        "phugoid": longitudinal[0],
        "dutch_roll": next(v for v in lateral if v.imag > 0.0),
        "roll": min(real, key=lambda v: v.real),
        "spiral": max(real, key=lambda v: v.real),
    }


def lines(facts: Facts, conditions: tuple[tuple[float, float], ...]) -> list[str]:
    """One line for each condition."""
    out = []
    for speed, alt in conditions:
        found = modes(facts, speed, alt)

        def pair(name: str, found: dict[str, complex] = found) -> str:
            return f"{abs(found[name]):.1f} rad/s, damping {-found[name].real / abs(found[name]):.2f}"

        phugoid, spiral = found["phugoid"], found["spiral"].real
        word = "converges" if spiral < 0.0 else "diverges"
        out.append(
            f"| {speed:.0f} m/s, {alt:.0f} m | {pair('short_period')} | {pair('dutch_roll')} "
            f"| {-1.0 / found['roll'].real:.2f} s | {2.0 * math.pi / phugoid.imag:.0f} s, damping "
            f"{-phugoid.real / abs(phugoid):.2f} | {word}, {abs(1.0 / spiral):.0f} s |"
        )
    return out


if __name__ == "__main__":
    name = sys.argv[1] if len(sys.argv) > 1 else "c208b"
    sys.stdout.write(HEAD + "\n")
    flown = CONDITIONS.get(name, ((sum(load_aircraft(name).limits.speed_mps) / 2.0, 300.0),))
    sys.stdout.write("\n".join(lines(load_aircraft(name).facts, flown)) + "\n")

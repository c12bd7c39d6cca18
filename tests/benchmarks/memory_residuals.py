"""What magnetic memory does to the calibration flight, as ``docs/memory.md`` prints it.

Run ``python tests/benchmarks/memory_residuals.py [--json]``. Cabin center; Tolles-Lawson with 16 terms is fitted on
circuit 1 and judged on circuit 2, in 0.1 to 0.6 Hz.
"""

import argparse

import numpy as np

from magsim.compensation import TollesLawson
from magsim.loading import load_scenario
from magsim.simulation import simulate
from tests.benchmarks.rows import Row, finish, stated
from tests.support import scores

WORLDS = {
    "without": ("field.memory.enabled=false",),
    "viscosity": ("field.memory.hysteresis=false",),
    "hysteresis": ("field.memory.viscosity=false",),
    "both": (),
}


def rows() -> list[Row]:
    """Raw in band, RMS of all interference, and what Tolles-Lawson leaves, world by world."""
    out = []
    for name, overrides in WORLDS.items():
        flight = simulate(load_scenario("calibration_c208b_calm", overrides))
        interference, judged = flight["interference_cabin_nt"], flight.where(circuit=2)
        method = TollesLawson(terms=16)
        method.fit([flight.where(circuit=1).labeled()], sensor="cabin")
        left = judged["interference_cabin_nt"] - method.interference(judged.blind())
        out += [
            stated(f"{name}_raw", scores.band_std(interference, flight.rate_hz), "nT"),
            stated(f"{name}_rms", np.sqrt(np.mean(interference**2)), "nT"),
            stated(f"{name}_tl16", scores.band_std(left, flight.rate_hz), "nT"),
        ]
    return out


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    finish(rows(), as_json=parser.parse_args().json)

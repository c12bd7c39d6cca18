"""How far the length of the sum of the recorded parts is from the recorded length: docs/recording.md."""

from magsim.loading import load_scenario
from magsim.simulation import simulate
from tests.benchmarks.rows import Row, at_most, stated
from tests.support.parts import length_of_parts

FLIGHTS = {
    "calibration_c208b_calm": "cabin",
    "calibration_c208b": "cabin",
    "gusty_c208b": "cabin",
    "papers/001_fom": "boom",
}


def rows() -> list[Row]:
    """Largest difference, the body rate there, and the difference in 0.1 to 0.6 Hz on legs, for each flight."""
    out = []
    for name, sensor in FLIGHTS.items():
        found, flight = length_of_parts(simulate(load_scenario(name)), sensor), name.rpartition("/")[2]
        out += [
            stated(f"length_of_parts_{flight}_nt", found.most_nt, "nT"),
            stated(f"length_of_parts_{flight}_turning_dps", found.turning_dps, "deg/s"),
            at_most(f"length_of_parts_{flight}_in_band_nt", found.band_nt, "nT", 0.002),
        ]
    return out

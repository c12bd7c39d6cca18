"""Fifty individuals on one flight: their interference, what Tolles-Lawson leaves, and what another's calibration does.

Circuit 2 in 0.1 to 0.6 Hz, with the noise of the magnetometer; the fit is on the labels of circuit 1.
"""

from collections import defaultdict

import numpy as np

from tests.benchmarks.rows import Row, at_least, stated
from tests.support import fleets

INDIVIDUALS = 50

LEAST_NT, LARGEST_NT = 0.3, 2.0
"""Figures of merit that surveys have; see docs/population.md."""


def _measured() -> dict[str, list[float]]:
    """Figures of each individual, by name."""
    found: dict[str, list[float]] = defaultdict(list)
    before = {sensor: fleets.calibrated(fleets.recording(INDIVIDUALS), sensor) for sensor in fleets.SENSORS}
    for number in range(1, INDIVIDUALS + 1):
        flown = fleets.recording(number)
        for sensor in fleets.SENSORS:
            method = fleets.calibrated(flown, sensor)
            own, other = (fleets.left(fitted, flown, sensor) for fitted in (method, before[sensor]))
            found[f"raw_band_std_{sensor}"].append(float(np.std(own.interference)))
            found[f"own_calibration_leaves_{sensor}"].append(fleets.score(own, "std_nt"))
            found[f"another_ones_calibration_leaves_{sensor}"].append(fleets.score(other, "std_nt"))
            found[f"fom_{sensor}"].append(fleets.score(own, "fom_nt"))
            before[sensor] = method
    return found


def rows() -> list[Row]:
    """5th, 50th and 95th percentile over the individuals."""
    found = _measured()
    out = []
    for name, values in found.items():
        low, middle, high = np.quantile(values, [0.05, 0.5, 0.95])
        out += [stated(f"{name}_p{p:02d}", value, "nT") for p, value in ((5, low), (50, middle), (95, high))]
    fom = np.array(found["fom_stinger"])
    share = float(np.mean((fom >= LEAST_NT) & (fom <= LARGEST_NT)))
    return [*out, at_least("fom_stinger_share_0.3_to_2_nt", share, "1", 0.9)]

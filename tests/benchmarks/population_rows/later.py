"""What a calibration costs one day and ten days later: twenty individuals, each fitted on one of its days.

Weather and load of a day are left out: all are on the same flight.
"""

from collections import defaultdict

import numpy as np

from tests.benchmarks.rows import Row, stated
from tests.support import fleets

INDIVIDUALS, DAY = 20, 5

LATER = {"same": 0, "1": 1, "10": 10}
"""Days after the calibration."""


def rows() -> list[Row]:
    """Median of what is left in band; how much more it is than on the same day, as a geometric mean and at most."""
    left: dict[tuple[str, str], list[float]] = defaultdict(list)
    for number in range(1, INDIVIDUALS + 1):
        flown = {name: fleets.recording(number, DAY + after) for name, after in LATER.items()}
        for sensor in fleets.SENSORS:
            method = fleets.calibrated(flown["same"], sensor)
            for name, recording in flown.items():
                left[sensor, name].append(fleets.score(fleets.left(method, recording, sensor), "std_nt"))
    out = []
    for (sensor, name), values in left.items():
        after = "same_day" if name == "same" else f"{name}_days_later"
        out.append(stated(f"{sensor}_leaves_{after}", float(np.median(values)), "nT"))
        if name != "same":
            ratio = np.array(values) / np.array(left[sensor, "same"])
            out.append(stated(f"{sensor}_costs_{after}", float(np.exp(np.mean(np.log(ratio)))), "1"))
            out.append(stated(f"{sensor}_costs_{after}_at_most", float(ratio.max()), "1"))
    return out

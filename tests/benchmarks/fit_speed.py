"""How long a Tolles-Lawson fit takes: beside the commit called "before", and beside the package deinterf.

    python tests/benchmarks/fit_speed.py [--json]

CPU time of one fit, from a recording to coefficients: 18 terms on the 4897 training rows of a calibration flight, read
from its file, with both states of the code, each in its own process, in turn; 16 terms on 6000 rows with deinterf in
this process, in turn. Of each process the least of 40 fits counts, since whatever else the machine does only adds;
then medians of 5. Both packages are fitted to the reading, and what they leave of it in band must agree.
"""

import argparse
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from deinterf.compensator.tmi.linear import Terms
from deinterf.compensator.tmi.linear import TollesLawson as Deinterf
from deinterf.foundation.sensors import MagVector, Tmi
from deinterf.utils.data_ioc import DataIoC

import magsim
from magsim import columns
from magsim.recording import Recording
from magsim.threads import one_blas_thread
from tests.benchmarks.rows import Row, at_least, at_most, finish, stated, within
from tests.support import before, scores
from tests.support.paths import ROOT
from tests.support.worlds import World, calibration

ROUNDS, FITS = 5, 40

TIME_FIT = """
import json, sys, time
from magsim.compensation import TollesLawson
from magsim.recording import Recording
recording, fits, old = Recording.read(sys.argv[1]), int(sys.argv[2]), sys.argv[3] == "before"
recording = recording.where(split="train").labeled()
def fit():
    method = TollesLawson(terms=18)
    return method.fit([recording], sensor="cabin") if old else method.fit(recording)
fit()
times = []
for _ in range(fits):
    start = time.process_time()
    fit()
    times.append(time.process_time() - start)
print(json.dumps(min(times)))
"""
"""Least CPU time of a fit [s], with either state of the code."""


def flight(rows: int) -> Recording:
    """Rows to learn from: a synthetic calibration flight without a split."""
    whole = calibration(World(eddy_tau_s=0.01)).take(slice(0, rows)).labeled()
    data = {name: column for name, column in whole.data.items() if name != columns.SPLIT.pattern}
    return Recording("flight", whole.time_s, data)


def before_rows() -> list[Row]:
    """Time the fit of both states in turn."""
    ratios, now_s = [], []
    with before.laid_out() as tree, tempfile.TemporaryDirectory() as folder:
        flown = Path(folder) / "flown"
        before.fly(tree, ["papers/000_simulated"], flown)  # the old code does not know the columns of new recordings
        path = flown / "papers__000_simulated.h5"
        for _ in range(ROUNDS):
            old = before.run(tree, TIME_FIT, [path, FITS, "before"])
            new = before.run(ROOT, TIME_FIT, [path, FITS, "now"])
            ratios.append(new / old)
            now_s.append(new)
    return [
        stated("tl18_fit_ms", 1e3 * statistics.median(now_s), "ms"),
        at_most("tl18_fit_over_before", statistics.median(ratios), "1", 0.5),
    ]


def cpu_s(work: Callable[[], object], count: int) -> float:
    """Least CPU time of some calls [s]."""
    times = []
    for _ in range(count):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return min(times)


def deinterf_rows() -> list[Row]:
    """Time the fit of both packages in turn, and compare what they leave of the reading."""
    recording = flight(6000)
    reading, flux = recording["mag_cabin_nt"], recording.vector(columns.FLUX, sensor="cabin")

    def ours() -> magsim.TollesLawson:
        return magsim.TollesLawson(terms=16, target="measured", scale="sample").fit(recording)

    def theirs() -> np.ndarray:
        data = DataIoC().with_data(MagVector(bx=flux[:, 0], by=flux[:, 1], bz=flux[:, 2]))
        return Deinterf(terms=Terms.Terms_16).fit(data, Tmi(tmi=reading))

    data = DataIoC().with_data(MagVector(bx=flux[:, 0], by=flux[:, 1], bz=flux[:, 2]))
    left = scores.band_std(reading - np.asarray(theirs().predict(data)).ravel(), recording.rate_hz)
    own = scores.band_std(reading - ours().interference(recording), recording.rate_hz)
    with one_blas_thread():
        pairs = [(cpu_s(ours, FITS), cpu_s(theirs, 3)) for _ in range(ROUNDS)]
    return [
        stated("tl16_fit_ms", 1e3 * statistics.median(pair[0] for pair in pairs), "ms"),
        stated("tl16_deinterf_fit_ms", 1e3 * statistics.median(pair[1] for pair in pairs), "ms"),
        at_least("tl16_ratio_to_deinterf", statistics.median(b / a for a, b in pairs), "1", 40.0),
        stated("residual_of_the_reading_nt", own, "nT"),
        within("residual_over_deinterf", own / left, "1", 0.99, 1.01),
    ]


def main() -> None:
    """Measure both comparisons."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    arguments = parser.parse_args()
    finish([*before_rows(), *deinterf_rows()], as_json=arguments.json)


if __name__ == "__main__":
    main()

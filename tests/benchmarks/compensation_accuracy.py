"""How hard the simulated worlds are for Tolles-Lawson and MagTCN, against truth.

Run ``python tests/benchmarks/compensation_accuracy.py [--json] [--seeds N] [--preset NAME] [--without-networks]``.
Three worlds: the shipped calibration flight, the simulated world of paper 000, and a world whose physics is linear in
the Tolles-Lawson terms.
"""

import argparse
import statistics
import sys

import numpy as np

from magsim import columns, signals
from magsim.compensation import FitContext, TollesLawson, create
from magsim.compensation.columns.tolles_lawson import EDDY_16, INDUCED_16
from magsim.compensation.solvers import ridge
from magsim.field import compute_field
from magsim.flight import fly
from magsim.loading import load_scenario
from magsim.recording import Recording
from magsim.signals import in_band
from magsim.simulation import record, simulate
from magsim.trajectory import Flight
from magsim.truth import FieldTruth
from tests.benchmarks.rows import Row, at_least, at_most, finish, within
from tests.support import scores

PAPER_TL_NT = 0.037
"""STD after Tolles-Lawson in 0.1 to 0.6 Hz on the simulated data set (paper 000, table 2)."""

LINEAR_WORLD = (
    "field.eddy.lag=false",
    "sensors.scalar[0].noise_nt_rthz=0.0",
    "sensors.fluxgate[0].noise_nt_rthz=0.0",
)

CEILING = ('sensors.scalar=[{name="ceiling",mount="sgl_mag_5"}]',)
"""The calibration flight with a magnetometer under the rear ceiling."""


def error_std(recording: Recording, estimate: np.ndarray) -> float:
    """In-band STD [nT] of the error against truth on a test recording."""
    sensor = recording.scalars[0]
    interference = recording[columns.MAG.name(sensor=sensor)] - recording[columns.CLEAN.name(sensor=sensor)]
    return scores.band_std(interference - estimate, recording.rate_hz)


def fitted(recording: Recording, method: object, seed: int = 0) -> object:
    """The method, fitted on the training circuit."""
    return method.fit(recording, context=FitContext(seed))


def linear_columns(cosines: np.ndarray, rates: np.ndarray, strength: np.ndarray) -> np.ndarray:
    """The 16 Tolles-Lawson columns from true direction cosines."""
    parts = [cosines]
    parts += [(strength * cosines[:, i] * cosines[:, j])[:, None] for i, j in INDUCED_16]
    parts += [(strength * cosines[:, i] * rates[:, j])[:, None] for i, j in EDDY_16]
    return np.hstack(parts)


def linear_world() -> tuple[Flight, FieldTruth, Recording]:
    """Flight, field and recording of a world that Tolles-Lawson can express."""
    loaded = load_scenario("papers/000_simulated", overrides=LINEAR_WORLD)
    flight = fly(loaded.scenario, loaded.aircraft)
    truth = compute_field(loaded.scenario, loaded.aircraft, flight)
    return flight, truth, record(loaded, flight, {"carrier": truth})


def linear_residuals(truth: FieldTruth, recording: Recording) -> dict[str, float]:
    """In-band STD [nT] that Tolles-Lawson leaves of the projection label on circuit 2, by way of differentiation."""
    sensor = recording.scalars[0]
    label = recording[columns.PROJECTION.name(sensor=sensor)]
    earth = recording.vector(columns.PART, component="earth", sensor=sensor)
    strength = np.linalg.norm(earth, axis=1)
    cosines = earth / strength[:, None]
    fast = truth.part("earth", truth.mounts[0])
    fast_cosines = fast / np.linalg.norm(fast, axis=1, keepdims=True)
    decimator = signals.Decimator(round(truth.rate_hz), round(recording.rate_hz))
    first = round(-truth.time_s[0] * truth.rate_hz)
    rates = {
        "central": signals.derivative(cosines, recording.rate_hz),
        "spline": signals.spline_derivative(cosines, recording.rate_hz),
        "simulation": decimator(signals.derivative(fast_cosines, truth.rate_hz), first, len(recording)),
    }
    train, test = recording["circuit"] == 1, recording["circuit"] == 2
    out = {}
    for name, rate in rates.items():
        matrix = linear_columns(cosines, rate, strength)
        table = np.column_stack([matrix, label])
        rows = in_band(table[train], recording.time_s[train])
        fit = ridge(rows[:, :-1], rows[:, -1])
        error = label[test] - matrix[test] @ fit.coefficients
        out[name] = scores.band_std(error, recording.rate_hz)
    return out


def simulated_rows(seeds: int, preset: str) -> list[Row]:
    """Figures of the shipped flight and of paper 000's world; without seeds, Tolles-Lawson alone."""
    raw = simulate(load_scenario("calibration_c208b_calm"))
    sensor = raw.scalars[0]
    raw_std = scores.band_std(raw[columns.INTERFERENCE.name(sensor=sensor)], raw.rate_hz)
    rows = [within("raw_in_band_std", raw_std, "nT", 10.0, 25.0)]
    ceiling = simulate(load_scenario("calibration_c208b_calm", CEILING))
    ceiling_std = scores.band_std(ceiling[columns.INTERFERENCE.name(sensor="ceiling")], ceiling.rate_hz)
    rows.append(within("rear_ceiling_in_band_std", ceiling_std, "nT", 8.0, 25.0))
    paper = simulate(load_scenario("papers/000_simulated"))
    test = paper.where(split="test")
    tl_std = error_std(test, fitted(paper, TollesLawson(terms=16)).interference(test.blind()))
    rows.append(within("paper_world_tl16_std", tl_std, "nT", PAPER_TL_NT / 5.0, PAPER_TL_NT * 5.0))
    if seeds:
        ratios = []
        for seed in range(seeds):
            network = fitted(paper, create("magtcn", preset=preset), seed)
            ratios.append(tl_std / error_std(test, network.interference(test.blind())))
            sys.stderr.write(f"magtcn seed {seed}: {ratios[-1]:.3f} times the improvement ratio of tl16\n")
        rows.append(at_least("paper_world_magtcn_ir_over_tl16", statistics.median(ratios), "1", 0.9))
    return rows


def main() -> None:
    """Simulate the worlds, fit on circuit 1, judge on circuit 2."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else on stdout")
    parser.add_argument("--seeds", type=int, default=3, help="networks to train; their median counts")
    parser.add_argument("--preset", default="quick", help="preset of MagTCN")
    parser.add_argument("--without-networks", action="store_true")
    arguments = parser.parse_args()
    rows = simulated_rows(0 if arguments.without_networks else arguments.seeds, arguments.preset)
    _, truth, recording = linear_world()
    goals = {"simulation": 0.002, "spline": 0.002, "central": 0.02}
    residuals = linear_residuals(truth, recording)
    rows += [at_most(f"linear_world_{name}_std", residuals[name], "nT", goal) for name, goal in goals.items()]
    finish(rows, as_json=arguments.json)


if __name__ == "__main__":
    main()

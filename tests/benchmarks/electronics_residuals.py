"""What currents leave after Tolles-Lawson: the table of docs/electronics.md, and the drone of paper 001.

Run ``python tests/benchmarks/electronics_residuals.py [--json]``. In-band STD against truth; 16 terms, fitted on
circuit 1 by the fluxgate and judged on circuit 2, for the drone on one flight and on another one.
"""

import argparse

from magsim import columns
from magsim.compensation import TollesLawson
from magsim.loading import load_scenario
from magsim.recording import Recording
from magsim.simulation import simulate
from tests.benchmarks.rows import Row, finish, stated, within
from tests.support import scores

CALIBRATION = {"off": "false", "on": "true"}
STILL = ("air.turbulence_mps=0.0",)
OTHER_FLIGHT = ("seed=2", "recording.train_circuits=[]")


def fitted(recording: Recording, sensor: str) -> TollesLawson:
    """16 terms, fitted on the training circuit."""
    return TollesLawson(terms=16).fit(recording, sensor=sensor)


def left(recording: Recording, method: TollesLawson, sensor: str) -> tuple[float, float]:
    """In-band STD [nT] of the interference on a recording, before and after compensation."""
    interference = recording[columns.MAG.name(sensor=sensor)] - recording[columns.CLEAN.name(sensor=sensor)]
    error = interference - method.interference(recording)
    return scores.band_std(interference, recording.rate_hz), scores.band_std(error, recording.rate_hz)


def carrier_rows() -> list[Row]:
    """The Cessna with its electronics off and on, and with moving flaps."""
    flights = {f"calibration_{name}": ("calibration_c208b_calm", value) for name, value in CALIBRATION.items()}
    flights["flaps"] = ("electronics_c208b", "true")
    rows = []
    for name, (scenario, enabled) in flights.items():
        recording = simulate(load_scenario(scenario, [f"field.electronics.enabled={enabled}", *STILL]))
        test = recording.where(split="test")
        for sensor in recording.scalars:
            raw, rest = left(test, fitted(recording, sensor), sensor)
            rows += [stated(f"{name}_{sensor}_raw", raw, "nT"), stated(f"{name}_{sensor}_tl16", rest, "nT")]
    return rows


def drone_rows() -> list[Row]:
    """The flights of paper 001: raw 2.11 to 2.33 nT there; goals of the issue."""
    one = simulate(load_scenario("papers/001_fom"))
    other = simulate(load_scenario("papers/001_fom", OTHER_FLIGHT))
    method = fitted(one, "boom")
    (raw, fit), (raw_other, test) = left(one, method, "boom"), left(other, method, "boom")
    return [
        within("uav_raw", raw, "nT", 2.0, 2.5),
        within("uav_raw_other_flight", raw_other, "nT", 2.0, 2.5),
        stated("uav_tl16", fit, "nT"),
        stated("uav_tl16_other_flight", test, "nT"),
        within("uav_tl16_ir", raw / fit, "1", 5.0, 9.0),
        within("uav_tl16_ir_other_flight", raw_other / test, "1", 5.0, 9.0),
    ]


def main() -> None:
    """Simulate, fit, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    arguments = parser.parse_args()
    finish(carrier_rows() + drone_rows(), as_json=arguments.json)


if __name__ == "__main__":
    main()

"""How closely a scenario's geometry and maneuvers are flown.

Run ``python tests/benchmarks/flight_accuracy.py [--json] [--scenario NAME]``.
"""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

from magsim.earth import wgs84
from magsim.flight import fly
from magsim.scenario import load_scenario
from magsim.trajectory import Flight
from tests.benchmarks.rows import Row, at_most, finish


def closures_m(flight: Flight, circuits: int) -> list[float]:
    """Distance between the first and the last point of each circuit."""
    out = []
    for circuit in range(1, circuits + 1):
        segments = [segment for segment in flight.segments if segment.circuit == circuit]
        ends = flight.carrier.at(np.array([segments[0].start_s, min(segments[-1].stop_s, flight.duration_s)]))
        points = wgs84.ecef_from_geodetic(ends.lat_rad, ends.lon_rad, np.full(2, ends.alt_m.mean()))
        out.append(float(np.linalg.norm(points[1] - points[0])))
    return out


def main() -> None:
    """Fly and hold the flight against what was asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    parser.add_argument("--scenario", default="calibration_c208b")
    arguments = parser.parse_args()

    loaded = load_scenario(arguments.scenario)
    flight = fly(loaded.scenario, loaded.aircraft)
    legs = [segment.length_m for segment in flight.segments if not segment.turn]
    wrong_leg = max(abs(length - loaded.scenario.pattern.leg_m) for length in legs)
    rows: list[Row] = [at_most("leg_length_error_m", wrong_leg, "m", 100.0)]
    if loaded.scenario.pattern.kind == "box":
        closures = closures_m(flight, loaded.scenario.pattern.circuits)
        rows.append(at_most("closure_m", max(closures), "m", 100.0))
    else:
        rows.append(at_most("center_miss_m", max(flight.notes["center_miss_m"]), "m", 100.0))
    for axis in ("pitch", "roll", "yaw"):
        trains = [maneuver for maneuver in flight.maneuvers if maneuver.axis == axis]
        if trains:
            worst = max(abs(maneuver.flown_deg - maneuver.asked_deg) for maneuver in trains)
            rows.append(at_most(f"{axis}_amplitude_error_deg", worst, "deg", 0.5))
    table = np.column_stack([flight.carrier.attitude, flight.carrier.velocity_n, flight.carrier.alt_m])
    rows.append(at_most("non_finite_rows", float(np.sum(~np.isfinite(table).all(axis=1))), "rows", 0.0))
    finish(rows, as_json=arguments.json)


if __name__ == "__main__":
    main()

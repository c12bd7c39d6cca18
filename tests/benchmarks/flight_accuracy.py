"""How closely a scenario's geometry and maneuvers are flown, and the amplitudes and passes that the issue asks for.

Run ``python tests/benchmarks/flight_accuracy.py [--json] [--scenario NAME]``. With a scenario of one's own only that
one is flown.
"""

import argparse
from collections.abc import Iterator, Sequence

import numpy as np
from pydantic import ValidationError

from magsim.aircraft import load_aircraft
from magsim.earth import wgs84
from magsim.flight import fly
from magsim.loading import load_scenario
from magsim.scenario import PatternSequence, Scenario, Square
from magsim.trajectory import Flight, ManeuverFlown
from tests.benchmarks.rows import Row, at_least, at_most, finish


def closures_m(flight: Flight, circuits: int) -> list[float]:
    """Distance between the first and the last point of each circuit."""
    out = []
    for circuit in range(1, circuits + 1):
        segments = [segment for segment in flight.segments if segment.circuit == circuit]
        ends = flight.carrier.at(np.array([segments[0].start_s, min(segments[-1].stop_s, flight.duration_s)]))
        points = wgs84.ecef_from_geodetic(ends.lat_rad, ends.lon_rad, np.full(2, ends.alt_m.mean()))
        out.append(float(np.linalg.norm(points[1] - points[0])))
    return out


AMPLITUDES_DEG = (5.0, 10.0, 15.0)
PERIOD_S = 5.0
AXES = ("pitch", "roll", "yaw")
ANGLES = {"roll": 0, "pitch": 1, "yaw": 2}
SHIPPED = "calibration_c208b_calm"
USUAL = {"c208b": (75.0, 3000.0), "uav": (25.0, 100.0)}
"""Speed [m/s] and height [m] of each aircraft."""

TRAIN_S, COMBINED_S, SPARE_S = 26.0, 50.0, 20.0
"""Time on a leg for a train of three cycles of 5 s, for a combined maneuver, and before and after them."""

Trains = tuple[tuple[str, float, float], ...]
COMBINED: dict[str, Trains] = {
    "pitch_roll": (("pitch", 5.0, 8.0), ("roll", 8.0, 6.0)),
    "roll_yaw": (("roll", 8.0, 6.0), ("yaw", 4.0, 6.0)),
    "roll_yaw_two_periods": (("roll", 8.0, 6.0), ("yaw", 4.0, 8.0)),
    "all_axes": (("pitch", 5.0, 5.0), ("roll", 8.0, 5.0), ("yaw", 4.0, 5.0)),
    "all_axes_three_periods": (("pitch", 5.0, 8.0), ("roll", 8.0, 6.0), ("yaw", 4.0, 7.0)),
}
"""Axis, amplitude [deg] and period [s] of simultaneous trains, each a sixth of a period after the one before."""


def calm_flight(trains: list[dict], aircraft: str, leg_s: float) -> Flight:
    """Fly a box in calm air with the same maneuvers on the four headings."""
    craft = load_aircraft(aircraft)
    speed, alt = USUAL[aircraft]
    leg_m = leg_s * speed
    start = {"lat_deg": 16.72, "lon_deg": 112.729, "alt_m": alt, "speed_mps": speed}
    scenario = {
        "schema": 1,
        "seed": 1,
        "aircraft": aircraft,
        "start": start,
        "pattern": {"kind": "box", "leg_m": leg_m, "allow_beyond_crew_g": True, "maneuvers": trains},
        "sensors": {"scalar": [{"name": "cabin", "mount": next(iter(craft.mounts))}]},
    }
    return fly(Scenario.model_validate(scenario, context={"aircraft": craft}), craft)


def amplitude_flight(aircraft: str) -> Flight:
    """Fly each amplitude in 5 s on every axis whose limit allows it."""
    limits = load_aircraft(aircraft).limits.amplitude_deg
    pairs = [(axis, amplitude) for amplitude in AMPLITUDES_DEG for axis in AXES if amplitude <= limits[axis]]
    trains = [{"axis": axis, "amplitude_deg": amplitude, "period_s": PERIOD_S} for axis, amplitude in pairs]
    return calm_flight(trains, aircraft, 2.0 * SPARE_S + len(trains) * TRAIN_S)


def combined_flight(names: Sequence[str], aircraft: str, cycles: int = 4) -> Flight:
    """Fly combined maneuvers one after the other on each leg."""
    trains = [
        {
            "axis": "combined",
            "cycles": cycles,
            "swings": [
                {"axis": axis, "amplitude_deg": amplitude, "period_s": period, "phase_deg": 60.0 * i}
                for i, (axis, amplitude, period) in enumerate(COMBINED[name])
            ],
        }
        for name in names
    ]
    return calm_flight(trains, aircraft, 2.0 * SPARE_S + len(trains) * COMBINED_S)


def combined_maneuvers(flight: Flight, names: Sequence[str]) -> dict[str, list[ManeuverFlown]]:
    """Sort the flown maneuvers of ``combined_flight`` by name: on each leg they follow in order."""
    axes = [name for name in names for _ in COMBINED[name]]
    out: dict[str, list[ManeuverFlown]] = {name: [] for name in names}
    for leg in range(1, 5):
        own = [maneuver for maneuver in flight.maneuvers if maneuver.leg == leg]
        # Those of one combined maneuver overlap and come together.
        for name, maneuver in zip(axes, own, strict=True):
            out[name].append(maneuver)
    return out


def is_refused(axis: str, amplitude_deg: float, aircraft: str) -> bool:
    """Whether an amplitude beyond an aircraft's limits is refused before it is flown, with what is allowed."""
    limit = load_aircraft(aircraft).limits.amplitude_deg[axis]
    try:
        calm_flight([{"axis": axis, "amplitude_deg": amplitude_deg, "period_s": PERIOD_S}], aircraft, 100.0)
    except ValidationError as error:
        return f"allowed: above 0, up to {limit:g}" in str(error)
    return False


def half_peak_errors_deg(
    flight: Flight, maneuvers: Sequence[ManeuverFlown] | None = None
) -> dict[tuple[str, float], float]:
    """Return the worst difference of half the peak to peak from the command, for each axis and amplitude.

    Taken from the attitude of the 10 Hz rows in the middle cycles: all but the first and the last.
    """
    rows = np.arange(round(flight.duration_s * 10.0) + 1) / 10.0
    attitude = flight.carrier.at(rows).attitude
    out: dict[tuple[str, float], float] = {}
    for maneuver in flight.maneuvers if maneuvers is None else maneuvers:
        begin, end = maneuver.start_s + maneuver.period_s, maneuver.stop_s - maneuver.period_s
        angle = attitude[(rows >= begin - 1e-9) & (rows <= end + 1e-9), ANGLES[maneuver.axis]]
        error = abs(0.5 * float(np.degrees(np.ptp(angle))) - maneuver.asked_deg)
        key = maneuver.axis, maneuver.asked_deg
        out[key] = max(error, out.get(key, 0.0))
    return out


def leg_error_m(flight: Flight) -> float:
    """Return the worst difference of a leg's length over ground from its plan."""
    return float(flight.notes["worst_leg_length_error_m"])


def amplitude_rows(aircraft: str) -> Iterator[Row]:
    """Amplitudes of 5, 10 and 15 degrees at 5 s on all headings, their legs, and the refusal of larger ones."""
    before = "" if aircraft == "c208b" else f"{aircraft}_"
    flight = amplitude_flight(aircraft)
    errors = half_peak_errors_deg(flight)
    for amplitude in AMPLITUDES_DEG:
        for axis in AXES:
            if (axis, amplitude) in errors:
                error = errors[axis, amplitude]
                yield at_most(f"{before}{axis}_half_peak_error_at_{amplitude:g}_deg", error, "deg", 0.2)
            else:
                refused = float(is_refused(axis, amplitude, aircraft))
                yield at_least(f"{before}{axis}_at_{amplitude:g}_deg_is_refused", refused, "1", 1.0)
    yield at_most(f"{before}box_leg_error_m", leg_error_m(flight), "m", 50.0)


def combined_rows(aircraft: str) -> Iterator[Row]:
    """Combined maneuvers: the worst axis on all headings."""
    flight = combined_flight(tuple(COMBINED), aircraft)
    for name, maneuvers in combined_maneuvers(flight, tuple(COMBINED)).items():
        errors = half_peak_errors_deg(flight, maneuvers)
        yield at_most(f"{aircraft}_combined_{name}_half_peak_error", max(errors.values()), "deg", 0.2)


def center_rows() -> Iterator[Row]:
    """Passes of the shipped cloverleaf in 10 m/s of wind."""
    loaded = load_scenario("patterns/cloverleaf")
    passes = fly(loaded.scenario, loaded.aircraft).notes["center_passes"]
    yield at_most("cloverleaf_miss_in_wind_m", max(entry["miss_m"] for entry in passes), "m", 25.0)
    worst = max(abs(entry["height_error_m"]) for entry in passes)
    yield at_most("cloverleaf_center_height_error_m", worst, "m", 3.0)


def main() -> None:
    """Fly and compare the flight with its plan."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    parser.add_argument("--scenario", default=SHIPPED)
    arguments = parser.parse_args()

    loaded = load_scenario(arguments.scenario)
    flight = fly(loaded.scenario, loaded.aircraft)
    pattern = loaded.scenario.pattern
    if isinstance(pattern, PatternSequence):
        rows: list[Row] = [at_most("leg_length_error_m", flight.notes["worst_leg_length_error_m"], "m", 50.0)]
    else:
        rows = [at_most("leg_length_error_m", leg_error_m(flight), "m", 50.0)]
    if isinstance(pattern, Square):
        closures = closures_m(flight, pattern.circuits)
        rows.append(at_most("closure_m", max(closures), "m", 100.0))
    if "center_miss_m" in flight.notes:
        rows.append(at_most("center_miss_m", max(flight.notes["center_miss_m"]), "m", 25.0))
    for axis in ("pitch", "roll", "yaw"):
        trains = [maneuver for maneuver in flight.maneuvers if maneuver.axis == axis]
        if trains:
            worst = max(abs(maneuver.flown_deg - maneuver.asked_deg) for maneuver in trains)
            rows.append(at_most(f"{axis}_amplitude_error_deg", worst, "deg", 0.5))
    table = np.column_stack([flight.carrier.attitude, flight.carrier.velocity_n, flight.carrier.alt_m])
    rows.append(at_most("non_finite_rows", float(np.sum(~np.isfinite(table).all(axis=1))), "rows", 0.0))
    if arguments.scenario == SHIPPED:
        for aircraft in USUAL:
            rows += [*amplitude_rows(aircraft), *combined_rows(aircraft)]
        rows += [*center_rows()]
    finish(rows, as_json=arguments.json)


if __name__ == "__main__":
    main()

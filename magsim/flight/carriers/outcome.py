"""The flown segments with their times, and the deviations from the pattern."""

import math
from collections.abc import Sequence

import numpy as np

from magsim.errors import DataError
from magsim.flight.carriers.planning import legs_of
from magsim.flight.path.elements import Element
from magsim.flight.path.plane import LocalPlane
from magsim.flight.pilot.guidance import Crossing
from magsim.flight.pilot.trains import SineTrain
from magsim.scenario import LegPattern, Scenario, Square, parts_of
from magsim.terrain import Ground
from magsim.trajectory import Flight, ManeuverFlown, Segment, Trajectory

OFF_PLAN_M = 80.0
"""A leg that is flown farther from its planned height was not held."""


def drape_notes(
    planned: Sequence[tuple[float, float]],
    zero_s: float,
    segments: Sequence[Segment],
    carrier: Trajectory,
    *,
    ground: Ground | None,
    parts: Sequence[LegPattern],
) -> dict[str, object]:
    """Measure the errors from planned heights on the legs, and heights above the ground on draped lines.

    Parameters
    ----------
    planned : sequence of (float, float)
        Time on the plant's clock [s] and planned height [m].
    zero_s : float
        Row 0 on that clock.
    segments : sequence of Segment
    carrier : Trajectory
    ground : Ground, optional
    parts : sequence of LegPattern

    Raises
    ------
    DataError
        If a leg was flown far from its plan.
    """
    if not planned:
        return {}
    time, height = np.array(planned).T
    error = carrier.alt_m - np.interp(carrier.time_s, time - zero_s, height)
    legs, lines = _leg_rows(segments, parts, carrier)
    worst = int(np.argmax(np.where(legs, np.abs(error), 0.0)))
    if abs(error[worst]) > OFF_PLAN_M:
        msg = (
            f"the flight did not hold its planned height: {error[worst]:.0f} m off at t = "
            f"{carrier.time_s[worst]:.1f} s; allowed: up to {OFF_PLAN_M:g} (a smaller climb_slope, or less speed)"
        )
        raise DataError(msg)
    notes: dict[str, object] = {"height_worst_error_m": float(np.abs(error[legs]).max())}
    if ground is None or not lines.any():
        return notes
    error, above = error[lines], (carrier.alt_m - ground.height(carrier.lat_rad, carrier.lon_rad))[lines]
    return notes | {
        "drape_worst_error_m": float(np.max(np.abs(error))),
        "drape_rms_error_m": float(np.sqrt(np.mean(error**2))),
        "drape_lowest_above_ground_m": float(above.min()),
        "drape_mean_above_ground_m": float(above.mean()),
        "drape_highest_above_ground_m": float(above.max()),
    }


def _leg_rows(
    segments: Sequence[Segment], parts: Sequence[LegPattern], carrier: Trajectory
) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows of the log on legs, and those on draped lines."""
    draped = [part.height_m(0.0) is None for part in parts for _ in range(part.circuits)]
    legs, lines = np.zeros(len(carrier), dtype=bool), np.zeros(len(carrier), dtype=bool)
    for segment in segments:
        if not segment.turn:
            rows = (carrier.time_s >= segment.start_s) & (carrier.time_s <= segment.stop_s)
            legs |= rows
            if draped[segment.circuit - 1]:
                lines |= rows
    return legs, lines


def segments_of(
    crossings: Sequence[Crossing], path: Sequence[Element], zero_s: float, end_s: float, carrier: Trajectory
) -> tuple[Segment, ...]:
    """Return legs, turns and transits with the times at which they were entered; a turn is one segment."""
    times = [0.0, *(crossing.time_s - zero_s for crossing in crossings[1:]), end_s - zero_s]
    speed = np.hypot(carrier.velocity_n[:, 0], carrier.velocity_n[:, 1])
    flown = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(carrier.time_s))])
    out: list[Segment] = []
    for i, element in enumerate(path):
        label = element.label
        key = (label.circuit, label.leg, label.turn, label.transit)
        start = times[i]
        if out and (out[-1].circuit, out[-1].leg, out[-1].turn, out[-1].transit) == key:
            start = out.pop().start_s
        first, last = np.interp([start, times[i + 1]], carrier.time_s, flown)
        out.append(
            Segment(*label[:4], start_s=start, stop_s=times[i + 1], length_m=float(last - first), transit=label.transit)
        )
    return tuple(out)


def check_trains(trains: Sequence[SineTrain], segments: Sequence[Segment]) -> None:
    """Refuse a flight in which a leg ended before its trains."""
    ends = {(s.circuit, s.leg): s.stop_s for s in segments if not s.turn}
    for train in trains:
        late = train.stop_s - ends[train.circuit, train.leg]
        if late > 0.0:
            msg = (
                f"the {train.axis} maneuver of leg {train.leg}, circuit {train.circuit} was still flown {late:.1f} s "
                "after its leg had ended; allowed: shorter trains or longer legs"
            )
            raise DataError(msg)


def pattern_notes(
    scenario: Scenario,
    path: Sequence[Element],
    carrier: Trajectory,
    segments: Sequence[Segment],
    trains: Sequence[SineTrain],
) -> dict[str, object]:
    """Measure the deviations from the pattern: lengths of legs, closure of circuits, passes of the center."""
    start = scenario.start
    plane = LocalPlane(math.radians(start.lat_deg), math.radians(start.lon_deg), start.alt_m)
    notes: dict[str, object] = {"worst_leg_length_error_m": _worst_length(path, segments)}
    circuits, closures, passes = 0, [], []
    for part in parts_of(legs_of(scenario)):
        numbers = range(circuits + 1, circuits + part.circuits + 1)
        own = [segment for segment in segments if segment.circuit in numbers and not segment.transit]
        if isinstance(part, Square):
            closures += [_closure(carrier, plane, own, number) for number in numbers]
        if part.quiet_around_center_s is not None:
            for segment in own:
                if not segment.turn:
                    passes.append(_pass(carrier, plane, segment, part, part.alt_m or start.alt_m))
                    check_quiet(passes[-1], trains, part.quiet_around_center_s)
        circuits += part.circuits
    if closures:
        notes["closure_m"] = closures
    if passes:
        notes["center_miss_m"] = [entry["miss_m"] for entry in passes]
        notes["center_passes"] = passes
    return notes


def amplitude_notes(maneuvers: Sequence[ManeuverFlown]) -> dict[str, float]:
    """Return the worst amplitude error of each axis that was oscillated, of single cycles where they scatter."""
    return {
        f"worst_{axis}_amplitude_error_deg": max(
            abs(part.flown_deg - part.asked_deg) for m in maneuvers if m.axis == axis for part in m.middle or (m,)
        )
        for axis in dict.fromkeys(maneuver.axis for maneuver in maneuvers)
    }


def _place(carrier: Trajectory, plane: LocalPlane, time_s: float) -> np.ndarray:
    at = carrier.at(np.array([time_s]))
    return np.array(plane.place(float(at.lat_rad[0]), float(at.lon_rad[0])))


def _worst_length(path: Sequence[Element], segments: Sequence[Segment]) -> float:
    """Return the largest difference of a leg's length over ground from its plan [m]."""
    planned = {(element.circuit, element.leg): element.length_m for element in path if not element.turn}
    return max(abs(s.length_m - planned[s.circuit, s.leg]) for s in segments if not s.turn)


def _closure(carrier: Trajectory, plane: LocalPlane, segments: Sequence[Segment], circuit: int) -> float:
    """Return the distance between beginning and end of a circuit [m]."""
    own = [segment for segment in segments if segment.circuit == circuit]
    return float(np.hypot(*(_place(carrier, plane, own[-1].stop_s) - _place(carrier, plane, own[0].start_s))))


def _pass(
    carrier: Trajectory, plane: LocalPlane, segment: Segment, part: LegPattern, alt_m: float
) -> dict[str, float | int]:
    """Return when and how closely a leg passed the center of its pattern."""
    rows = np.flatnonzero((carrier.time_s >= segment.start_s) & (carrier.time_s <= segment.stop_s))
    places = np.array([plane.place(float(carrier.lat_rad[i]), float(carrier.lon_rad[i])) for i in rows])
    course = math.radians(segment.heading_deg)
    along = (places[:, 0] - part.north_m) * math.cos(course) + (places[:, 1] - part.east_m) * math.sin(course)
    time_s = float(np.interp(0.0, along, carrier.time_s[rows]))
    north, east = _place(carrier, plane, time_s)
    height = float(carrier.at(np.array([time_s])).alt_m[0])
    return {
        "circuit": segment.circuit,
        "leg": segment.leg,
        "heading_deg": segment.heading_deg,
        "time_s": time_s,
        "miss_m": float(math.hypot(north - part.north_m, east - part.east_m)),
        "height_error_m": height - alt_m,
    }


def check_quiet(entry: dict[str, float | int], trains: Sequence[SineTrain], quiet_s: float) -> None:
    """Refuse a flight with a maneuver around the center."""
    for train in trains:
        if (train.circuit, train.leg) != (entry["circuit"], entry["leg"]):
            continue
        before = entry["time_s"] - (train.stop_s + train.ease_out_s)
        after = train.start_s - train.ease_in_s - entry["time_s"]
        if max(before, after) < quiet_s:
            msg = (
                f"the {train.axis} maneuver of leg {train.leg}, circuit {train.circuit} was flown "
                f"{max(0.0, before, after):.1f} s from the center, less than pattern.quiet_s = {quiet_s:g}: the speed "
                "over ground differed from the expected one; allowed: less turbulence, shorter trains or longer legs"
            )
            raise DataError(msg)


def check_height(flight: Flight, ground: Ground | None) -> None:
    """Refuse a flight whose carrier or bird touches the ground; without terrain, the ellipsoid.

    Raises
    ------
    DataError
    """
    for name, path in (("carrier", flight.carrier), ("bird", flight.bird)):
        if path is None:
            continue
        below = 0.0 if ground is None else ground.height(path.lat_rad, path.lon_rad)
        low = path.alt_m <= below
        if low.any():
            row = int(low.argmax())
            msg = (
                f"the {name} touched the ground at t = {path.time_s[row]:.1f} s, {path.alt_m[row]:.0f} m above the "
                "ellipsoid; allowed: a flight above the ground, the rope's length included"
            )
            raise DataError(msg)

"""Every shipped pattern in calm air for any modeled aircraft, and what its joints and its maneuvers demand."""

import tomllib
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from magsim.aircraft import Aircraft, load_aircraft
from magsim.assets import scenario_path
from magsim.flight import fly
from magsim.frames import rot_nb_from_attitude
from magsim.planning import FlyableScenario
from magsim.scenario import Scenario
from magsim.trajectory import Flight

USUAL = {"c208b": (75.0, 3000.0), "uav": (25.0, 100.0)}
"""Speed [m/s] and height [m] of each aircraft."""

_KINDS = ("box", "cloverleaf", "diamond", "drape", "fom", "fom_peak_to_peak", "heading_cross", "sequence", "straight")
SHARED = tuple(f"patterns/{name}" for name in (*_KINDS, "survey"))
SHIPPED = {
    "c208b": (*SHARED, "calibration_c208b_cloverleaf", "crew_c208b", "electronics_c208b"),
    "uav": (*SHARED, "crew_c208b", "papers/001_fom"),
}
"""Scenarios by whose patterns an aircraft is flown; ``electronics_c208b`` is ``calibration_c208b`` with flaps."""

SCALED = ("leg_m", "leaf_m", "line_m", "spacing_m", "tie_spacing_m", "tie_overlap_m", "north_m", "east_m")
"""Lengths of a pattern, which go with the speed."""

STEP_HZ = 120
RATES = ("pitch_accel", "roll_accel", "yaw_accel", "elevator_rate", "aileron_rate", "rudder_rate")
AFTER_S = 3.0
"""Time after a pitch train in which height hold comes back."""

Demands = dict[str, float]


def _scaled(value: object, factor: float) -> object:
    if isinstance(value, dict):
        return {k: v * factor if k in SCALED else _scaled(v, factor) for k, v in value.items()}
    return [_scaled(v, factor) for v in value] if isinstance(value, list) else value


def calm(raw: dict, aircraft: str) -> tuple[Scenario, Aircraft]:
    """The pattern of a scenario in steady wind, for an aircraft at its usual speed, logged at every step."""
    craft, (speed, alt) = load_aircraft(aircraft), USUAL[aircraft]
    factor = 1.0 if raw["aircraft"] == aircraft else speed / raw["start"]["speed_mps"]
    start, pattern = dict(raw["start"]), _scaled(raw["pattern"], factor)
    if raw["aircraft"] != aircraft:
        draped = pattern.get("drape_m") is not None
        start |= {"speed_mps": speed} | ({} if draped else {"alt_m": alt})
        for part in pattern.get("parts", ()):
            # climbs stay as long as their transits
            if "alt_m" in part:
                part["alt_m"] = alt + factor * (part["alt_m"] - raw["start"]["alt_m"])
    for part in pattern.get("parts", [pattern]):
        part["allow_beyond_crew_g"] = True
    wind = {k: v * factor for k, v in raw.get("air", {}).items() if k in ("wind_north_mps", "wind_east_mps")}
    flaps = raw.get("flight", {}).get("flaps", []) if craft.facts.flap else []
    tables = {
        "schema": 1,
        "seed": 1,
        "aircraft": aircraft,
        "start": start,
        "pattern": pattern,
        "air": wind,
        "flight": {"log_hz": STEP_HZ, "flaps": flaps},
        "sensors": {"scalar": [{"name": "cabin", "mount": next(iter(craft.mounts))}]},
    }
    if "drape_m" in pattern:
        tables["terrain"] = raw["terrain"]
    return FlyableScenario.model_validate(tables, context={"aircraft": craft}), craft


def flown(raw: dict, aircraft: str) -> Flight:
    """Fly ``calm``."""
    return fly(*calm(raw, aircraft))


def shipped(name: str) -> dict:
    """The tables of a shipped scenario."""
    return tomllib.loads(scenario_path(name).read_text(encoding="utf-8"))


@dataclass(frozen=True)
class Joints:
    """What is demanded of an aircraft outside of maneuvers and inside, and its pitch rate outside.

    A maneuver reaches from the beginning of its rise to the end of its fall. ``where_s`` is the time of each largest
    demand outside. ``joint_power`` is that of the pitch rate [deg^2/s] on the legs outside of all maneuvers, in the
    three seconds after each pitch train, ``joint_s`` the time of these rows; ``power`` is all of it on the legs.
    """

    outside: Demands
    inside: Demands
    where_s: Demands
    joint_power: float
    joint_s: float
    power: float

    @classmethod
    def of(cls, flight: Flight) -> "Joints":
        """Measure a flight that is logged at every step."""
        time = flight.carrier.time_s
        demands = demands_of(flight)
        inside, joint, legs = (np.zeros(len(time), dtype=bool) for _ in range(3))
        for maneuver in flight.maneuvers:
            ended = maneuver.stop_s + maneuver.ease_out_s
            inside |= (time >= maneuver.start_s - maneuver.ease_in_s) & (time <= ended)
            if maneuver.axis == "pitch":
                joint |= (time > ended) & (time <= ended + AFTER_S)
        for segment in flight.segments:
            legs |= (time >= segment.start_s) & (time <= segment.stop_s) & (not segment.turn)
        rows = (time >= 0.0) & (time <= flight.duration_s)
        out, within = rows & ~inside, rows & inside
        power = np.degrees(flight.carrier.rate_b[:, 1]) ** 2 / STEP_HZ * (out & legs)
        return cls(
            {name: float(values[out].max()) for name, values in demands.items()},
            {name: float(values[within].max(initial=0.0)) for name, values in demands.items()},
            {name: float(time[np.where(out, values, -1.0).argmax()]) for name, values in demands.items()},
            float(power[joint].sum()),
            float((out & legs & joint).sum()) / STEP_HZ,
            float(power.sum()),
        )


def demands_of(flight: Flight) -> dict[str, np.ndarray]:
    """Sizes of angular accelerations [deg/s^2] and of rates of the controls [deg/s] at the rows of the log."""
    turning = np.degrees(np.gradient(flight.carrier.rate_b, 1.0 / STEP_HZ, axis=0))
    controls = [flight.controls[name] for name in ("elevator", "aileron_left", "rudder")]
    moving = [np.degrees(np.gradient(control, 1.0 / STEP_HZ)) for control in controls]
    values = (turning[:, 1], turning[:, 0], turning[:, 2], *moving)
    return {name: np.abs(value) for name, value in zip(RATES, values, strict=True)}


def rate_bias_in_turns(flight: Flight, rate_hz: float = 10.0) -> tuple[float, float]:
    """What the rows of the steady part of turns are off their mean: angular rate [deg/s], aileron [deg].

    The rates at the rows are compared with the rotation from row to row, the aileron with its mean over all steps.
    """
    rates, ailerons = [0.0], [0.0]
    for segment in flight.segments:
        start = np.ceil((segment.start_s + 5.0) * rate_hz) / rate_hz
        time = np.arange(start, min(segment.stop_s - 3.0, start + 20.0), 1.0 / rate_hz)
        if not segment.turn or len(time) < 2.0 * rate_hz:
            continue
        at = flight.carrier.at(time)
        attitude = Rotation.from_matrix(rot_nb_from_attitude(at.attitude))
        mean = (attitude[:-1].inv() * attitude[1:]).as_rotvec() * rate_hz
        off = 0.5 * (at.rate_b[1:] + at.rate_b[:-1]) - mean
        rates.append(float(np.degrees(np.abs(off.mean(axis=0)).max())))
        steps = np.arange(time[0], time[-1], 1.0 / STEP_HZ)
        row, step = (flight.controls_at(t)["aileron_left"].mean() for t in (time, steps))
        ailerons.append(float(np.degrees(abs(row - step))))
    return max(rates), max(ailerons)

"""Joints of a flight: what is demanded outside of maneuvers beside what maneuvers demand, and rates in turns.

Every shipped pattern is flown in calm air (steady wind where the scenario has it) by the Cessna and, with lengths in
proportion to its speed, by the drone; the log has every step. A maneuver counts from the beginning of its rise to the
end of its fall.

``joint_X_over_maneuver``: the largest X outside of all maneuvers over the largest inside, each over all patterns of an
aircraft; the worse of both. X is an angular acceleration or the rate of a control; "outside" includes the entries of
turns, climbs of drapes and moving flaps. Patterns without maneuvers, or with small ones, have no measure of their own:
``joint_X_over_own_maneuver`` is the worst of single patterns, where turns of 25 degrees of bank stand beside the roll
of 5 degrees in 10 s of ``fom_peak_to_peak``.

``pitch_power_in_joints``: share of the pitch rate's power outside of maneuvers on the legs that lies in the three
seconds after each pitch train, over the patterns where such rows exist: in most the next train rises meanwhile.
``pitch_rate_in_joints_dps`` is the rms in these rows. In calm air next to nothing else is left outside of maneuvers, so
the share falls more slowly than the power itself.
``pitch_power_in_joints_as_shipped``: the same share in ``calibration_c208b`` in its light air. There the roll train
rises in these seconds, so only pitch trains, with their rise and fall, and the whole cycles of others are left out.
``rate_bias_in_turns_dps``: mean of ``true_rate_*`` at the rows of steady turns less the rotation from row to row;
``aileron_bias_in_turns_deg``: mean of the aileron at these rows less its mean over all steps.
"""

import math
from functools import cache

import numpy as np

from magsim.flight import fly
from magsim.loading import load_scenario
from magsim.trajectory import Flight
from tests.benchmarks.rows import Row, at_most, stated
from tests.support.patterns import AFTER_S, RATES, SHIPPED, Joints, flown, rate_bias_in_turns, shipped


@cache
def flights(aircraft: str) -> dict[str, Flight]:
    """All patterns of an aircraft."""
    return {name: flown(shipped(name), aircraft) for name in SHIPPED[aircraft]}


def ratios(aircraft: str) -> tuple[dict[str, float], dict[str, float]]:
    """Largest demand outside of maneuvers over the largest inside: over all patterns, and in the worst of them."""
    joints = [Joints.of(flight) for flight in flights(aircraft).values()]
    most = {x: max(j.outside[x] for j in joints) / max(j.inside[x] for j in joints) for x in RATES}
    worst = {x: max(j.outside[x] / j.inside[x] for j in joints if j.inside[x] > 0.0) for x in RATES}
    return most, worst


def pitch_rows(aircraft: str) -> list[Row]:
    """Figures of the pitch rate after pitch trains."""
    joints = [j for flight in flights(aircraft).values() if (j := Joints.of(flight)).joint_s > 0.0]
    power, time_s, total = (sum(getattr(j, name) for j in joints) for name in ("joint_power", "joint_s", "power"))
    of = "" if aircraft == "c208b" else f"_{aircraft}"
    return [
        at_most(f"pitch_power_in_joints{of}", power / total, "1", 0.1),
        stated(f"pitch_rate_in_joints{of}_dps", math.sqrt(power / time_s), "deg/s"),
    ]


def share_as_shipped() -> float:
    """Share of the pitch rate's power on the legs that lies in the three seconds after each pitch train."""
    loaded = load_scenario("calibration_c208b")
    flight = fly(loaded.scenario, loaded.aircraft)
    time = flight.carrier.time_s
    joint, left, legs = (np.zeros(len(time), dtype=bool) for _ in range(3))
    for maneuver in flight.maneuvers:
        eased = maneuver.axis == "pitch"
        ended = maneuver.stop_s + eased * maneuver.ease_out_s
        left |= (time >= maneuver.start_s - eased * maneuver.ease_in_s) & (time <= ended)
        if eased:
            joint |= (time > ended) & (time <= ended + AFTER_S)
    for segment in flight.segments:
        legs |= (time >= segment.start_s) & (time <= segment.stop_s) & (not segment.turn)
    power = flight.carrier.rate_b[:, 1] ** 2 * (legs & ~left)
    return float(power[joint].sum() / power.sum())


def rows() -> list[Row]:
    """All figures of joints and turns."""
    most, worst = zip(*(ratios(aircraft) for aircraft in SHIPPED), strict=True)
    out = [at_most(f"joint_{x}_over_maneuver", max(ratio[x] for ratio in most), "1", 1.0) for x in RATES]
    out += [stated(f"joint_{x}_over_own_maneuver", max(ratio[x] for ratio in worst), "1") for x in RATES]
    for aircraft in SHIPPED:
        out += pitch_rows(aircraft)
    out.append(at_most("pitch_power_in_joints_as_shipped", share_as_shipped(), "1", 0.1))
    biases = [rate_bias_in_turns(flight) for aircraft in SHIPPED for flight in flights(aircraft).values()]
    rate, aileron = (max(values) for values in zip(*biases, strict=True))
    return [
        *out,
        at_most("rate_bias_in_turns_dps", rate, "deg/s", 0.02),
        stated("aileron_bias_in_turns_deg", aileron, "deg"),
    ]

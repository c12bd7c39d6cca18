"""How long legs must be for their maneuvers."""

import math
from collections.abc import Iterator

from magsim.planning.schedule import needed_s
from magsim.scenario import Cloverleaf, LegPattern, Start
from magsim.scenario.patterns import LONGEST_LEG_M, Maneuvering


def check_fit(pattern: LegPattern, start: Start) -> Iterator[tuple[str, str]]:
    """Yield a problem for the first leg that is too short for its maneuvers."""
    for leg in range(pattern.legs * pattern.circuits):
        available = pattern.leg_m / start.speed_mps
        needed = needed_s(pattern, leg, available)
        if needed > available:
            text = (
                f"leg {leg + 1} needs {needed:.0f} s for its maneuvers, but a leg of {pattern.leg_m:g} m takes "
                f"{available:.0f} s at {start.speed_mps:g} m/s; {legs_allowed(pattern, start.speed_mps)}"
            )
            yield "maneuvers" if isinstance(pattern, Maneuvering) else "leg_m", text
            return


def shortest_leg_m(pattern: LegPattern, speed_mps: float) -> float | None:
    """Return the leg length that all maneuvers fit into at a speed over ground, in steps of 10 m; None if none does."""
    legs = range(pattern.legs * min(pattern.circuits, 25))

    def needed_m(length: float) -> float:
        return max(needed_s(pattern, leg, length / speed_mps) for leg in legs) * speed_mps

    short, length = 0.0, pattern.leg_m
    while (needed := needed_m(length)) > length + 1e-6:
        if length > 2.0 * LONGEST_LEG_M:
            return None
        # Trains that are flown after the center move with it, by half of what is added.
        short, length = length, 10.0 * math.ceil(needed / 10.0 - 1e-9)
    # A longer leg may hold a train before its center, and need less: what fits in one length fits in every longer one.
    while short and length - short > 10.0:
        middle = 10.0 * math.ceil(0.05 * (short + length))
        if middle >= length:
            break
        if needed_m(middle) <= middle + 1e-6:
            length = middle
        else:
            short = middle
    return length


def legs_allowed(pattern: LegPattern, speed_mps: float) -> str:
    """Return the allowed leg length in words."""
    length = shortest_leg_m(pattern, speed_mps)
    if length is None:
        return "allowed: shorter trains"
    if isinstance(pattern, Cloverleaf):
        return f"allowed: leaf_m of at least {0.5 * length:g}, or shorter trains"
    return f"allowed: leg_m of at least {length:g}, or shorter trains"

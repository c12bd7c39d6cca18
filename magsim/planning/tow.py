"""Checks of a tow with the flight that pulls it."""

import math
from collections.abc import Iterator

from magsim.aircraft import Aircraft, Bird
from magsim.scenario import LegPattern, Start, Tow
from magsim.units import G0

WHIP_G = 0.35
"""Vertical swing of the hook, amplitude over g, up to which no rope takes three times its steady tension.

A bowed rope snaps tight well before it goes slack, which it does from 0.65 g on: tests/benchmarks/tow_accuracy.py.
"""


def check_tow(
    tow: Tow, start: Start, parts: tuple[LegPattern, ...], bird: Bird | None, *, kinematic: bool
) -> Iterator[tuple[str, str]]:
    """Yield the problems of a tow with its flight: key within ``tow``, and text."""
    if kinematic and tow.coupling == "two_way":
        yield "coupling", "a carrier without a flight model feels no rope; allowed: 'one_way'"
    if tow.coupling == "two_way" and tow.step_hz is not None:
        yield "step_hz", "a rope that pulls is stepped with the flight model; allowed: flight.step_hz"
    if bird is not None:
        low, high = bird.facts.limits.speed_mps
        if not low <= start.speed_mps <= high:
            text = f"{bird.name} is not modeled at start.speed_mps = {start.speed_mps:g}; allowed: {low:g} to {high:g}"
            yield "bird", text
    whip = next((text for part in parts if (text := _whip(part, start))), "")
    if whip:
        yield "bird", whip


def check_names(aircraft: Aircraft, bird: Bird | None) -> Iterator[tuple[str, str]]:
    """Yield feeders and buses of carrier and bird with the same name: both become columns."""
    for kind in ("feeders", "buses"):
        above, below = ({item.name for item in getattr(v.magnetics, kind)} if v else set() for v in (aircraft, bird))
        double = ", ".join(sorted(above & below))
        if double:
            yield "bird", f"{aircraft.name} has {kind} of the same name: {double}; allowed: names of its own"


def _whip(pattern: LegPattern, start: Start) -> str:
    """Return the problem of pitch maneuvers above a rope, or an empty text."""
    per_deg = start.speed_mps * math.radians(1.0) * 2.0 * math.pi / G0
    for train in pattern.maneuvers:
        for swing in train.swings:
            legs = range(pattern.legs * pattern.circuits) if swing.axis == "pitch" else ()
            for amplitude, period in ((swing.amplitude(leg), swing.period(leg)) for leg in legs):
                load = per_deg * amplitude / period
                if load > WHIP_G:
                    most, least = 10.0 * WHIP_G * period / per_deg, 10.0 * per_deg * amplitude / WHIP_G
                    return (
                        f"pitch maneuvers of {amplitude:g} deg in {period:g} s swing the hook by {load:.2f} g at "
                        f"{start.speed_mps:g} m/s and whip the rope; allowed: {WHIP_G:g} g, up to "
                        f"{math.floor(most) / 10.0:g} deg in {period:g} s, or a period of at least "
                        f"{math.ceil(least) / 10.0:g} s"
                    )
    return ""

"""Load factors of pitch maneuvers."""

import math
from collections.abc import Iterator
from functools import partial

from magsim.aircraft import Aircraft, Limits
from magsim.scenario import Combined, LegPattern, Oscillation, Start
from magsim.scenario.patterns import Maneuvering
from magsim.units import G0


def check_loads(pattern: LegPattern, start: Start, aircraft: Aircraft | None) -> Iterator[tuple[str, str]]:
    """Yield the pitch maneuvers beyond the load factors of crew or airframe: 1 g +- V A omega / g."""
    if aircraft is None:
        return
    for number, train in enumerate(pattern.maneuvers):
        for place, swing in enumerate(train.swings):
            if swing.axis != "pitch":
                continue
            legs = range(pattern.legs * pattern.circuits)
            text = _load(pattern, start, aircraft, swing, max(legs, key=partial(_steepness, swing)))
            if text:
                key = f"maneuvers[{number}]." + (f"swings[{place}]." if isinstance(train, Combined) else "")
                yield f"{key}amplitude_deg" if isinstance(pattern, Maneuvering) else "pitch_deg", text


def _steepness(swing: Oscillation, leg: int) -> float:
    """Return amplitude over period on a leg [deg/s]: where it is largest, so is the load."""
    return swing.most * swing.amplitude(leg) / (swing.shortest * swing.period(leg))


def _load(pattern: LegPattern, start: Start, aircraft: Aircraft, swing: Oscillation, leg: int) -> str:
    """Return the problem of the load factor of a pitch oscillation, or an empty text."""
    limits = aircraft.limits
    if not isinstance(limits, Limits):
        return ""  # a kinematic carrier flies no maneuvers
    amplitude, period = swing.most * swing.amplitude(leg), swing.shortest * swing.period(leg)
    angular = start.speed_mps * math.radians(amplitude) * 2.0 * math.pi / G0
    load = angular / period
    text = (
        f"{amplitude:.3g} deg of pitch in {period:.3g} s swings from {1.0 - load:.2f} to {1.0 + load:.2f} g at "
        f"{start.speed_mps:g} m/s; allowed for"
    )
    airframe = min(1.0 - limits.load_factor[0], limits.load_factor[1] - 1.0)
    if load > airframe:
        return (
            f"{text} {aircraft.name}: {limits.load_factor[0]:g} to {limits.load_factor[1]:g} g (a period of at least "
            f"{_up(angular / airframe):g} s, or a smaller amplitude)"
        )
    if limits.crew is None or pattern.allow_beyond_crew_g:
        return ""
    crew = min(1.0 - limits.crew[0], limits.crew[1] - 1.0)
    if load > crew + 1e-9:
        return (
            f"{text} a crew: {limits.crew[0]:g} to {limits.crew[1]:g} g (a period of at least {_up(angular / crew):g} "
            "s, a smaller amplitude, or allow_beyond_crew_g = true)"
        )
    return ""


def _up(period_s: float) -> float:
    """Return a period rounded up to a tenth."""
    return math.ceil(10.0 * period_s - 1e-9) / 10.0

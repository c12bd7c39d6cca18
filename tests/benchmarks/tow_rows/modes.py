"""How a finned bird swings on its own: frequency and damping of pitch and yaw after a nudge."""

from magsim.aircraft import load_bird
from magsim.flight.tow.setup import chain_of
from magsim.scenario import Tow
from tests.benchmarks.rows import Row, stated, within
from tests.support.tows import nudged, strongest_mode

ABOVE_HZ = 0.2
"""Faster than the swing under the rope."""

LOG_HZ = 8


def mode(speed_mps: float, axis: int) -> tuple[float, float]:
    """Frequency [Hz] and damping ratio of the shipped bird about an axis: 1 pitch, 2 yaw."""
    chain = chain_of(Tow(), load_bird("bird"))
    return strongest_mode(nudged(chain, speed_mps, axis, LOG_HZ), 1.0 / LOG_HZ, above_hz=ABOVE_HZ)


def rows() -> list[Row]:
    """Frequencies, periods and damping."""
    out = []
    for name, axis in (("pitch", 1), ("yaw", 2)):
        for speed in (25.0, 30.0):
            out.append(within(f"{name}_frequency_at_{speed:g}_mps", mode(speed, axis)[0], "Hz", 0.3, 0.8))
        for speed in (25.0, 40.0, 70.0):
            frequency, damping = mode(speed, axis)
            out.append(stated(f"{name}_period_at_{speed:g}_mps", 1.0 / frequency, "s"))
            out.append(stated(f"{name}_damping_at_{speed:g}_mps", damping, "1"))
    return out

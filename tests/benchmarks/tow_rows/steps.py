"""How far from the limit of many steps and links a flight is, and up to which tension steps are stable."""

import math
from functools import cache

import numpy as np

from magsim.flight.tow.chain import Chain, ball
from magsim.units import G0
from tests.benchmarks.rows import Row, at_least, at_most, stated, within
from tests.support.ropes import ROPE, bird_chain
from tests.support.tows import at_rest, body_of, level, moved, states

FINEST_HZ, MOST_LINKS = 960, 40


@cache
def swayed(links: int, step_hz: int) -> tuple[np.ndarray, np.ndarray]:
    """Places [m] and attitude [deg] of a bird whose hook sways by 1.5 m at the swing's resonance for 40 s."""
    chain = bird_chain(links)
    _, rows, _ = states(chain, at_rest(chain, 25.0), moved(25.0, 1.5, 11.0), seconds=40.0, step_hz=step_hz, log_hz=10)
    place, attitude = body_of(chain, rows)
    return place, np.degrees(attitude)


def apart(one: tuple[np.ndarray, np.ndarray], other: tuple[np.ndarray, np.ndarray]) -> tuple[float, float]:
    """Largest difference of place [m] and attitude [deg]."""
    return float(np.abs(one[0] - other[0]).max()), float(np.abs(one[1] - other[1]).max())


def is_stable(links: int, step_hz: int, part: float) -> bool:
    """Whether steps keep a hanging chain without drag that is pushed by a tenth of a millimeter.

    The pull at its top is a part of the limit.
    """
    link_m = ROPE.length_m / links
    limit_n = 2.0 * ROPE.mass_per_m * (link_m * step_hz) ** 2
    mass_kg = part * limit_n / G0 - ROPE.mass_per_m * (ROPE.length_m - 0.5 * link_m)
    chain = Chain(ROPE, ball(mass_kg, 0.0), links)
    state, inner = at_rest(chain, 1.0, 0.0), 3 * (links - 1)
    state[:inner].reshape(-1, 3)[:, 0] += 1e-4 * (-1.0) ** np.arange(links - 1)
    _, rows, _ = states(chain, state, level(0.0, 0.0), seconds=60.0, step_hz=step_hz, log_hz=step_hz)
    off = np.abs(rows[:, :inner].reshape(len(rows), -1, 3)[:, :, :2]).max()
    return bool(np.isfinite(off) and off < 0.01)


def rows() -> list[Row]:
    """All figures of steps and links."""
    out, turned = [], {}
    for step_hz in (30, 60, 120, 240):
        place, turned[step_hz] = apart(swayed(10, step_hz), swayed(10, FINEST_HZ))
        out += [
            at_most(f"step_error_at_{step_hz}_hz_m", place, "m", 1e-4),
            at_most(f"step_error_at_{step_hz}_hz_deg", turned[step_hz], "deg", 0.02),
        ]
    out.append(within("runge_kutta_order", math.log2(turned[120] / turned[240]), "1", 3.7, 4.3))
    for links in (2, 3, 5, 10, 20):
        place, attitude = apart(swayed(links, FINEST_HZ), swayed(MOST_LINKS, FINEST_HZ))
        out += [
            stated(f"links_error_at_{links}_m", place, "m"),
            stated(f"links_error_at_{links}_deg", attitude, "deg"),
        ]
    cases = [(links, step_hz) for links in (5, 10, 20) for step_hz in (20, 30, 60)]
    return [
        *out,
        at_least("stable_at_0.8_of_the_limit", sum(is_stable(*case, 0.8) for case in cases), "of 9", 9.0),
        at_least("unstable_at_1.3_of_the_limit", sum(not is_stable(*case, 1.3) for case in cases), "of 9", 9.0),
    ]

"""How hard a hook may swing up and down: to a slack rope, to three times the steady tension.

The hook follows a sine in height whose acceleration is a part of g; it is taken up within two periods and held for six.
A bowed rope that is let go and pulled tight again snaps: the peaks are real, of a rope that does not stretch.
"""

import math
from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation

from magsim.planning import WHIP_G
from magsim.units import G0
from tests.benchmarks.rows import Row, at_least, stated
from tests.support.ropes import bird_chain
from tests.support.tows import at_rest, moved, states

SPEEDS_MPS = (28.0, 40.0, 50.0, 60.0, 75.0)
PERIOD_S, STEP_HZ = 5.0, 240
STEP_G, MOST_G, TIMES = 0.05, 1.5, 3.0
FLOW_DEG = 45.0
"""Beyond which the model of the bird ends."""


@cache
def whipped(speed_mps: float, part_g: float) -> tuple[float, float, float]:
    """Least and largest tension [N] of a flight, and the largest angle of the flow at the bird [deg]."""
    chain = bird_chain()
    drive = moved(speed_mps, part_g * G0 / (2.0 * math.pi / PERIOD_S) ** 2, PERIOD_S, axis=2, ease_s=2.0 * PERIOD_S)
    seconds = 8.0 * PERIOD_S
    time, rows, tension = states(chain, at_rest(chain, speed_mps), drive, seconds=seconds, step_hz=STEP_HZ, log_hz=10)
    if not np.isfinite(rows).all():
        return -math.inf, math.inf, 180.0
    body = 6 * (chain.links - 1)
    turned = Rotation.from_quat(np.roll(rows[:, body + 9 :], -1, axis=1))
    flow = turned.inv().apply(drive(time)[:, 6:9] - rows[:, body + 3 : body + 6])
    angle = np.degrees(np.arctan2(np.hypot(flow[:, 1], flow[:, 2]), -flow[:, 0])).max()
    return float(tension[:, 0].min()), float(tension[:, 1].max()), float(angle)


def first_g(speed_mps: float) -> tuple[float, float, float]:
    """Part of g at which a rope goes slack, takes three times its steady tension, and the flow meets the bird askew."""
    calm_n = whipped(speed_mps, 0.0)[1]
    firsts = [math.nan] * 3
    for part in np.arange(STEP_G, MOST_G + 1e-9, STEP_G):
        least, most, angle = whipped(speed_mps, float(part))
        for k, over in enumerate((least < 0.0, most > TIMES * calm_n, angle > FLOW_DEG)):
            if over and math.isnan(firsts[k]):
                firsts[k] = float(part)
        if least < 0.0 and not math.isnan(firsts[1]):
            break
    return firsts[0], firsts[1], firsts[2]


def rows() -> list[Row]:
    """The table, and what happens at the limit that scenarios are held to."""
    out = []
    for speed in SPEEDS_MPS:
        slack, triple, askew = first_g(speed)
        calm_n = whipped(speed, 0.0)[1]
        least, most, _ = whipped(speed, WHIP_G)
        at = f"at_{speed:g}_mps"
        out += [
            at_least(f"whip_slack_{at}", slack, "g", WHIP_G),
            at_least(f"whip_triple_tension_{at}", triple, "g", WHIP_G),
            *([] if math.isnan(askew) else [stated(f"whip_askew_flow_{at}", askew, "g")]),
            at_least(f"whip_least_tension_at_limit_{at}", least, "N", 0.0),
            stated(f"whip_peak_over_steady_at_limit_{at}", most / calm_n, "1"),
        ]
    return out

"""A point under a rope beside MoorDyn, whose rope is elastic: the trail it comes to, and its way there."""

import tempfile
from pathlib import Path

import numpy as np

from tests.benchmarks.rows import Row, at_most, stated
from tests.benchmarks.tow_rows.steady import CASES
from tests.support.moored import STEP_HZ, towed
from tests.support.ropes import AIR, point_chain
from tests.support.tows import at_rest, body_of, started, states

EASE_S, SECONDS, MEAN_S = 40.0, 100.0, 11.0
"""Start from rest, whole flight, and the swing over which a trail is averaged."""


def both(speed_mps: float, mass_kg: float, sway_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Places of the body from its hook by the chain and by MoorDyn, (n, 3) [m]."""
    chain = point_chain(mass_kg)
    place, drive = started(speed_mps, EASE_S, sway_m)
    time, rows, _ = states(chain, at_rest(chain, 1e-6), drive, seconds=SECONDS, step_hz=STEP_HZ, log_hz=STEP_HZ)
    with tempfile.TemporaryDirectory() as folder:
        other = towed(Path(folder), chain, AIR, place(time))
    return body_of(chain, rows)[0], other


def trails_deg(place: np.ndarray) -> np.ndarray:
    """Trail at each row."""
    return np.degrees(np.arctan2(-place[:, 0], place[:, 2]))


def rows() -> list[Row]:
    """Differences of both."""
    out, last = [], round(MEAN_S * STEP_HZ)
    for speed, mass in CASES:
        chain, other = both(speed, mass, 0.0)
        settled = abs(trails_deg(chain)[-last:].mean() - trails_deg(other)[-last:].mean())
        out.append(at_most(f"moordyn_trail_difference_at_{speed:g}_mps_{mass:g}_kg", settled, "deg", 0.1))
        chain, other = both(speed, mass, 1.5)
        way = np.sqrt(np.mean(np.sum((chain - other) ** 2, axis=1)))
        out.append(stated(f"moordyn_track_difference_at_{speed:g}_mps_{mass:g}_kg", way, "m rms"))
    return out

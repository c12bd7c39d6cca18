"""Integration of chains through time, a batch of flights at once."""

from collections.abc import Callable, Sequence

import numpy as np

from magsim.flight.tow.chain import Chain
from magsim.flight.tow.dynamics import advance, nodes_of
from magsim.flight.tow.motion import BirdMotion

Forcing = Callable[[np.ndarray], np.ndarray]
"""External forcing of one chain, see ``air`` in ``dynamics``: times (n,) [s] to ten numbers each, (n, 10)."""

CHUNK_S = 20.0
"""The forcings are asked for so much of the flight at once."""


def integrate(
    chains: Sequence[Chain],
    states: Sequence[np.ndarray],
    forcings: Sequence[Forcing],
    *,
    start_s: float,
    duration_s: Sequence[float],
    step_hz: int,
    log_hz: int,
    progress: Callable[[float], None] | None = None,
) -> list[BirdMotion]:
    """Integrate a batch of independent chains, each over its own duration.

    Parameters
    ----------
    chains : sequence of Chain
    states : sequence of (s,)
        At the start.
    forcings : sequence of Forcing
    start_s : float [s]
    duration_s : sequence of float [s]
    step_hz, log_hz : int [Hz]
        The second divides the first.
    progress : callable, optional
        Called with the share that is done, 0 to 1.

    Returns
    -------
    list of BirdMotion
        One for each chain. If a flight diverges, its remaining rows are NaN.
    """
    out = []
    for number, flight in enumerate(zip(chains, states, forcings, duration_s, strict=True)):
        out.append(_integrate(*flight, start_s=start_s, step_hz=step_hz, log_hz=log_hz))
        if progress is not None:
            progress((number + 1) / len(chains))
    return out


def _integrate(
    chain: Chain, state: np.ndarray, forcing: Forcing, duration_s: float, *, start_s: float, step_hz: int, log_hz: int
) -> BirdMotion:
    every, rows = step_hz // log_hz, int(np.floor(duration_s * log_hz + 1e-6)) + 1
    chunk = max(1, round(CHUNK_S * log_hz))
    body = 6 * (chain.links - 1)
    state, table = np.array(state, dtype=float), np.full((rows, 18), np.nan)
    least, most, slack_s, lost_s = np.inf, -np.inf, None, None
    for first in range(0, rows, chunk):
        count = min(chunk, rows - first)
        # of the last row only the tensions are needed
        halves = start_s + (2 * first * every + np.arange(2 * count * every + 1)) / (2.0 * step_hz)
        airs = forcing(np.minimum(halves, start_s + (rows - 1) / log_hz))
        logged = np.empty((every, 4))
        for row in range(count):
            table[first + row, :13] = state[body:]
            table[first + row, 13:16] = nodes_of(chain, state)[-1]
            advance(chain.constants, state, airs[2 * row * every : 2 * (row + 1) * every + 1], 1.0 / step_hz, logged)
            table[first + row, 16:] = logged[0, :2]
            time_s = start_s + (first + row) / log_hz
            if not np.isfinite(state.sum() + logged.sum()):
                lost_s = time_s
                break
            least, most = min(least, logged[:, 2].min()), max(most, logged[:, 3].max())
            if slack_s is None and least < 0.0:
                slack_s = time_s + float((logged[:, 2] < 0.0).argmax()) / step_hz
        if lost_s is not None:
            break
    return BirdMotion.of(
        start_s + np.arange(rows) / log_hz,
        table,
        least_n=float(least),
        most_n=float(most),
        begun_s=start_s,
        slack_s=slack_s,
        lost_s=lost_s,
    )

"""What a towed bird costs: flight seconds in a CPU second at 60 steps a second, without the compiler's time."""

import time
from collections.abc import Callable

from magsim.flight.tow.integration import integrate
from tests.benchmarks.rows import Row, at_least
from tests.support.ropes import bird_chain
from tests.support.tows import at_rest, moved

BATCH = 64
SINGLE_S, BATCH_S = 600.0, 60.0
"""Length of a flight alone and in a batch."""


def cpu_s(work: Callable[[], object]) -> float:
    """CPU seconds of this process that a call takes."""
    start = time.process_time()
    work()
    return time.process_time() - start


def fly(flights: int, seconds: float) -> None:
    """Fly a finned bird under a swaying hook, so many times together."""
    chain, drive = bird_chain(), moved(25.0, 1.5, 11.0)
    integrate(
        [chain] * flights,
        [at_rest(chain, 25.0)] * flights,
        [drive] * flights,
        start_s=0.0,
        duration_s=[seconds] * flights,
        step_hz=60,
        log_hz=30,
    )


def rows() -> list[Row]:
    """Both speeds."""
    fly(1, 1.0)
    return [
        at_least("single_x_real_time", SINGLE_S / cpu_s(lambda: fly(1, SINGLE_S)), "1", 15.0),
        at_least("batch64_flight_s_per_cpu_s", BATCH * BATCH_S / cpu_s(lambda: fly(BATCH, BATCH_S)), "1", 100.0),
    ]

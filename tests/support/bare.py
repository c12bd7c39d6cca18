"""A bare JSBSim run: the same aircraft at the same rate as a flight, with no guidance and no logging."""

import time
from collections.abc import Callable

from magsim.aircraft import Facts
from magsim.flight.carriers.planning import plan_flight
from magsim.flight.model.start import start
from magsim.loading import LoadedScenario


def bare_run(loaded: LoadedScenario, duration_s: float) -> float:
    """Start the flight of a scenario, step its flight model for a time and do nothing else; return JSBSim's clock [s].

    Parameters
    ----------
    loaded : LoadedScenario
        Of an aircraft with a flight model.
    duration_s : float
        From the start of the warm-up on.
    """
    facts = loaded.scenario.loading.apply(loaded.aircraft.facts)
    assert isinstance(facts, Facts)
    setup = plan_flight(loaded.scenario, facts, loaded.ground).setup
    fdm = start(facts, setup)
    run = fdm.run
    for _ in range(round(duration_s * setup.step_hz)):
        run()
    return float(fdm["simulation/sim-time-sec"])


def cpu_s(work: Callable[[], object]) -> float:
    """Return the CPU time of this process that a call takes [s]."""
    begun = time.process_time()
    work()
    return time.process_time() - begun

"""Flying: a scenario and its aircraft become a flight."""

from collections.abc import Callable

from magsim.aircraft import Aircraft, Bird, KinematicFacts
from magsim.earth.atmosphere import standard_density
from magsim.errors import RequestError
from magsim.flight.carriers.kinematic import fly_kinematic
from magsim.flight.carriers.logged import fly_track
from magsim.flight.carriers.modeled import fly_modeled
from magsim.flight.carriers.outcome import check_height
from magsim.flight.carriers.planning import MARGIN_S, settle_s
from magsim.flight.tow.motion import BirdMotion
from magsim.scenario import Scenario, TrackLog, TrackPattern, ground_of
from magsim.terrain import Ground
from magsim.trajectory import Flight


def fly(
    scenario: Scenario,
    aircraft: Aircraft,
    *,
    bird: Bird | None = None,
    ground: Ground | None = None,
    track: TrackLog | None = None,
    progress: Callable[[float], None] | None = None,
) -> Flight:
    """Fly a scenario.

    Parameters
    ----------
    scenario : Scenario
    aircraft : Aircraft
        The one that the scenario names.
    bird : Bird, optional
        The one that it tows.
    ground : Ground, optional
        That of a loaded scenario; without it, what ``scenario.terrain`` means without files.
    track : TrackLog, optional
        That of a loaded scenario with the pattern ``track``.
    progress : callable, optional
        Called with the part that is done, 0 to 1.

    Returns
    -------
    Flight
        Logged at ``scenario.flight.log_hz`` or the rate that the aircraft needs, from 4 s before the first row to
        4 s after the last; with the bird, if one is towed.

    Raises
    ------
    RequestError
        If the pattern or its maneuvers do not fit the wind and the speed, or the bird cannot be towed.
    DataError
        If the flight diverges, stalls, touches the ground or does not come to its end; if the rope goes slack.
    """
    if ground is None:
        ground = ground_of(scenario.terrain, scenario.start, scenario.seed, None)
    if scenario.tow is None:
        return _fly_carrier(scenario, aircraft, None, ground=ground, track=track, progress=progress)[0]
    if bird is None:
        msg = f"tow.bird: {scenario.tow.bird} is read by load_scenario only"
        raise RequestError(msg)
    report = (lambda _share: None) if progress is None else progress
    # importing the compiled equations takes seconds; flights without a bird do not need them
    from magsim.flight.tow.setup import require_equilibrium
    from magsim.flight.tow.towing import tow_bird

    # a bird that cannot be towed is reported before the carrier flies
    require_equilibrium(scenario.tow, bird, scenario.start.speed_mps, float(standard_density(scenario.start.alt_m)))
    flight, flown = _fly_carrier(
        scenario, aircraft, bird, ground=ground, track=track, progress=lambda share: report(0.8 * share)
    )
    flight = tow_bird(flight, scenario, aircraft, bird, flown).since(-MARGIN_S)
    check_height(flight, ground)
    report(1.0)
    return flight


def _fly_carrier(
    scenario: Scenario,
    aircraft: Aircraft,
    bird: Bird | None,
    *,
    ground: Ground | None,
    track: TrackLog | None,
    progress: Callable[[float], None] | None,
) -> tuple[Flight, BirdMotion | None]:
    """Fly the carrier, with a log long enough for a bird to settle; return the motion of a bird that pulls."""
    if isinstance(scenario.pattern, TrackPattern):
        if track is None:
            msg = f"pattern.file: {scenario.pattern.file} is read by load_scenario only"
            raise RequestError(msg)
        return fly_track(scenario, aircraft, track, ground, (MARGIN_S + settle_s(scenario), MARGIN_S)), None
    if isinstance(aircraft.facts, KinematicFacts):
        return fly_kinematic(scenario, aircraft, ground), None
    return fly_modeled(scenario, aircraft, bird, ground, progress)

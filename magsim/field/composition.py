"""The field of a flight: every part at every mount that carries a sensor, at the simulation rate."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from magsim.aircraft import Aircraft, Vehicle
from magsim.columns import BACKGROUND, COMPONENTS, PLATFORM
from magsim.field import platform
from magsim.field.background import crust, main_field, targets, variation
from magsim.field.response import AircraftResponse, load_response, response_at
from magsim.field.situation import Situation
from magsim.field.sources import flex, memory, rotors
from magsim.field.wiring import electronics
from magsim.scenario import Scenario
from magsim.terrain import Ground
from magsim.trajectory import Flight
from magsim.truth import FieldTruth

Progress = Callable[[float], None]
Maker = Callable[[Situation], np.ndarray | None]

MAKERS: Mapping[str, Maker] = {
    "earth": main_field.earth,
    "crust": crust.crust,
    "target": targets.target,
    "variation": variation.variation,
    "permanent": platform.permanent,
    "hinged": platform.hinged,
    "propeller": rotors.propeller,
    "induced": platform.induced,
    "memory": memory.memory,
    "eddy": platform.eddy,
    "electronics": electronics.electronics,
}
"""What makes each part, or None where the aircraft has no such thing; the names are those of ``columns.COMPONENTS``."""


def parts_on(scenario: Scenario, names: tuple[str, ...] = COMPONENTS) -> tuple[str, ...]:
    """Names of the parts that a scenario has switched on, in the order of ``COMPONENTS``."""
    return tuple(name for name in names if name in MAKERS and scenario.field.is_on(name))


def compute_field(
    scenario: Scenario,
    aircraft: Aircraft,
    flight: Flight,
    response: AircraftResponse | None = None,
    *,
    ground: Ground | None = None,
    progress: Progress | None = None,
) -> FieldTruth:
    """Every part of the field at every mount that carries a sensor.

    The whole is the sum of all parts. ``B_0``, which magnetizes the steel and drives the eddy currents, is the sum of
    the background parts in body axes at the carrier's reference point.

    Parameters
    ----------
    scenario : Scenario
        Which physics is on, where and when, which mounts.
    aircraft : Aircraft
    flight : Flight
    response : AircraftResponse, optional
        Computed or read from the cache when it is not given.
    ground : Ground, optional
        What ``[terrain]`` means; None without it.
    progress : callable, optional
        Told the share of the work that is done, from 0 to 1.

    Returns
    -------
    FieldTruth
        At the simulation rate over the whole logged span; parts that are switched off are absent.
    """
    tell = progress or (lambda _: None)
    response = load_response(aircraft, scenario.field.eddy.model) if response is None else response
    tell(0.1)
    # Spline fits call LAPACK: on one thread they give the same bits everywhere.
    with threadpool_limits(limits=1, user_api="blas"):
        situation = with_background(Situation.of(scenario, aircraft.magnetics, flight, response, ground))
        tell(0.5)
        return compose(situation, aircraft, tell)


def with_background(situation: Situation) -> Situation:
    """The situation with its background parts."""
    names = parts_on(situation.scenario, BACKGROUND)
    return replace(situation, background={name: MAKERS[name](situation) for name in names})


def compose(situation: Situation, vehicle: Vehicle, tell: Progress = lambda _: None) -> FieldTruth:
    """Every part at the mounts of a situation that has its background; ``tell`` is told shares from 0.5 to 1."""
    scenario = situation.scenario
    parts = {name: part[:, :-1] for name, part in situation.background.items()}
    platform = parts_on(scenario, PLATFORM)
    for done, name in enumerate(platform, start=1):
        scale, part = getattr(scenario.field, name).scale, MAKERS[name](situation)
        if part is not None:
            parts[name] = part if scale == 1.0 else scale * part
        tell(0.5 + 0.5 * done / len(platform))
    bending = flex.Bending.of(situation)
    if bending.shifts_b:
        _bend(parts, situation, bending, response_at(vehicle, flex.places_around(situation, bending)))
    for part in parts.values():
        part.flags.writeable = False  # handed over, not copied
    onboard = situation.onboard if "electronics" in parts else electronics.Onboard()
    return FieldTruth(
        situation.time_s,
        situation.mounts,
        parts,
        currents_a=onboard.currents_a,
        voltages_v=onboard.voltages_v,
        tilts_b=bending.tilts_b,
    )


def _bend(
    parts: dict[str, np.ndarray], situation: Situation, bending: flex.Bending, response: AircraftResponse
) -> None:
    """Add to every part what the way of the bent mounts changes, by the part's own gradient there."""
    around = replace(situation, response=response, mounts=response.mounts)
    for name, part in parts.items():
        field = MAKERS[name](around)
        field, scale = (
            (field[:, :-1], 1.0) if name in BACKGROUND else (field, getattr(situation.scenario.field, name).scale)
        )
        parts[name] = np.array(part)
        for mount, change in flex.moved(field, bending.shifts_b).items():
            parts[name][:, situation.mounts.index(mount)] += scale * change

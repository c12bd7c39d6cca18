"""The field of a flight: every part at every mount that carries a sensor, at the simulation rate."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from magsim.aircraft import Aircraft, Vehicle
from magsim.columns import BACKGROUND, COMPONENTS, PLATFORM
from magsim.field import flex
from magsim.field.background import crust, departure, main_field, swell, targets, variation
from magsim.field.excitation import FlightExcitation
from magsim.field.parts import PARTS
from magsim.field.response import AircraftResponse, load_response, response_at
from magsim.field.situation import Situation
from magsim.field.wiring.electronics import Onboard
from magsim.scenario import Scenario
from magsim.terrain import Ground
from magsim.threads import one_blas_thread
from magsim.trajectory import Flight
from magsim.truth import FieldTruth

Progress = Callable[[float], None]

BACKGROUNDS: Mapping[str, Callable[[Situation], np.ndarray]] = {
    "earth": main_field.earth,
    "departure": departure.departure,
    "crust": crust.crust,
    "target": targets.target,
    "variation": variation.variation,
    "swell": swell.swell,
}
"""What makes each part of the background; the names are those of ``columns.BACKGROUND``."""


def parts_on(scenario: Scenario, names: tuple[str, ...] = COMPONENTS) -> tuple[str, ...]:
    """Return the names of the parts that a scenario has switched on, in the order of ``COMPONENTS``."""
    return tuple(name for name in names if (name in BACKGROUNDS or name in PARTS) and scenario.field.is_on(name))


def compute_field(
    scenario: Scenario,
    aircraft: Aircraft,
    flight: Flight,
    response: AircraftResponse | None = None,
    *,
    ground: Ground | None = None,
    progress: Progress | None = None,
) -> FieldTruth:
    """Compute every part of the field at every mount that carries a sensor.

    The whole field is the sum of all parts. ``B_0``, which magnetizes the steel and drives the eddy currents, is the
    sum of the background parts in body axes at the carrier's reference point.

    Parameters
    ----------
    scenario : Scenario
        Which physics is on, where and when, which mounts.
    aircraft : Aircraft
    flight : Flight
    response : AircraftResponse, optional
        Computed or read from the cache when it is not given.
    ground : Ground, optional
        The ground of ``[terrain]``; None without it.
    progress : callable, optional
        Called with the share of the work that is done, from 0 to 1.

    Returns
    -------
    FieldTruth
        At the simulation rate over the whole logged span; parts that are switched off are absent.
    """
    report = progress or (lambda _: None)
    response = load_response(aircraft, scenario.field.eddy.model) if response is None else response
    report(0.1)
    # Spline fits call LAPACK: on one thread they give the same bits everywhere.
    with one_blas_thread():
        situation = with_background(Situation.of(scenario, aircraft.magnetics, flight, response, ground))
        report(0.5)
        return compose(FlightExcitation(situation), aircraft, report)


def with_background(situation: Situation) -> Situation:
    """Return the situation with its background parts."""
    names = parts_on(situation.scenario, BACKGROUND)
    return replace(situation, background={name: BACKGROUNDS[name](situation) for name in names})


def compose(excitation: FlightExcitation, vehicle: Vehicle, report: Progress = lambda _: None) -> FieldTruth:
    """Compute every part at the mounts of a situation.

    Parameters
    ----------
    excitation : FlightExcitation
        Of a situation with its background.
    vehicle : Vehicle
    report : callable
        Called with shares from 0.5 to 1.
    """
    situation = excitation.situation
    parts = {name: part[:, :-1] for name, part in situation.background.items()}
    platform = parts_on(situation.scenario, PLATFORM)
    for done, name in enumerate(platform, start=1):
        part = _platform_part(name, excitation, situation.response, situation.rows)
        if part is not None:
            parts[name] = part
        report(0.5 + 0.5 * done / len(platform))
    bending = flex.Bending.of(situation)
    bent: dict[str, np.ndarray] = {}
    if bending.shifts_b:
        places, eddy = flex.places_around(situation, bending), situation.scenario.field.eddy.model
        bent = _bend(parts, excitation, bending, response_at(vehicle, places, eddy))
    for part in parts.values():
        part.flags.writeable = False  # handed over, not copied
    onboard = excitation.onboard if "electronics" in parts else Onboard()
    return FieldTruth(
        situation.time_s,
        situation.mounts,
        parts,
        currents_a=onboard.currents_a,
        voltages_v=onboard.voltages_v,
        tilts_b=bending.tilts_b,
        bent_b=bent,
    )


def _scale(excitation: FlightExcitation, name: str) -> float:
    return getattr(excitation.settings, name).scale


def _platform_part(
    name: str, excitation: FlightExcitation, response: AircraftResponse, rows: np.ndarray
) -> np.ndarray | None:
    """Return a part times its scale, (n, s, 3) [nT]; None for an aircraft without it."""
    scale, part = _scale(excitation, name), PARTS[name].field(excitation, response, rows)
    return part if part is None or scale == 1.0 else scale * part


def _bend(
    parts: dict[str, np.ndarray], excitation: FlightExcitation, bending: flex.Bending, response: AircraftResponse
) -> dict[str, np.ndarray]:
    """Add to every part the change by the motion of the bent mounts, from the part's own gradient there.

    Return the sum of the changes at each of these mounts, (n, 3) [nT].
    """
    situation = excitation.situation
    around = replace(situation, response=response, mounts=response.mounts)
    whole = {mount: np.zeros_like(shift) for mount, shift in bending.shifts_b.items()}
    for name, part in parts.items():
        if name in BACKGROUNDS:
            changes, scale = flex.moved(BACKGROUNDS[name](around)[:, :-1], bending.shifts_b), 1.0
        else:
            found = PARTS[name].field(excitation, response, around.rows)
            assert found is not None  # it is among the parts of this aircraft
            changes, scale = flex.moved(found, bending.shifts_b), _scale(excitation, name)
        parts[name] = np.array(part)
        for mount, change in changes.items():
            parts[name][:, situation.mounts.index(mount)] += scale * change
            whole[mount] += scale * change
    return whole

"""The field of a flight: every part at every mount that carries a sensor, at the simulation rate."""

from collections.abc import Callable

import numpy as np

from magsim.aircraft import Aircraft, Vehicle
from magsim.arrays import given_up
from magsim.columns import COMPONENTS, PLATFORM
from magsim.field import flex
from magsim.field.background.whole import BACKGROUNDS, Background
from magsim.field.excitation import FlightExcitation
from magsim.field.parts import PARTS
from magsim.field.response import AircraftResponse, load_response, response_at
from magsim.field.situation import Passage, Situation, simulation_times, used_mounts
from magsim.field.wiring.electronics import Onboard
from magsim.scenario import Scenario
from magsim.terrain import Ground
from magsim.threads import one_blas_thread
from magsim.trajectory import Flight
from magsim.truth import FieldTruth

Progress = Callable[[float], None]


def parts_on(scenario: Scenario, names: tuple[str, ...] = COMPONENTS) -> tuple[str, ...]:
    """Return the names of the parts that a scenario has switched on, in the order of ``COMPONENTS``."""
    return tuple(name for name in names if (name in BACKGROUNDS or name in PARTS) and scenario.field.is_on(name))


def situation_of(
    scenario: Scenario,
    vehicle: Vehicle,
    response: AircraftResponse,
    background: Background,
    mounts: tuple[str, ...],
) -> Situation:
    """Return the situation of a body in its background, at some of its mounts."""
    passage = background.passage
    places = response.positions_m[response.rows(mounts)] - passage.path.reference_b
    parts = background.at_mounts(dict(zip(mounts, places, strict=True)))
    fields = {name: np.swapaxes(part, 0, 1) for name, part in parts.items()}
    return Situation(scenario, vehicle.magnetics, response, passage, mounts, fields, background.center)


def backgrounds_of(scenario: Scenario, flight: Flight, ground: Ground | None = None) -> dict[str, Background]:
    """Return the backgrounds of a flight's bodies at the simulation rate: ``carrier``, and ``bird`` with a tow."""
    # Carrier and bird are logged at rates of their own, which need not end together.
    time_s = simulation_times(flight)
    bodies = {"carrier": flight} if flight.bird is None else {"carrier": flight, "bird": flight.of_bird()}
    return {body: Background(Passage(scenario, part, ground, time_s)) for body, part in bodies.items()}


def compute_field(
    scenario: Scenario,
    aircraft: Aircraft,
    flight: Flight,
    response: AircraftResponse | None = None,
    *,
    ground: Ground | None = None,
    background: Background | None = None,
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
    background : Background, optional
        That of the flight's carrier, where it is known already; see ``backgrounds_of``.
    progress : callable, optional
        Called with the share of the work that is done, from 0 to 1.

    Returns
    -------
    FieldTruth
        At the simulation rate over the whole logged span; parts that are switched off are absent.
    """
    report = progress or (lambda _: None)
    mounts = used_mounts(scenario)
    response = load_response(aircraft, scenario.field.eddy.model, mounts=mounts) if response is None else response
    report(0.1)
    # Spline fits call LAPACK: on one thread they give the same bits everywhere.
    with one_blas_thread():
        background = background or backgrounds_of(scenario, flight, ground)["carrier"]
        situation = situation_of(scenario, aircraft, response, background, mounts)
        report(0.5)
        return compose(FlightExcitation(situation), aircraft, background, report)


def compose(
    excitation: FlightExcitation, vehicle: Vehicle, background: Background, report: Progress = lambda _: None
) -> FieldTruth:
    """Compute every part at the mounts of a situation.

    Parameters
    ----------
    excitation : FlightExcitation
    vehicle : Vehicle
    background : Background
        Of the situation.
    report : callable
        Called with shares from 0.5 to 1.
    """
    situation = excitation.situation
    parts = dict(situation.background)
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
        bent = _bend(parts, excitation, bending, background, response_at(vehicle, places, eddy))
    onboard = excitation.onboard if "electronics" in parts else Onboard()
    return FieldTruth(
        situation.time_s,
        situation.mounts,
        {name: given_up(part) for name, part in parts.items()},
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
    parts: dict[str, np.ndarray],
    excitation: FlightExcitation,
    bending: flex.Bending,
    background: Background,
    response: AircraftResponse,
) -> dict[str, np.ndarray]:
    """Add to every part the change by the motion of the bent mounts, from the part's own gradient there.

    Return the sum of the changes at each of these mounts, (n, 3) [nT].
    """
    situation = excitation.situation
    arms = response.positions_m - situation.passage.path.reference_b
    around = background.at(dict(zip(response.mounts, arms, strict=True)))
    rows = response.rows(response.mounts)
    whole = {mount: np.zeros_like(shift) for mount, shift in bending.shifts_b.items()}
    for name, part in parts.items():
        if name in around:
            changes, scale = flex.moved(np.swapaxes(around[name], 0, 1), bending.shifts_b), 1.0
        else:
            found = PARTS[name].field(excitation, response, rows)
            assert found is not None  # it is among the parts of this aircraft
            changes, scale = flex.moved(found, bending.shifts_b), _scale(excitation, name)
        parts[name] = np.array(part)
        for mount, change in changes.items():
            parts[name][:, situation.mounts.index(mount)] += scale * change
            whole[mount] += scale * change
    return whole

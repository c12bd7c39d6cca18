"""The field of a tow: every part at the mounts of the carrier and of its bird."""

from collections.abc import Callable, Mapping
from dataclasses import replace

from magsim.aircraft import Aircraft, Bird
from magsim.field.background.whole import Background
from magsim.field.composition import backgrounds_of, compose, situation_of
from magsim.field.excitation import FlightExcitation
from magsim.field.response import load_response
from magsim.field.situation import used_mounts
from magsim.field.tow.carrier import carrier_field
from magsim.field.tow.steady import steady_background
from magsim.scenario import Scenario
from magsim.terrain import Ground
from magsim.threads import one_blas_thread
from magsim.trajectory import Flight
from magsim.truth import FieldTruth


def compute_tow_field(
    scenario: Scenario,
    aircraft: Aircraft,
    bird: Bird,
    flight: Flight,
    *,
    ground: Ground | None = None,
    backgrounds: Mapping[str, Background] | None = None,
    progress: Callable[[float], None] | None = None,
) -> dict[str, FieldTruth]:
    """Compute every part of the field at every mount of a carrier and of its bird.

    Parameters
    ----------
    scenario : Scenario
    aircraft : Aircraft
    bird : Bird
    flight : Flight
        With a bird.
    ground : Ground, optional
    backgrounds : mapping of str to Background, optional
        Those of the flight, where they are known already; see ``backgrounds_of``.
    progress : callable, optional
        Called with the share of the work that is done, from 0 to 1.

    Returns
    -------
    dict of str to FieldTruth
        ``carrier``, with as many mounts as carry sensors, and ``bird``, whose parts hold ``carrier`` too, and whose
        ``steady_nt`` is the background on the smooth track. Each is in the axes of its body.

    Raises
    ------
    RequestError
        If the bird comes too near to the carrier's metal.
    ValueError
        If nothing is towed.
    """
    report = progress or (lambda _: None)
    with one_blas_thread():
        known = backgrounds or backgrounds_of(scenario, flight, ground)
        mounts, mounts_below = used_mounts(scenario), used_mounts(scenario, "bird")
        response = load_response(aircraft, scenario.field.eddy.model, mounts=mounts)
        carrier = situation_of(scenario, aircraft, response, known["carrier"], mounts)
        above = FlightExcitation(carrier)
        report(0.3)
        truths = {"carrier": compose(above, aircraft, known["carrier"])}
        report(0.4)
        own = load_response(bird, mounts=mounts_below)
        below = situation_of(scenario, bird, own, known["bird"], mounts_below)
        report(0.6)
        truth = compose(FlightExcitation(below), bird, known["bird"])
        report(0.7)
        parts = dict(truth.parts_b)
        if below.mounts and scenario.field.is_on("carrier"):
            parts["carrier"] = scenario.field.carrier.scale * carrier_field(above, aircraft, below)
        report(0.9)
        scalars = dict.fromkeys(sensor.mount for sensor in scenario.sensors.scalar if sensor.body == "bird")
        steady = {mount: steady_background(below, mount) for mount in scalars}
        report(1.0)
    return truths | {"bird": replace(truth, parts_b=parts, steady_nt=steady)}

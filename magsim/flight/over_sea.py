"""A path over the sea: where waves are asked for, no part of it lies above land."""

import numpy as np

from magsim.aircraft import Aircraft
from magsim.errors import RequestError
from magsim.flight.carriers.planning import plan_flight
from magsim.scenario import Scenario, TrackPattern
from magsim.terrain import Ground, TangentPlane

STEP_M = 50.0
"""Between the points of a path at which the ground is looked up."""


def check_over_sea(scenario: Scenario, aircraft: Aircraft, ground: Ground | None) -> None:
    """Refuse a swell where the path that will be flown crosses land; the flight itself may still drift over a coast.

    Raises
    ------
    RequestError
        With the first leg that crosses land.
    DataError
        If the path leaves a terrain grid.
    """
    if ground is None or ground.level or not scenario.field.is_on("swell"):
        return  # level ground that is not the sea is refused with the scenario
    if isinstance(scenario.pattern, TrackPattern):
        return  # checked with the scenario, too
    plan = plan_flight(scenario, aircraft.facts, ground)
    surface = TangentPlane(plan.plane.lat_rad, plan.plane.lon_rad, plan.plane.alt_m)
    for element in plan.path:
        points = [element.at(along) for along in np.arange(0.0, element.length_m, STEP_M).tolist()]
        lat, lon = surface.geodetic(np.array([p.north_m for p in points]), np.array([p.east_m for p in points]))
        land_m = float(ground.surface.height(lat, lon).max(initial=0.0))
        if land_m > 0.0:
            part = f"the turn after leg {element.leg}" if element.turn else f"leg {element.leg}"
            msg = (
                f"field.swell: waves need the sea, and {part} of circuit {element.circuit} crosses land, up to "
                f"{land_m:.3g} m high; allowed: over the sea, where [terrain] is 0 m high or left out"
            )
            raise RequestError(msg)

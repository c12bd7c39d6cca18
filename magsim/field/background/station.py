"""The field at a base station: a point that stays on the ground."""

import numpy as np

from magsim.earth import LocalFrame, igrf
from magsim.errors import DataError
from magsim.field.background.crust import crust_of
from magsim.field.background.departure import departure_at
from magsim.field.background.main_field import years_of
from magsim.field.background.targets import geodetic_of, ground_height, sources_of
from magsim.field.background.variation import variation_e
from magsim.scenario import BaseStation, Scenario
from magsim.terrain import Ground


def station_field(station: BaseStation, scenario: Scenario, ground: Ground | None, time_s: np.ndarray) -> np.ndarray:
    """Return the background at a base station: main field with its departure, crust, targets and variation.

    Parameters
    ----------
    station : BaseStation
    scenario : Scenario
    ground : Ground, optional
    time_s : (n,) [s]
        Evenly spaced: those of the flight, so that the variation is that of the flight.

    Returns
    -------
    (n, 3) [nT]
        North, east, down at the station.

    Raises
    ------
    DataError
        If the station stands below the plane of the crust, inside a body, or outside a terrain grid.
    """
    lat, lon = geodetic_of(station, scenario.start)
    frame = LocalFrame(lat, lon, ground_height(ground, lat, lon) + station.height_m)
    ends = years_of(scenario, time_s[[0, -1]])
    main = igrf(lat, lon, frame.alt_m, ends)
    share = (time_s - time_s[0]) / (time_s[-1] - time_s[0])
    # The model is linear in time; over the hours of a flight a straight line is exact but for a change of epoch.
    field_n = main[0] + share[:, None] * (main[1] - main[0])
    changing_e = variation_e(scenario, time_s)
    if scenario.field.is_on("departure"):
        changing_e = changing_e + departure_at(scenario, frame, time_s)
    changing_n = np.einsum("ij,nj->ni", frame.rot_ne, changing_e)
    return field_n + constant_n(station, scenario, ground, frame) + changing_n


def constant_n(station: BaseStation, scenario: Scenario, ground: Ground | None, frame: LocalFrame) -> np.ndarray:
    """Return the field of crust and targets at the station, (3,) [nT] north, east, down."""
    place_e, field_e = frame.origin_e[None], np.zeros((1, 3))
    where = f"sensors.base: the station {station.name!r}"
    if scenario.field.is_on("crust"):
        crust = crust_of(scenario, ground)
        height = float(crust.height(place_e)[0])
        if height < 0.0:
            msg = (
                f"{where} stands {-height:.1f} m below the plane of the crust, {crust.frame.alt_m:.1f} m above the "
                f"ellipsoid at the start point; allowed: field.crust.plane_m = "
                f"{np.floor(crust.frame.alt_m + height):g} or lower"
            )
            raise DataError(msg)
        field_e = field_e + crust.field_e(place_e)
    for source in sources_of(scenario, ground):
        if source.distance(place_e)[0] <= 0.0:
            msg = f"{where} is inside the {source.kind} {source.name!r}; allowed: places outside of every body"
            raise DataError(msg)
        field_e = field_e + source.field_e(place_e)
    return np.einsum("ij,j->i", frame.rot_ne, field_e[0])

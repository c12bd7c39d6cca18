"""The carrier's field at its bird.

The carrier moves relative to the bird. The field of its linear parts is a sum of gains times strengths, whose gains are
interpolated around it; dipoles that turn are followed one by one.
"""

import numpy as np

from magsim.aircraft import Aircraft
from magsim.errors import RequestError
from magsim.field import parts
from magsim.field.background.path import positions_along
from magsim.field.excitation import FlightExcitation
from magsim.field.response import response_at
from magsim.field.situation import Situation
from magsim.field.tow.around import Around
from magsim.frames import rotate, rotate_back

DEGREES = ((4, 4, 2), (6, 6, 3), (8, 8, 4))
"""Degrees of the interpolation in two directions and inverse distance, tried in turn."""

TOLERANCE = 1e-3
"""Largest error of the interpolation, as a part of the carrier's field."""

CHECKS = 12
"""Places of the flight at which it is compared with the response itself."""


def carrier_field(above: FlightExcitation, aircraft: Aircraft, below: Situation) -> np.ndarray:
    """Return the carrier's field at the mounts of its bird, (n, s, 3) [nT] in the bird's axes.

    Parameters
    ----------
    above : FlightExcitation
        Of the carrier.
    aircraft : Aircraft
    below : Situation
        Of the bird.
    """
    carrier, passage, rot_be = above.situation, below.passage, above.situation.passage.rot_be
    arms_b = below.positions_m - passage.path.reference_b
    away_e = positions_along(passage.path, arms_b, passage.time_s)
    away_e = away_e - carrier.passage.path.motion_e_at(passage.time_s)[0][:, None]
    places = rotate(rot_be[:, None], away_e) + carrier.passage.path.reference_b
    field = linear_field(above, aircraft, places) + turning_field(above, places)
    return rotate(passage.rot_be[:, None], rotate_back(rot_be[:, None], field))


def linear_field(above: FlightExcitation, aircraft: Aircraft, places: np.ndarray) -> np.ndarray:
    """Return the field of the carrier's linear parts at moving places.

    Parameters
    ----------
    above : FlightExcitation
    aircraft : Aircraft
    places : (n, s, 3) [m]
        Carrier axes from its datum.

    Returns
    -------
    (n, s, 3) [nT]
        Carrier axes.

    Raises
    ------
    RequestError
        If the places are so near to the metal that no interpolation meets the tolerance.
    """
    strengths = parts.strengths(above, above.situation.response)

    def gains_at(points: np.ndarray) -> np.ndarray:
        nodes = {f"node {i}": tuple(point) for i, point in enumerate(points.tolist())}
        return parts.gains(response_at(aircraft, nodes, above.settings.eddy.model))

    around = Around.of(places)
    checked = places.reshape(-1, 3)[np.linspace(0, places.size // 3 - 1, CHECKS).astype(int)]
    when = np.linspace(0, len(strengths) - 1, CHECKS).astype(int)
    exact = np.einsum("pic,pc->pi", gains_at(checked), strengths[when])
    for degrees in DEGREES:
        table = around.fitted(gains_at, degrees)
        missed = np.abs(around.at(checked[:, None], table, strengths[when])[:, 0] - exact).max()
        if missed <= TOLERANCE * np.abs(exact).max():
            return around.at(places, table, strengths)
    msg = (
        f"tow.rope: the bird swings so near to the metal of {aircraft.name} that its field there is known to "
        f"{missed:.2g} nT of {np.abs(exact).max():.2g} nT only; allowed: a longer rope, a hook farther off, or "
        "field.carrier.enabled = false"
    )
    raise RequestError(msg)


def turning_field(above: FlightExcitation, places: np.ndarray) -> np.ndarray:
    """Return the field of the carrier's turning parts at moving places, (n, s, 3) [nT] carrier axes.

    Parameters
    ----------
    above : FlightExcitation
    places : (n, s, 3) [m]
        Carrier axes from its datum.
    """
    out = np.zeros_like(places)
    for scale, dipole in parts.turning(above):
        out += scale * dipole.along(places)
    return out

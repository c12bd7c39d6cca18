"""The field in a towed bird: the bird's own parts, the carrier's field at the bird, and what swinging changes.

The carrier moves relative to the bird. Its field at a place is a sum over its sources (fixed moments, ambient field,
modes of eddy currents, currents of feeders) of a coefficient of the place times the source's strength. Times the cube
of the distance, such a coefficient hardly changes over the places where a bird swings: it is computed at few nodes and
interpolated in direction and inverse distance. What turns or rotates is followed as dipoles.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.polynomial import chebyshev
from scipy.interpolate import CubicSpline
from scipy.linalg import solveh_banded
from threadpoolctl import threadpool_limits

from magsim.aircraft import Aircraft, Bird
from magsim.earth import ecef_from_geodetic, geodetic_from_ecef, rot_ne_at
from magsim.errors import RequestError
from magsim.field.background.path import in_body, positions_along
from magsim.field.composition import compose, with_background
from magsim.field.platform import eddy_states, hinged_turns
from magsim.field.response import AircraftResponse, load_response, response_at
from magsim.field.situation import Situation, used_mounts
from magsim.field.sources.dipoles import dipole_field, hinged_motion
from magsim.field.sources.memory import remembered
from magsim.field.sources.rotors import rotating_moments
from magsim.frames import rotate, rotate_back
from magsim.scenario import Scenario
from magsim.signals import HIGH_PASS_HZ
from magsim.terrain import Ground
from magsim.trajectory import Flight, Trajectory
from magsim.truth import FieldTruth

DEGREES = ((4, 4, 2), (6, 6, 3), (8, 8, 4))
"""Degrees of the interpolation in two directions and inverse distance, tried in turn."""

TOLERANCE = 1e-3
"""What it may miss of the carrier's field."""

CHECKS = 12
"""Places of the flight at which it is held against the response itself."""

CHUNK = 8192
"""Samples that are interpolated at once."""

SMOOTH_HZ = 2.0
"""Rate at which a path is smoothed."""


def compute_tow_field(
    scenario: Scenario,
    aircraft: Aircraft,
    bird: Bird,
    flight: Flight,
    *,
    ground: Ground | None = None,
    progress: Callable[[float], None] | None = None,
) -> dict[str, FieldTruth]:
    """Every part of the field at every mount of a carrier and of its bird.

    Parameters
    ----------
    scenario : Scenario
    aircraft : Aircraft
    bird : Bird
    flight : Flight
        With a bird.
    ground : Ground, optional
    progress : callable, optional
        Told the share of the work that is done, from 0 to 1.

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
    tell = progress or (lambda _: None)
    with threadpool_limits(limits=1, user_api="blas"):
        response = load_response(aircraft, scenario.field.eddy.model)
        above = with_background(Situation.of(scenario, aircraft.magnetics, flight, response, ground))
        tell(0.3)
        truths = {"carrier": compose(above, aircraft)}
        tell(0.4)
        own = load_response(bird)
        mounts = used_mounts(scenario, "bird")
        # carrier and bird are logged at rates of their own, which need not end together
        time_s = above.time_s
        below = Situation.of(scenario, bird.magnetics, flight.of_bird(), own, ground, mounts=mounts, time_s=time_s)
        below = with_background(below)
        tell(0.6)
        truth = compose(below, bird)
        tell(0.7)
        parts = dict(truth.parts_b)
        if below.mounts and scenario.field.is_on("carrier"):
            parts["carrier"] = scenario.field.carrier.scale * carrier_field(above, aircraft, below)
        tell(0.9)
        scalars = dict.fromkeys(sensor.mount for sensor in scenario.sensors.scalar if sensor.body == "bird")
        steady = {mount: steady_background(below, mount) for mount in scalars}
        tell(1.0)
    return truths | {"bird": replace(truth, parts_b=parts, steady_nt=steady)}


# ---- the carrier's field at the bird ---------------------------------------------------------------------------


def carrier_field(above: Situation, aircraft: Aircraft, below: Situation) -> np.ndarray:
    """The carrier's field at the mounts of its bird, (n, s, 3) [nT] in the bird's axes.

    Parameters
    ----------
    above : Situation
        Of the carrier, with its background.
    aircraft : Aircraft
    below : Situation
        Of the bird.
    """
    rot_be = _earth_axes(above)
    center_e = ecef_from_geodetic(above.motion.lat_rad, above.motion.lon_rad, above.motion.alt_m)
    places_e = positions_along(below.motion, below.arms_b[:-1])
    places = rotate(rot_be[:, None], places_e - center_e[:, None]) + above.motion.reference_b
    field = metal_field(above, aircraft, places) + turning_field(above, places)
    return in_body(below, rotate_back(rot_be[:, None], field))


def _earth_axes(situation: Situation) -> np.ndarray:
    """Rotations from Earth-fixed to body axes, (n, 3, 3)."""
    rot_ne = rot_ne_at(situation.motion.lat_rad, situation.motion.lon_rad)
    return np.einsum("nij,nik->njk", situation.rot_nb, rot_ne)


def sources(above: Situation) -> np.ndarray:
    """Strengths of the carrier's sources along the flight, in the order of ``coefficients``, (n, 4 + k + c).

    1 for the fixed moments, the ambient field [nT] (3), states of the k eddy modes, currents of the c feeders [A];
    each times the scale of its part, 0 where it is off.
    """
    field, count = above.scenario.field, len(above.time_s)
    out = [np.full((count, 1), field.permanent.scale * field.is_on("permanent"))]
    ambient = np.zeros((count, 3))
    if field.is_on("induced"):
        ambient = ambient + field.induced.scale * above.ambient_b
    state = remembered(above) if field.is_on("memory") else None
    if state is not None:
        ambient = ambient + field.memory.scale * state
    out.append(ambient)
    modes = np.zeros((count, len(above.response.tau_s)))
    if field.is_on("eddy"):
        modes = field.eddy.scale * eddy_states(above.response, above.ambient_rate_b, above.step_s, field.eddy)
    out.append(modes)
    drawn = np.zeros((count, above.response.wiring_nt_per_a.shape[2]))
    if field.is_on("electronics") and above.onboard.currents_a:
        drawn = field.electronics.scale * np.column_stack(list(above.onboard.currents_a.values()))
    return np.hstack([*out, drawn])


def coefficients(response: AircraftResponse) -> np.ndarray:
    """Field for each strength of ``sources`` at the places of a response, (p, 3, 4 + k + c) [nT]."""
    permanent = response.permanent_nt[:, :, None]
    return np.concatenate([permanent, response.induced, response.field, response.wiring_nt_per_a], axis=2)


def metal_field(above: Situation, aircraft: Aircraft, places: np.ndarray) -> np.ndarray:
    """Field of the carrier's fixed moments, steel, eddy currents and wiring at moving places.

    Parameters
    ----------
    above : Situation
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
    strengths = sources(above)
    around = Around.of(places)
    looks = places.reshape(-1, 3)[np.linspace(0, places.size // 3 - 1, CHECKS).astype(int)]
    when = np.linspace(0, len(strengths) - 1, CHECKS).astype(int)
    eddy = above.scenario.field.eddy.model
    exact = np.einsum("pic,pc->pi", coefficients(_response(aircraft, looks, eddy)), strengths[when])
    for degrees in DEGREES:
        table = around.fitted(lambda nodes: coefficients(_response(aircraft, nodes, eddy)), degrees)
        missed = np.abs(around.at(looks[:, None], table, strengths[when])[:, 0] - exact).max()
        if missed <= TOLERANCE * np.abs(exact).max():
            return around.at(places, table, strengths)
    msg = (
        f"tow.rope: the bird swings so near to the metal of {aircraft.name} that its field there is known to "
        f"{missed:.2g} nT of {np.abs(exact).max():.2g} nT only; allowed: a longer rope, a hook farther off, or "
        "field.carrier.enabled = false"
    )
    raise RequestError(msg)


def _response(aircraft: Aircraft, points: np.ndarray, eddy: str | None) -> AircraftResponse:
    places = {f"node {i}": tuple(point) for i, point in enumerate(points.tolist())}
    return response_at(aircraft, places, eddy, full=False)


class Around:
    """Coordinates in which a far field is nearly a constant: two directions and the inverse distance.

    Parameters
    ----------
    axes : (3, 3)
        Rows: two directions across, and the middle direction from the datum.
    low, high : (3,)
        Ranges of the coordinates.
    """

    def __init__(self, axes: np.ndarray, low: np.ndarray, high: np.ndarray) -> None:
        self.axes, self.middle, self.half = axes, 0.5 * (low + high), 0.5 * (high - low)

    @classmethod
    def of(cls, places: np.ndarray) -> "Around":
        """Coordinates for places (n, s, 3) [m]."""
        flat = places.reshape(-1, 3)
        ahead = flat.mean(axis=0)
        ahead = ahead / np.linalg.norm(ahead)
        across = np.eye(3)[np.abs(ahead).argmin()]
        first = np.cross(ahead, across)
        first /= np.linalg.norm(first)
        axes = np.stack([first, np.cross(ahead, first), ahead])
        values, _ = _coordinates(axes, flat)
        low, high = values.min(axis=0), values.max(axis=0)
        room = 0.02 * (high - low) + 1e-6 * np.abs(high).max()
        return cls(axes, low - room, high + room)

    def fitted(self, respond: Callable[[np.ndarray], np.ndarray], degrees: tuple[int, int, int]) -> "Table":
        """Polynomials through nodes: ``respond`` makes (p, 3, c) of places (p, 3)."""
        knots = [np.cos(np.pi * (np.arange(d + 1) + 0.5) / (d + 1)) for d in degrees]
        scaled = np.stack(np.meshgrid(*knots, indexing="ij"), axis=-1).reshape(-1, 3)
        u, v, w = (self.middle + self.half * scaled).T
        ray = np.column_stack([u, v, np.ones_like(u)])
        ray *= (1.0 / (w * np.sqrt(np.einsum("pi,pi->p", ray, ray))))[:, None]
        values = respond(ray @ self.axes) / w[:, None, None] ** 3
        shape = tuple(d + 1 for d in degrees)
        table = values.reshape(*shape, -1)
        for axis, (count, knot) in enumerate(zip(shape, knots, strict=True)):
            inverse = np.linalg.inv(chebyshev.chebvander(knot, count - 1))
            table = np.moveaxis(np.tensordot(inverse, table, axes=(1, axis)), 0, axis)
        return Table(degrees, table.reshape(-1, *values.shape[1:]))

    def at(self, places: np.ndarray, table: "Table", strengths: np.ndarray) -> np.ndarray:
        """Field at places (n, s, 3) of sources of given strengths (n, c), (n, s, 3)."""
        out = np.empty_like(places)
        for first in range(0, len(places), CHUNK):
            rows = slice(first, first + CHUNK)
            for s in range(places.shape[1]):
                values, cubed = _coordinates(self.axes, places[rows, s])
                scaled = (values - self.middle) / self.half
                # summed over the sources first: one number for each axis and polynomial
                basis = chebyshev.chebvander3d(*scaled.T, table.degrees)
                strength = np.einsum("nc,mic->nmi", strengths[rows], table.values, optimize=True)
                out[rows, s] = np.einsum("nm,nmi->ni", basis, strength) * cubed[:, None]
        return out


class Table:
    """Coefficients of the polynomials, (m, 3, c), and their degrees."""

    def __init__(self, degrees: tuple[int, int, int], values: np.ndarray) -> None:
        self.degrees, self.values = list(degrees), values


def _coordinates(axes: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates of places (n, 3), and the inverse cube of the distance from the datum."""
    first, second, ahead = (np.einsum("ni,i->n", places, axis) for axis in axes)
    inverse = 1.0 / np.sqrt(np.einsum("ni,ni->n", places, places))
    return np.column_stack([first / ahead, second / ahead, inverse]), inverse**3


def turning_field(above: Situation, places: np.ndarray) -> np.ndarray:
    """Field of the carrier's dipoles on control surfaces and of what rotates, carrier axes, (n, s, 3) [nT].

    Places (n, s, 3) [m] move; carrier axes from its datum.
    """
    field = above.scenario.field
    out = np.zeros_like(places)
    if field.is_on("hinged"):
        for dipole, cos, sin in hinged_turns(above):
            position, moment = hinged_motion(dipole, cos, sin)
            out += field.hinged.scale * dipole_field(position[:, None], moment[:, None], places)
    if field.is_on("propeller"):
        for part, moment in rotating_moments(above):
            out += field.propeller.scale * dipole_field(part.position, moment[:, None], places)
    return out


# ---- the smooth track ------------------------------------------------------------------------------------------


def steady_background(below: Situation, mount: str) -> np.ndarray:
    """Length of the background where a mount would be without swing, (n,) [nT].

    Parameters
    ----------
    below : Situation
        Of the bird.
    mount : str
    """
    path, arm_b = below.flight.carrier, below.positions_m[below.mounts.index(mount)] - below.motion.reference_b
    places_e = positions_along(path, arm_b[None])[:, 0]
    smooth = smoothed(path, places_e)
    flight = replace(below.flight, carrier=smooth)
    still = Situation.of(
        below.scenario, below.magnetics, flight, below.response, below.ground, mounts=(), time_s=below.time_s
    )
    field_b = with_background(still).ambient_b
    return np.sqrt(np.einsum("ni,ni->n", field_b, field_b))


def smoothed(path: Trajectory, places_e: np.ndarray) -> Trajectory:
    """A body's path with the places of a smooth one: what is slower than 0.03 Hz.

    Of all rows of places the one with the least sum of squared distances and ``l`` times that of squared third
    differences (Whittaker; Eilers, Analytical Chemistry 75 (2003) 3631), with ``l`` such that half of a motion of that
    frequency is left. It passes parabolas unchanged, to its ends; there it follows a part of a swing too: within 10 s
    some tenths of it, within 30 s some hundredths.

    Parameters
    ----------
    path : Trajectory
        Gives times and attitude.
    places_e : (n, 3) [m]
        At its rows, Earth-fixed.
    """
    span = path.time_s[-1] - path.time_s[0]
    knots = np.linspace(path.time_s[0], path.time_s[-1], max(8, round(span * SMOOTH_HZ) + 1))
    origin = places_e[0]
    rows = CubicSpline(path.time_s, places_e - origin)(knots)
    weight = (2.0 * np.sin(np.pi * HIGH_PASS_HZ * (knots[1] - knots[0]))) ** -6
    curve = CubicSpline(knots, whittaker(rows, weight))
    lat, lon, alt = geodetic_from_ecef(origin + curve(path.time_s))
    velocity_n = rotate(rot_ne_at(lat, lon), curve(path.time_s, 1))
    lon += 2.0 * np.pi * np.round((path.lon_rad - lon) / (2.0 * np.pi))
    return replace(path, lat_rad=lat, lon_rad=lon, alt_m=alt, velocity_n=velocity_n)


def whittaker(values: np.ndarray, weight: float) -> np.ndarray:
    """Rows (n, c) smoothed by a weight on their squared third differences."""
    count = len(values)
    third = np.zeros((count - 3, 4)) + np.array([-1.0, 3.0, -3.0, 1.0])
    band = np.zeros((4, count))
    band[3] = 1.0
    for i in range(4):
        for j in range(i, 4):
            band[3 - (j - i), j : j + count - 3] += weight * third[:, i] * third[:, j]
    return solveh_banded(band, values)

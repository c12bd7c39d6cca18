"""The field of a flight: every part at every mount that carries a sensor, at the simulation rate."""

from collections.abc import Callable

import numpy as np
from scipy.interpolate import CubicSpline
from threadpoolctl import threadpool_limits

from magsim.aircraft import Aircraft
from magsim.columns import COMPONENTS
from magsim.earth import decimal_year, decimal_years, igrf
from magsim.field.dipoles import hinged_field
from magsim.field.eddy import derivative, step_rate
from magsim.field.response import AircraftResponse, load_response
from magsim.frames import rot_nb_from_attitude, rotate_back
from magsim.scenario import Eddy, Scenario
from magsim.trajectory import Flight, Trajectory
from magsim.truth import FieldTruth

KNOT_HZ = 8.0
"""Rate at which the Earth's field is evaluated along the path; a cubic spline joins the knots.

At 75 m/s a knot every 10 m: the field follows the path, 0.02 nT a meter, not the attitude.
"""

Progress = Callable[[float], None]


def used_mounts(scenario: Scenario) -> tuple[str, ...]:
    """Mounts of all magnetic sensors of a scenario, in the order of first use."""
    sensors = (*scenario.sensors.scalar, *scenario.sensors.fluxgate)
    return tuple(dict.fromkeys(sensor.mount for sensor in sensors))


def simulation_times(flight: Flight) -> np.ndarray:
    """Sample times inside the logged span at the simulation rate, (n,) [s]; 0 is one of them."""
    rate, logged = flight.simulation_rate_hz, flight.carrier.time_s
    first, last = np.ceil(logged[0] * rate - 1e-6), np.floor(logged[-1] * rate + 1e-6)
    return np.arange(int(first), int(last) + 1) / rate


def earth_along(
    scenario: Scenario, carrier: Trajectory, time_s: np.ndarray, *, knot_hz: float = KNOT_HZ
) -> tuple[np.ndarray, np.ndarray]:
    """IGRF-14 at the reference point of the carrier, by cubic splines through few knots of paired place and time.

    Parameters
    ----------
    scenario : Scenario
        Gives the time of row 0.
    carrier : Trajectory
    time_s : (n,) [s]
    knot_hz : float
        Knots per second.

    Returns
    -------
    field_n : (n, 3) [nT]
        North, east, down.
    gradient_n : (n, 3, 3) [nT/m]
    """
    count = max(8, int(np.ceil((time_s[-1] - time_s[0]) * knot_hz)) + 1)
    knots = np.linspace(time_s[0], time_s[-1], count)
    path = carrier.at(knots)
    year = decimal_years(scenario.start.time_utc, knots)
    field, gradient = igrf(path.lat_rad, path.lon_rad, path.alt_m, year, gradient=True)
    # The gradient has no curl: six numbers hold it.
    rows, columns = np.triu_indices(3)
    table = CubicSpline(knots, np.column_stack([field, gradient[:, rows, columns]]))(time_s)
    full = np.empty((len(time_s), 3, 3))
    full[:, rows, columns] = full[:, columns, rows] = table[:, 3:]
    return table[:, :3], full


def earth_at_start(scenario: Scenario) -> np.ndarray:
    """IGRF-14 at the start point and time, (3,) [nT] north, east, down."""
    start = scenario.start
    place = np.radians([start.lat_deg]), np.radians([start.lon_deg]), np.array([start.alt_m])
    return np.asarray(igrf(*place, np.array([decimal_year(start.time_utc)])))[0]


def _earth(
    scenario: Scenario, carrier: Trajectory, motion: Trajectory, positions: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Ambient field in body axes: ``B_0`` (n, 3) at the reference point, and (n, s, 3) at each mount."""
    rot_nb = rot_nb_from_attitude(motion.attitude)
    if not scenario.field.earth.along_path:
        ambient = rotate_back(rot_nb, earth_at_start(scenario))
        return ambient, np.repeat(ambient[:, None, :], len(positions), axis=1)
    field_n, gradient_n = earth_along(scenario, carrier, motion.time_s)
    ambient = rotate_back(rot_nb, field_n)
    at_mounts = np.empty((len(ambient), len(positions), 3))
    for s, position in enumerate(positions):
        arm_n = np.einsum("nij,j->ni", rot_nb, position - motion.reference_b)
        at_mounts[:, s] = ambient + rotate_back(rot_nb, np.einsum("nij,nj->ni", gradient_n, arm_n))
    return ambient, at_mounts


def _hinged(response: AircraftResponse, flight: Flight, time_s: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Field of the dipoles on control surfaces, (n, s, 3) [nT]; a surface that the flight does not move rests."""
    out = np.zeros((len(time_s), len(positions), 3))
    turns = {name: (np.cos(angle), np.sin(angle)) for name, angle in flight.controls_at(time_s).items()}
    rest = np.ones(1), np.zeros(1)
    for dipole in response.hinged:
        cos, sin = turns.get(dipole.surface, rest)
        for s, position in enumerate(positions):
            out[:, s] += hinged_field(dipole, cos, sin, position)
    return out


def eddy_field(response: AircraftResponse, rows: np.ndarray, rate: np.ndarray, step_s: float, part: Eddy) -> np.ndarray:
    """Field of the eddy currents.

    Parameters
    ----------
    response : AircraftResponse
    rows : (s,) int
        Mounts, as rows of the response.
    rate : (n, 3) [nT/s]
        Time derivative of the ambient field in body axes.
    step_s : float [s]
    part : Eddy
        ``lag = False``: proportional to ``rate``, without time constants.

    Returns
    -------
    (n, s, 3) [nT]
    """
    if not part.lag:
        return np.einsum("sij,nj->nsi", response.eddy_slow_s[rows], rate)
    out = np.zeros((len(rate), len(rows), 3))
    for k, tau in enumerate(response.tau_s):
        state = step_rate(tau, np.einsum("i,ni->n", response.drive[k], rate), step_s)
        out += state[:, None, None] * response.field[rows, :, k]
    return out


def compute_field(
    scenario: Scenario,
    aircraft: Aircraft,
    flight: Flight,
    response: AircraftResponse | None = None,
    *,
    progress: Progress | None = None,
) -> FieldTruth:
    """Every part of the field at every mount that carries a sensor.

    The whole is ``B_earth + B_permanent + sum B_hinged + D B_0 + B_eddy`` with ``B_0`` the ambient field in body axes
    at the carrier's reference point.

    Parameters
    ----------
    scenario : Scenario
        Which physics is on, where and when, which mounts.
    aircraft : Aircraft
    flight : Flight
    response : AircraftResponse, optional
        Computed or read from the cache when it is not given.
    progress : callable, optional
        Told the share of the work that is done, from 0 to 1.

    Returns
    -------
    FieldTruth
        At the simulation rate over the whole logged span; parts that are switched off are zero.
    """
    tell = progress or (lambda _: None)
    response = load_response(aircraft) if response is None else response
    tell(0.1)
    # Spline fits call LAPACK: on one thread they give the same bits everywhere.
    with threadpool_limits(limits=1, user_api="blas"):
        return _compose(scenario, response, flight, tell)


def _compose(scenario: Scenario, response: AircraftResponse, flight: Flight, tell: Progress) -> FieldTruth:
    mounts, settings = used_mounts(scenario), scenario.field
    rows = response.rows(mounts)
    positions = response.positions_m[rows]
    time_s, step_s = simulation_times(flight), 1.0 / flight.simulation_rate_hz
    motion = flight.carrier.at(time_s)
    shape = (len(time_s), len(mounts), 3)
    parts: dict[str, np.ndarray] = {}
    ambient, parts["earth"] = _earth(scenario, flight.carrier, motion, positions)
    tell(0.5)
    makers = {
        "permanent": lambda: np.broadcast_to(response.permanent_nt[rows], shape),
        "hinged": lambda: _hinged(response, flight, time_s, positions),
        "induced": lambda: np.einsum("sij,nj->nsi", response.induced[rows], ambient),
        "eddy": lambda: eddy_field(response, rows, derivative(ambient, step_s), step_s, settings.eddy),
    }
    for name, make in makers.items():
        part = getattr(settings, name)
        parts[name] = part.scale * make() if part.enabled else np.zeros(shape)
        tell(0.5 + 0.5 * len(parts) / len(COMPONENTS))
    for part in parts.values():
        part.flags.writeable = False  # handed over, not copied
    return FieldTruth(time_s, mounts, {name: parts[name] for name in COMPONENTS})

"""Where should the magnetometer go? Interference predicted at many places from one flight, by superposition.

In band the aircraft's effect on a scalar reading is, to first order, its field along the background. That is linear
in few time series of the flight (direction cosines, ambient field and its derivatives, deflections, currents); the
place only weighs them. So the flight is filtered once, and a place costs no more than its response.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np
from threadpoolctl import threadpool_limits

from magsim import columns, metrics, signals
from magsim.aircraft import Aircraft
from magsim.arrays import readonly
from magsim.earth import decimal_years, igrf
from magsim.errors import RequestError
from magsim.field import AircraftResponse, response_at
from magsim.field.sources.dipoles import HingedDipole, dipole_field
from magsim.frames import rot_nb_from_attitude, rotate_about, rotate_back
from magsim.recording import Recording

HINGE_STEP_RAD = 0.2
"""Deflection at which the field of a hinged dipole is sampled: between the samples it is a circle to 0.1 %."""

TERMS = tuple((i, j) for i in range(3) for j in range(3))


@dataclass(frozen=True)
class Prediction:
    """Interference predicted at places, in the compensation band over the maneuvers of a flight.

    Attributes
    ----------
    names : tuple of str
    positions_m : (p, 3) [m]
        Body axes.
    fom_nt, fom_left_nt : (p,) [nT]
        Figure of merit (sum over headings and maneuvers of the peak to peak): as it is, and after Tolles-Lawson with
        18 terms has been fitted to the same rows.
    std_nt, std_left_nt : (p,) [nT]
        Standard deviation, likewise.
    cells : int
        Number of headings and maneuvers that the figure of merit sums; a figure-of-merit flight has 12.
    """

    names: tuple[str, ...]
    positions_m: np.ndarray
    fom_nt: np.ndarray
    fom_left_nt: np.ndarray
    std_nt: np.ndarray
    std_left_nt: np.ndarray
    cells: int

    def __post_init__(self) -> None:
        for name in ("positions_m", "fom_nt", "fom_left_nt", "std_nt", "std_left_nt"):
            object.__setattr__(self, name, readonly(getattr(self, name)))


class FlightSeries:
    """The time series of a flight that every place shares.

    Parameters
    ----------
    recording : Recording
        With attitude and position, by truth where it is known, else by the INS; maneuvers must be labeled.
    aircraft : Aircraft
        Whose surfaces and feeders are looked for.

    Raises
    ------
    RequestError
        If the recording has no maneuvers, attitude or date.
    """

    def __init__(self, recording: Recording, aircraft: Aircraft) -> None:
        self.rate_hz = recording.rate_hz
        self._rows, self.cells = _cells(recording)
        field_b = background(recording)
        strength = np.linalg.norm(field_b, axis=1)
        self._direction = field_b / strength[:, None]
        slope = signals.spline_derivative(field_b, self.rate_hz)
        curve = signals.spline_derivative(slope, self.rate_hz)
        self._vectors = {"ambient": field_b, "slope": slope, "curve": curve}
        self._angles = _deflections(recording, {dipole.surface for dipole in aircraft.magnetics.hinged})
        names = [columns.CURRENT.name(feeder=feeder.name) for feeder in aircraft.magnetics.feeders]
        self._currents = {k: recording[name] for k, name in enumerate(names) if name in recording}
        cosine_rate = signals.spline_derivative(self._direction, self.rate_hz)
        u = self._direction
        terms = [u, *(strength * u[:, i] * u[:, j] for i, j in TERMS if i <= j)]
        terms += [strength * u[:, i] * cosine_rate[:, j] for i, j in TERMS]
        self._basis, _ = np.linalg.qr(_scaled(self._band(np.column_stack(terms))))

    def _band(self, series: np.ndarray) -> np.ndarray:
        """Band-passed rows of the maneuvers."""
        return signals.band_pass(series, self.rate_hz)[self._rows]

    def signatures(self, response: AircraftResponse) -> np.ndarray:
        """In-band signature of the aircraft at each place of a response, (rows, p) [nT]."""
        u = self._direction
        slow = response.eddy_slow_s
        lag = np.einsum("k,sik,kj->sij", response.tau_s, response.field, response.drive)
        out = self._band(u) @ response.permanent_nt.T
        for name, tensor in (("ambient", response.induced), ("slope", slow), ("curve", lag)):
            series = np.column_stack([u[:, i] * self._vectors[name][:, j] for i, j in TERMS])
            out += self._band(series) @ np.stack([tensor[:, i, j] for i, j in TERMS])
        for number, current in self._currents.items():
            out += self._band(u * current[:, None]) @ response.wiring_nt_per_a[:, :, number].T
        for surface, angle in self._angles.items():
            turned = self._turned(response, surface)
            shapes = (np.ones_like(angle), np.cos(angle) - 1.0, np.sin(angle))
            for shape, weight in zip(shapes, turned, strict=True):
                out += self._band(u * shape[:, None]) @ weight.T
        return out

    @staticmethod
    def _turned(response: AircraftResponse, surface: str) -> np.ndarray:
        """Field of a surface's dipoles at rest, and what (cos - 1) and sin of its angle add, (3, p, 3) [nT]."""
        angles = np.array([0.0, HINGE_STEP_RAD, -HINGE_STEP_RAD])
        at = np.zeros((3, len(response.positions_m), 3))
        for dipole in response.hinged:
            if dipole.surface == surface:
                at += _hinged_at(dipole, angles, response.positions_m)
        rest, plus, minus = at
        even = 0.5 * (plus + minus) - rest
        return np.stack([rest, even / (np.cos(HINGE_STEP_RAD) - 1.0), 0.5 * (plus - minus) / np.sin(HINGE_STEP_RAD)])

    def score(self, signature: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Figure of merit and standard deviation of in-band signatures, (p,) [nT] each."""
        return sum(np.ptp(signature[rows], axis=0) for rows in self.cells), signature.std(axis=0)

    def left(self, signature: np.ndarray) -> np.ndarray:
        """What Tolles-Lawson leaves of in-band signatures, (rows, p) [nT]."""
        return signature - self._basis @ (self._basis.T @ signature)


def _scaled(matrix: np.ndarray) -> np.ndarray:
    scale = matrix.std(axis=0)
    return matrix / np.where(scale > 0.0, scale, 1.0)


def _hinged_at(dipole: HingedDipole, angles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Field of a hinged dipole at some deflections, (angles, p, 3) [nT]."""
    moment = rotate_about(dipole.hinge_axis, angles, dipole.moment)
    position = dipole.hinge_point + rotate_about(dipole.hinge_axis, angles, dipole.position - dipole.hinge_point)
    return dipole_field(position[:, None, :], moment[:, None, :], points)


def _cells(recording: Recording) -> tuple[np.ndarray, list[np.ndarray]]:
    """Rows of all maneuvers, (m,) int, and for each heading and maneuver its rows among them."""
    heading, maneuver = (recording.data.get(name) for name in ("leg_heading_deg", "maneuver"))
    if heading is None or maneuver is None or not np.any(maneuver):
        msg = f"recording {recording.name!r} has no labeled maneuvers; a flight such as patterns/fom has"
        raise RequestError(msg)
    mask = metrics.crop(recording.time_s) & (maneuver != 0)
    if "turn" in recording:
        mask &= recording["turn"] == 0
    rows = np.flatnonzero(mask)
    heading, maneuver = heading[rows] % 360.0, maneuver[rows]
    pairs = sorted(set(zip(heading.tolist(), maneuver.tolist(), strict=True)))
    return rows, [np.flatnonzero((heading == course) & (maneuver == code)) for course, code in pairs]


def _angle(recording: Recording, name: str) -> np.ndarray:
    for family in (columns.TRUE_ATTITUDE, columns.INS_ATTITUDE):
        column = family.name(angle=name)
        if column in recording:
            return np.radians(recording[column])
    msg = f"recording {recording.name!r} has no {name}; a map needs attitude and position"
    raise RequestError(msg)


def background(recording: Recording) -> np.ndarray:
    """IGRF-14 along a recording in body axes, (n, 3) [nT].

    Raises
    ------
    RequestError
        If the recording lacks attitude, position, height or date.
    """
    attitude = np.column_stack([_angle(recording, name) for name in ("roll", "pitch", "heading")])
    lat, lon = _angle(recording, "lat"), _angle(recording, "lon")
    heights = [name for name in (columns.TRUE_ALTITUDE.pattern, columns.INS_ALTITUDE.pattern) if name in recording]
    begun = recording.meta.get("start_utc")
    if not heights or not isinstance(begun, str):
        msg = f"recording {recording.name!r} has no {'height' if not heights else 'start_utc'}; a map needs it"
        raise RequestError(msg)
    year = decimal_years(datetime.fromisoformat(begun), recording.time_s)
    field_n = igrf(lat, lon, recording[heights[0]], year)
    return rotate_back(rot_nb_from_attitude(attitude), field_n)


def _deflections(recording: Recording, surfaces: set[str]) -> dict[str, np.ndarray]:
    found = {surface: columns.SURFACE.name(surface=surface) for surface in sorted(surfaces)}
    rest = np.zeros(len(recording))
    return {
        surface: np.radians(recording[column]) if column in recording else rest for surface, column in found.items()
    }


def predict(aircraft: Aircraft, recording: Recording, places: Mapping[str, Sequence[float]]) -> Prediction:
    """Predict the interference of a flight at places of an aircraft.

    Parameters
    ----------
    aircraft : Aircraft
    recording : Recording
        A flight with labeled maneuvers; only attitude, position, deflections, currents and labels count, so a real
        flight of the same aircraft serves as well.
    places : mapping of str to (3,) [m]
        Body axes; in the air, away from metal.

    Returns
    -------
    Prediction

    Raises
    ------
    RequestError
        If the recording lacks what is needed, or there is no place.
    """
    if not places:
        msg = "there is no place to predict for"
        raise RequestError(msg)
    with threadpool_limits(1):
        series, response = FlightSeries(recording, aircraft), response_at(aircraft, places, full=False)
        signature = series.signatures(response)
        raw, left = series.score(signature), series.score(series.left(signature))
    return Prediction(tuple(places), response.positions_m, raw[0], left[0], raw[1], left[1], len(series.cells))

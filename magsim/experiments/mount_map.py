"""Where should the magnetometer go? Interference predicted at many places from one flight, by superposition.

In band the aircraft's effect on a scalar reading is, to first order, its field along the background. That is linear
in few time series of the flight (direction cosines, ambient field and its derivatives, deflections, currents); the
place only weighs them. So the flight is filtered once, and a place costs no more than its response.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from magsim import columns, signals
from magsim.aircraft import Aircraft
from magsim.arrays import readonly
from magsim.compensation.columns import tolles_lawson_columns
from magsim.errors import RequestError
from magsim.experiments.recorded import RecordedExcitation
from magsim.field import AircraftResponse, parts, response_at
from magsim.recording import Recording
from magsim.recording.segments import cells, has_maneuvers
from magsim.scenario import FieldSettings
from magsim.threads import one_blas_thread


@dataclass(frozen=True)
class Prediction:
    """Interference predicted at places, in the compensation band over the maneuvers of a flight.

    Attributes
    ----------
    names : tuple of str
    positions_m : (p, 3) [m]
        Body axes.
    fom_nt, fom_left_nt : (p,) [nT]
        Figure of merit (sum over headings and maneuvers of the peak to peak): before and after Tolles-Lawson with
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
        With attitude, position and labeled maneuvers.
    aircraft : Aircraft
    settings : FieldSettings
        Which parts of the aircraft's field are on, and how.

    Raises
    ------
    RequestError
        If the recording has no maneuvers, attitude or date.
    """

    def __init__(self, recording: Recording, aircraft: Aircraft, settings: FieldSettings | None = None) -> None:
        self.rate_hz = recording.rate_hz
        self._rows, self.cells = _cells(recording)
        self._excitation = RecordedExcitation(recording, aircraft.magnetics, settings or FieldSettings())
        field_b = self._excitation.ambient_b
        strength = np.linalg.norm(field_b, axis=1)
        self._direction = field_b / strength[:, None]
        cosine_rate = signals.spline_derivative(self._direction, self.rate_hz)
        terms = tolles_lawson_columns(self._direction, cosine_rate, strength, 18)
        self._basis, _ = np.linalg.qr(_scaled(self._band(terms)))

    def _band(self, series: np.ndarray) -> np.ndarray:
        """Return the band-passed rows of the maneuvers."""
        return signals.band_pass(series, self.rate_hz)[self._rows]

    def signatures(self, response: AircraftResponse) -> np.ndarray:
        """Return the in-band signature of the aircraft at each place of a response, (rows, p) [nT]."""
        out = self._signature(parts.gains(response), parts.strengths(self._excitation, response))
        for scale, dipole in parts.turning(self._excitation):
            out += scale * self._signature(dipole.gains(response.positions_m), dipole.strengths)
        return out

    def _signature(self, gains: np.ndarray, strengths: np.ndarray) -> np.ndarray:
        """Return the in-band sum of gains (p, 3, c) times strengths (n, c) along the background, (rows, p) [nT]."""
        products = self._direction[:, :, None] * strengths[:, None, :]
        return self._band(products.reshape(len(products), -1)) @ gains.reshape(len(gains), -1).T

    def score(self, signature: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return figure of merit and standard deviation of in-band signatures, (p,) [nT] each."""
        fom = np.sum([np.ptp(signature[rows], axis=0) for rows in self.cells], axis=0)
        return fom, signature.std(axis=0)

    def left(self, signature: np.ndarray) -> np.ndarray:
        """Return what Tolles-Lawson leaves of in-band signatures, (rows, p) [nT]."""
        return signature - self._basis @ (self._basis.T @ signature)


def _scaled(matrix: np.ndarray) -> np.ndarray:
    scale = matrix.std(axis=0)
    return matrix / np.where(scale > 0.0, scale, 1.0)


def _cells(recording: Recording) -> tuple[np.ndarray, list[np.ndarray]]:
    """Return the rows of all maneuvers, (m,) int, and for each maneuver on each heading its rows among them."""
    maneuver = recording.data.get(columns.MANEUVER.pattern)
    if not has_maneuvers(recording.data) or maneuver is None or not np.any(maneuver):
        msg = f"recording {recording.name!r} has no labeled maneuvers; a flight such as patterns/fom has"
        raise RequestError(msg)
    mask = signals.off_ends(recording.time_s) & (maneuver != 0)
    if columns.TURN.pattern in recording:
        mask &= recording[columns.TURN.pattern] == 0
    rows = np.flatnonzero(mask)
    if not rows.size:
        msg = f"no maneuver of recording {recording.name!r} is on a leg, {signals.EDGE_S:g} s off the flight's ends"
        raise RequestError(msg + "; allowed: a longer flight, such as patterns/fom")
    found = cells({name: values[rows] for name, values in recording.data.items()})
    return rows, [np.flatnonzero(cell.rows) for cell in found]


def predict(
    aircraft: Aircraft,
    recording: Recording,
    places: Mapping[str, Sequence[float]],
    settings: FieldSettings | None = None,
) -> Prediction:
    """Predict the interference of a flight at places of an aircraft.

    Parameters
    ----------
    aircraft : Aircraft
    recording : Recording
        A flight with labeled maneuvers; only attitude, position, deflections, currents and labels count, so a real
        flight of the same aircraft serves as well.
    places : mapping of str to (3,) [m]
        Body axes; in the air, away from metal.
    settings : FieldSettings, optional
        Which parts of the aircraft's field are on, and how; by default all at scale 1.

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
    with one_blas_thread():
        series, response = FlightSeries(recording, aircraft, settings), response_at(aircraft, places)
        signature = series.signatures(response)
        raw, left = series.score(signature), series.score(series.left(signature))
    return Prediction(tuple(places), response.positions_m, raw[0], left[0], raw[1], left[1], len(series.cells))

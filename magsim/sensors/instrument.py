"""The interface of all instruments: a function of one finished flight that returns columns."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, Protocol

import numpy as np

from magsim.scenario import Electrical, InstrumentClock, Sensors
from magsim.sensors.acquisition import Acquisition
from magsim.sensors.cabin import temperature_c
from magsim.sensors.clocks import instants
from magsim.terrain import Ground
from magsim.trajectory import Flight, Trajectory
from magsim.truth import FieldTruth

Columns = dict[str, np.ndarray]
"""Values (rows,) by the name of their column (``magsim.columns``)."""


@dataclass(frozen=True)
class MeasuredFlight:
    """A finished flight in its true field, with the settings of the instruments on board.

    Attributes
    ----------
    sensors : Sensors
        Settings of all instruments.
    seed : int
        Of the errors of the instruments; every random stream has a name below it.
    flight : Flight
    truths : mapping of str to FieldTruth
        The true field by what carries the sensors: ``carrier``, and ``bird`` where one is towed.
    acquisition : Acquisition
        Filter and rows of the recording.
    ground : Ground, optional
        None without terrain.
    station_n : (n, 3) [nT], optional
        The field at the base station, north, east, down, at the times of the truth; None without a station.
    """

    sensors: Sensors
    seed: int
    flight: Flight
    truths: Mapping[str, FieldTruth]
    acquisition: Acquisition
    ground: Ground | None = None
    station_n: np.ndarray | None = None

    def without_field(self) -> "MeasuredFlight":
        """Return the flight as an instrument sees it that looks at neither field, currents nor cabin."""
        others = {"scalar": (), "fluxgate": (), "base": None, "cabin": None, "electrical": Electrical()}
        sensors = self.sensors.model_copy(update=others)
        truths = {"carrier": FieldTruth(self.samples_s, (), {})}
        return replace(self, sensors=sensors, truths=truths, station_n=None)

    @property
    def samples_s(self) -> np.ndarray:
        """Times of the true field, (n,) [s]."""
        return self.truths["carrier"].time_s

    @property
    def rate_hz(self) -> float:
        """Rows a second."""
        return self.acquisition.rate_out_hz

    @property
    def log(self) -> Trajectory:
        """Motion of the body that is surveyed with, at its log times."""
        return self.flight.instruments

    @cached_property
    def time_s(self) -> np.ndarray:
        """Times of the rows, (rows,) [s]."""
        return self.acquisition.time_s

    @cached_property
    def path(self) -> Trajectory:
        """Motion of the body that is surveyed with, at the rows."""
        return self.log.at(self.time_s)

    @cached_property
    def cabin_c(self) -> np.ndarray | None:
        """Temperature of the instruments at the times of the true field, (n,) [degC]; None without a cabin."""
        cabin = self.sensors.cabin
        return None if cabin is None else temperature_c(cabin, self.samples_s, self.seed)

    @cached_property
    def _rates_b(self) -> dict[str, np.ndarray]:
        return {}

    def rate_b(self, body: Literal["carrier", "bird"]) -> np.ndarray:
        """Return the angular rate of a body at the times of the true field, (n, 3) [rad/s]."""
        if body not in self._rates_b:
            self._rates_b[body] = self.log_of(body).at(self.samples_s).rate_b
        return self._rates_b[body]

    def log_of(self, body: Literal["carrier", "bird"]) -> Trajectory:
        """Return the motion of a body at its log times."""
        log = self.flight.bird if body == "bird" else self.flight.carrier
        assert log is not None  # a sensor of the bird is refused without one
        return log

    def path_read(self, clock: InstrumentClock, name: str) -> Trajectory:
        """Return the motion at the instants at which an instrument with a clock of its own took its rows.

        Parameters
        ----------
        clock : InstrumentClock
        name : str
            Name of the instrument in the random streams.

        Raises
        ------
        DataError
            If the clock leads out of the flight's record.
        """
        return self.motion_read(clock, name, self.log, self.path)

    def motion_read(self, clock: InstrumentClock, name: str, log: Trajectory, path: Trajectory) -> Trajectory:
        """Return a motion at the instants of an instrument's rows; see ``path_read``.

        Parameters
        ----------
        clock : InstrumentClock
        name : str
        log : Trajectory
            The motion at its log times.
        path : Trajectory
            The same motion at the rows.
        """
        taken_s = instants(clock, path.time_s, name, self.seed, (log.time_s[0], log.time_s[-1]))
        return path if taken_s is None else log.at(taken_s)


class Instrument(Protocol):
    """An instrument, or all of one kind: a function from a flight to columns."""

    def __call__(self, flight: MeasuredFlight, /) -> Columns:
        """Return the columns of the instrument; none where the flight has no such instrument.

        Raises
        ------
        DataError
            If a clock leads out of the flight's record, or the flight leaves a terrain grid.
        """
        ...

"""Training rows that are read flight by flight, for methods that learn so: any number of flights, one in memory."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Generic, TypeVar, overload

from magsim.dataset.index import FlightInfo
from magsim.dataset.rows import LearnedRows, Numbers, Training, pick_sensor, rows_of, training_rows, with_rows
from magsim.errors import DataError
from magsim.recording import Recording

T = TypeVar("T")


class OnDemand(Sequence[T], Generic[T]):
    """A sequence whose items are made when they are asked for.

    Parameters
    ----------
    count : int
    make : callable
        Maps a number from 0 to the item.
    """

    def __init__(self, count: int, make: Callable[[int], T]) -> None:
        self._numbers, self._make = range(count), make

    def __len__(self) -> int:
        return len(self._numbers)

    @overload
    def __getitem__(self, number: int) -> T: ...
    @overload
    def __getitem__(self, number: slice) -> "OnDemand[T]": ...
    def __getitem__(self, number: int | slice) -> "T | OnDemand[T]":
        if isinstance(number, slice):
            numbers = self._numbers[number]
            return OnDemand(len(numbers), lambda place: self._make(numbers[place]))
        return self._make(self._numbers[number])


@dataclass(frozen=True)
class OneByOne(Training):
    """Training rows of which the flight that was asked for last is in memory.

    Attributes
    ----------
    counts : mapping of str to int
        Rows of the splits ``train`` and ``valid``.
    """

    counts: Mapping[str, int]

    @property
    def rows(self) -> dict[str, int]:
        """Number of rows of the splits ``train`` and ``valid``."""
        return dict(self.counts)

    def checked(self, check: Callable[[Recording], None]) -> "OneByOne":
        """Have every recording checked whenever it is read."""

        def read(number: int) -> Recording:
            recording = self.recordings[number]
            check(recording)
            return recording

        return replace(self, recordings=OnDemand(len(self.recordings), read))


def open_training(flights: Iterable[FlightInfo], sensor: str | None = None) -> Training:
    """Return the rows to learn from, of which each flight is read when it is asked for.

    Raises
    ------
    RequestError
        As ``training_rows``, for a flight without the magnetometer when it is read.
    DataError
        If the first file is damaged; for others when they are read.
    """
    every = tuple(flights)
    having = [info for info in with_rows(every) if _learnable(info) >= 2]
    train = sum(info.splits.get("train", 0) if info.splits else info.rows for info in having)
    if not train:
        return training_rows((info.read() for info in every), sensor)  # says what is missing
    reader = _Reader(having, sensor or pick_sensor([having[0].read()]))
    valid = sum(info.splits.get("valid", 0) for info in having)
    recordings = OnDemand(len(having), lambda number: reader(number).recording)
    masks = OnDemand(len(having), lambda number: reader(number).valid)
    aircraft = OnDemand(len(having), reader.aircraft)
    return OneByOne(recordings, masks, reader.sensor, aircraft, {"train": train, "valid": valid})


def _learnable(info: FlightInfo) -> int:
    return info.splits.get("train", 0) + info.splits.get("valid", 0) if info.splits else info.rows


class _Reader:
    """Reads training rows of flights, and keeps those of the last."""

    def __init__(self, flights: Sequence[FlightInfo], sensor: str) -> None:
        self.sensor = sensor
        self._flights = flights
        self._numbers = Numbers()
        self._last: tuple[int, LearnedRows] | None = None

    def aircraft(self, number: int) -> int | None:
        """Return which aircraft flew."""
        return self._numbers(self(number).aircraft)

    def __call__(self, number: int) -> LearnedRows:
        if self._last is None or self._last[0] != number:
            self._last = None  # so that two are never in memory
            info = self._flights[number]
            rows = rows_of(info.read(), self.sensor)
            if rows is None:
                msg = f"{info.file}: flight {info.name!r} has other splits than before"
                raise DataError(msg)
            self._last = number, rows
        return self._last[1]

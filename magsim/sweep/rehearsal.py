"""A sweep before it is flown: what it would fly, whether it can be, and what it would cost."""

import math
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from magsim.errors import MagsimError, RequestError
from magsim.recording import write_recordings
from magsim.simulation import Simulator
from magsim.simulation.dependence import FlightInputs
from magsim.sweep.plan import SweepPlan
from magsim.sweep.space import SweptFlight

CHUNK = 4096
"""Flights whose values are computed at once."""

LOOKED_AT = 50
"""Flights whose settings are checked before a sweep begins."""

TIMED = 3
"""Places of the sweep at which flights are timed."""

TRIED = 16
"""Places that are tried where none of those can be flown."""

MOST_EXPANDED = 2**18
"""Flights of which every value is looked at; of a larger sweep as many, spread over it."""


@dataclass
class Range:
    """What a key takes on over all flights."""

    least: object = None
    most: object = None
    different: dict[object, None] = field(default_factory=dict)
    many: bool = False
    ordered: bool = True

    def add(self, column: Sequence[object]) -> None:
        """Add the values of some flights."""
        self.ordered = self.ordered and not any(isinstance(value, list | Mapping | bool | str) for value in column)
        if self.ordered:
            ends = column if self.least is None else [self.least, *column, self.most]
            try:
                self.least, self.most = min(ends), max(ends)  # type: ignore[type-var]
            except TypeError:  # numbers and dates, or dates with and without time zone
                self.ordered = False
        if not self.many:
            shown = (value if isinstance(value, int | float | str) else str(value) for value in column)
            self.different.update(dict.fromkeys(shown))
            self.many = len(self.different) > 12

    @property
    def text(self) -> str:
        """The range in words."""
        if not self.many:
            shown = sorted(self.different, key=_order) if self.ordered else [*self.different]
            return f"{len(self.different)} values: " + ", ".join(_short(value) for value in shown)
        if not self.ordered:
            return "many values"
        return f"{_short(self.least)} to {_short(self.most)}"


def _order(value: object) -> tuple[float, str]:
    return (float(value), "") if isinstance(value, int | float) else (0.0, str(value))


def _short(value: object) -> str:
    isoformat = getattr(value, "isoformat", None)
    return f"{value:.6g}" if isinstance(value, float) else str(isoformat() if isoformat else value)[:40]


def ranges(plan: SweepPlan) -> tuple[dict[str, Range], int]:
    """Return the range of each key that varies, and the number of flights that constraints leave.

    Of more than ``MOST_EXPANDED`` flights, both are those of a sample, and of all values of grids and lists.
    """
    out: dict[str, Range] = {name: Range() for name in plan.space.names}
    total, kept, looked = plan.space.count, 0, 0
    firsts: Sequence[int] = range(0, total, CHUNK)
    if total > MOST_EXPANDED:
        firsts = np.linspace(0, total - CHUNK, MOST_EXPANDED // CHUNK).astype(np.int64).tolist()
        examples = plan.space.examples()
        for axis, names in zip(plan.settings.axes, plan.space.names_by_axis, strict=True):
            for name in () if axis.is_drawn else names:
                out[name].add(examples[name])
    for first in firsts:
        flights = [*plan.space.flights(first, first + CHUNK)]
        kept += len(flights)
        looked += min(CHUNK, total - first)
        for name, found in out.items():
            column = [flight.values[name] for flight in flights]
            if column:
                found.add(column)
    return out, round(total * kept / looked)


@dataclass(frozen=True)
class Refused:
    """A flight whose settings cannot be flown, and why."""

    flight: SweptFlight
    reason: str


def check(plan: SweepPlan, most: int = LOOKED_AT) -> list[Refused]:
    """Load some flights, spread over the sweep, and return those that are refused.

    Raises
    ------
    RequestError
        If there is none, or all of them are refused.
    """
    looked, refused = 0, []
    for flight in _spread(plan, most):
        looked += 1
        try:
            plan.load(flight)
        except RequestError as error:
            refused.append(Refused(flight, plan.told(str(error))))
    if not looked:
        msg = f"{plan.file.source}: sweep.require leaves none of {plan.space.count} flights"
        raise RequestError(msg)
    if len(refused) == looked:
        reason = refused[0].reason
        msg = f"{reason}\n{plan.file.source}: none of {looked} flights of the sweep that were looked at can be flown"
        raise RequestError(msg)
    return refused


def _spread(plan: SweepPlan, most: int) -> Iterator[SweptFlight]:
    """Yield some flights, spread over the sweep."""
    places = np.unique(np.linspace(0, plan.space.count - 1, most).astype(np.int64))
    for place in places:
        yield from plan.space.flights(int(place), int(place) + 1)


@dataclass(frozen=True)
class Cost:
    """What a flight costs, measured.

    Attributes
    ----------
    timed : int
        Flights that were flown for it.
    flight_s : float [s]
        Processor time of a flight that is flown anew.
    dressing_s : float [s]
        Of one that shares its flight; NaN if none does.
    size : float
        Of a flight in its file [bytes].
    simulated_s : float [s]
        Flight time of one.
    """

    timed: int
    flight_s: float
    dressing_s: float
    size: float
    simulated_s: float

    def flown(self, plan: SweepPlan, flights: int) -> int:
        """Return how many of so many flights of a sweep are flown, as far as those that were timed tell."""
        return flights if math.isnan(self.dressing_s) else min(plan.space.flown_count, flights)

    def total_s(self, flights: int, flown: int) -> float:
        """Return the processor time of a sweep [s]."""
        dressed = flights - flown
        return flown * self.flight_s + (dressed * self.dressing_s if dressed else 0.0)


def measure(plan: SweepPlan, report: Callable[[str], None] = lambda _line: None) -> Cost:
    """Fly and time a few flights: at some places of the sweep one, and the next one if it may share the flight.

    Where none of them can be flown, further places are tried until one can.

    Raises
    ------
    RequestError, DataError
        If none of them can be flown.
    """
    timed: list[_Timed] = []
    last: MagsimError | None = None
    places = np.unique(np.linspace(0, max(plan.space.count - 2, 0), TIMED).astype(np.int64))
    others = np.setdiff1d(np.linspace(0, plan.space.count - 1, TRIED).astype(np.int64), places)
    with tempfile.TemporaryDirectory() as folder:
        for number, place in enumerate([*places, *others]):
            if timed and number >= len(places):
                break
            try:
                for one in _timed(plan, int(place), Path(folder) / "timed.h5"):
                    timed.append(one)
                    report(f"flight {one.number}: {one.spent_s:.2f} s{' (dressed)' if one.dressed else ''}")
            except MagsimError as error:
                report(f"a flight cannot be flown: {plan.told(str(error))}")
                last = error
    if not timed:
        raise last or RequestError(f"{plan.file.source}: sweep.require leaves no flight")
    # the first place reads and compiles what the others find ready
    warm = [one for one in timed if one.place != timed[0].place] or timed
    flown = [one.spent_s for one in warm if not one.dressed]
    dressed = [one.spent_s for one in warm if one.dressed]
    return Cost(
        len(timed),
        float(np.median(flown)),
        float(np.median(dressed)) if dressed else float("nan"),
        float(np.mean([one.size for one in timed])),
        float(np.mean([one.simulated_s for one in timed])),
    )


@dataclass(frozen=True)
class _Timed:
    """One flight that was timed."""

    number: int
    place: int
    dressed: bool
    spent_s: float
    size: int
    simulated_s: float


def _timed(plan: SweepPlan, place: int, path: Path) -> Iterator[_Timed]:
    """Fly and write the flight at a place, and the next one if it may share the flight."""
    simulator, before, key = Simulator(), None, ""
    for flight in plan.space.flights(place, place + 2):
        if before is not None and before != flight.flown:
            return
        began = time.process_time()
        loaded = plan.load(flight)
        last, key = key, FlightInputs.of(loaded).key
        recording = simulator.simulate(loaded)
        write_recordings(path, [recording], force=True)
        spent_s = time.process_time() - began
        simulated_s = float(recording.time_s[-1] - recording.time_s[0])
        yield _Timed(flight.number, place, key == last, spent_s, path.stat().st_size, simulated_s)
        before = flight.flown

"""What a re-run of a paper is made of: flights, pieces of work on them, and tables and figures of the results."""

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from magsim.papers.tables import Cell, PaperTable
from magsim.recording import Recording

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Found = Mapping[str, Any]
"""Result of a piece of work: numbers, texts, and lists of them, as JSON holds them."""


@dataclass(frozen=True)
class Effort:
    """How much is done.

    Attributes
    ----------
    quick : bool
        Minutes: fewer flights and shorter trainings. Shows that all of it runs; its figures say little.
    seeds : int, optional
        Flights, or pairs of flights, that each figure is over; by default what the paper's tables are shown with.
    device : str
        Where networks train: ``cpu``, ``cuda``, ...
    """

    quick: bool = False
    seeds: int | None = None
    device: str = "cpu"

    def count(self, full: int, quick: int) -> int:
        """Return the number of flights: what was asked for, or one of the two defaults."""
        return self.seeds if self.seeds is not None else quick if self.quick else full


@dataclass(frozen=True)
class PaperFlight:
    """A flight that is generated: its name, its scenario, and the settings in which it differs, ``key.path=value``."""

    name: str
    scenario: str
    settings: tuple[str, ...] = ()


@dataclass(frozen=True)
class Task:
    """A piece of work that is done by itself, and whose result is kept.

    Attributes
    ----------
    work : str
        What is done, for those who read results and for the paper's function.
    flights : tuple of str
        Names, in the order in which the work takes them.
    params : mapping
        Of the work: values of JSON.
    seed : int
        Of all that is random in it, beside the flights.
    """

    work: str
    flights: tuple[str, ...]
    params: Mapping[str, Any] = field(default_factory=dict)
    seed: int = 0

    @property
    def key(self) -> str:
        """The task as text that tells it from every other one."""
        return json.dumps(asdict(self), sort_keys=True)

    @property
    def digest(self) -> str:
        """Short name of the task, for files."""
        return hashlib.sha256(self.key.encode()).hexdigest()[:16]

    @property
    def text(self) -> str:
        """The task in words."""
        settings = "".join(f", {name} {value}" for name, value in self.params.items())
        return f"{self.work}{settings}: {', '.join(self.flights)}" + (f", seed {self.seed}" if self.seed else "")


class Surroundings(NamedTuple):
    """Where a task is done: a folder for the state of trainings, removed when the task is done, and the device."""

    folder: Path
    device: str


Results = Sequence[tuple[Task, Found]]
"""All tasks with what they found, in the order of the tasks."""


@dataclass(frozen=True)
class Paper:
    """A paper as it is re-run.

    Attributes
    ----------
    number : str
        As this project counts the papers: ``000``.
    title, source : str
        Authors, title, journal.
    flights : callable
        ``flights(effort)``: what is flown.
    tasks : callable
        ``tasks(effort)``: what is done with it.
    work : callable
        ``work(task, recordings, surroundings)``: does one; a pure function of the task and its recordings, of a
        module, so that other processes find it.
    headlines : callable
        ``headlines(results)``: the few figures that the paper stands for, by short names such as ``gain_order3_pct``:
        ratios and gains taken flight by flight, ranks, shares of flights in which a claim holds.
    tables : callable
        ``tables(results)``: the paper's tables.
    figures : callable
        ``figures(results)``: pictures by file name without ending.
    gpu : bool
        Has networks that can train on a GPU.
    """

    number: str
    title: str
    source: str
    flights: Callable[[Effort], Sequence[PaperFlight]]
    tasks: Callable[[Effort], Sequence[Task]]
    work: Callable[[Task, Sequence[Recording], Surroundings], Found]
    headlines: Callable[[Results], Mapping[str, Cell]]
    tables: Callable[[Results], Sequence[PaperTable]]
    figures: Callable[[Results], Mapping[str, "Figure"]]
    gpu: bool = False


def found_of(results: Results, work: str, **params: Any) -> list[Found]:
    """Return what tasks of one kind found, in order: those that have these parameters among theirs."""
    return [
        found
        for task, found in results
        if task.work == work and all(task.params.get(name) == value for name, value in params.items())
    ]


def values_of(results: Results, figure: str, work: str, **params: Any) -> tuple[float, ...]:
    """Return one figure of tasks of one kind, in order."""
    return tuple(float(found[figure]) for found in found_of(results, work, **params))

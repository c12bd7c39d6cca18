"""The ``[sweep]`` part of a scenario: which keys vary, how, and how many flights they make."""

import math
from collections.abc import Iterator, Mapping
from datetime import datetime
from functools import cached_property
from typing import Annotated, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator
from scipy.special import ndtr

from magsim.config import Problems, Strict, keys

MOST_FLIGHTS = 100_000_000
"""Most flights of a sweep: names and files are numbered with as many digits."""

LEAST_SHARE = 1e-6
"""Of a normal distribution, between its limits."""

LARGEST_WHOLE = 2**53
"""Up to which every whole number is a float."""


def _as_tuple(value: object) -> object:
    return tuple(value) if isinstance(value, list) else value


def _one_or_many(value: object) -> object:
    return (value,) if isinstance(value, str) else _as_tuple(value)


Values = Annotated[tuple[object, ...], BeforeValidator(_as_tuple), Field(min_length=1, max_length=1_000_000)]
Bound = float | datetime
Pair = Annotated[tuple[Bound, Bound], BeforeValidator(_as_tuple)]
Positive = Annotated[float, Field(gt=0)]
PositivePair = Annotated[tuple[Positive, Positive], BeforeValidator(_as_tuple)]
Sampling = Literal["random", "sobol", "latin_hypercube"]


class EvenSteps(Strict):
    """Evenly spaced numbers; whole ones where both ends and the step are."""

    from_: float | int = Field(alias="from")
    to: float | int
    step: float | int | None = Field(default=None, gt=0, description="1 where neither step nor count is given")
    count: int | None = Field(default=None, ge=2, le=1_000_000, description="how many, both ends included")

    @model_validator(mode="after")
    def _fits(self) -> "EvenSteps":
        if self.to < self.from_:
            raise Problems(("to", f"{self.to:g} is below from = {self.from_:g}; allowed: {self.from_:g} or more"))
        if not math.isfinite(self.to - self.from_):
            raise Problems(("to", f"{self.to:g} is too far from {self.from_:g}; allowed: numbers of ordinary size"))
        if self.step is not None and self.count is not None:
            raise Problems(("count", "step is given too; allowed: one of them"))
        if self.count is None and (self.to - self.from_) / (self.step or 1) > 1_000_000:
            raise Problems(("step", "makes more than a million values; allowed: at most 1000000"))
        return self

    @cached_property
    def values(self) -> tuple[object, ...]:
        """The numbers, both ends included where the step meets them."""
        if self.count is not None:
            span = self.to - self.from_
            return tuple(self.from_ + span * i / (self.count - 1) for i in range(self.count))
        step = 1 if self.step is None else self.step
        last = int((self.to - self.from_) / step + 1e-9)
        return tuple(self.from_ + step * i for i in range(last + 1))


def _steps_or_values(value: object) -> object:
    return value if isinstance(value, Mapping) else _as_tuple(value)


WAYS = ("grid", "list", "number", "choice", "uniform", "log_uniform", "normal")
"""Keys of an axis that say where its values come from; each axis has one of them."""


class Axis(Strict):
    """One thing that varies."""

    key: Annotated[tuple[str, ...], BeforeValidator(_one_or_many)] = Field(
        default=(),
        description="key path of the scenario, or several that take the same value; [*] is every element of a list",
    )
    grid: Annotated[EvenSteps | Values, BeforeValidator(_steps_or_values)] | None = Field(
        default=None, description="values, or {from, to, step or count}; every grid is crossed with every other"
    )
    list_: Values | None = Field(
        default=None,
        alias="list",
        description="values, or tables of keys and values; all lists are as long, and walked through together",
    )
    number: int | None = Field(
        default=None, ge=0, lt=2**62, description="flight k takes this plus k: individuals, each once"
    )
    choice: Values | None = Field(default=None, description="values of which one is drawn for each flight")
    uniform: Pair | None = Field(default=None, description="bounds; numbers, or dates with times")
    log_uniform: PositivePair | None = Field(default=None, description="bounds; the logarithm is uniform")
    normal: Annotated[tuple[float, float], BeforeValidator(_as_tuple)] | None = Field(
        default=None, description="mean and standard deviation"
    )
    limits: Annotated[tuple[float, float], BeforeValidator(_as_tuple)] | None = Field(
        default=None, description="of a normal distribution, which is cut off there"
    )
    whole: bool = Field(default=False, description="draw whole numbers, both bounds included")
    sampling: Sampling | None = Field(default=None, description="of this axis, instead of that of the sweep")

    @property
    def way(self) -> str:
        """Which of ``WAYS`` it is."""
        return next(name for name in WAYS if self.given(name) is not None)

    @property
    def is_drawn(self) -> bool:
        """Whether each flight has a value of its own, so that there are as many as flights."""
        return self.way not in ("grid", "list")

    @property
    def values(self) -> tuple[object, ...]:
        """Those of a grid, list or choice."""
        found = self.given(self.way)
        return found.values if isinstance(found, EvenSteps) else tuple(found)  # type: ignore[arg-type]

    @property
    def table_keys(self) -> tuple[str, ...]:
        """Key paths of a list of tables; empty for any other axis."""
        first = self.values[0] if not self.is_drawn else None
        return tuple(first) if isinstance(first, Mapping) and not self.key else ()

    def given(self, way: str) -> object:
        """Return what a key of ``WAYS`` holds, or None."""
        return getattr(self, "list_" if way == "list" else way)

    @model_validator(mode="after")
    def _consistent(self) -> "Axis":
        found = [*self._problems()]
        if found:
            raise Problems(*found)
        return self

    def _problems(self) -> Iterator[tuple[str, str]]:
        ways = [name for name in WAYS if self.given(name) is not None]
        if len(ways) != 1:
            what = "has no values" if not ways else f"has {' and '.join(ways)}"
            yield "", f"{what}; allowed: one of {', '.join(WAYS)}"
            return
        yield from self._misnamed()
        way = ways[0]
        for name in ("uniform", "log_uniform"):
            yield from _check_bounds(name, self.given(name))
        if way != "normal" and self.limits is not None:
            yield "limits", f"has no effect on {way}; allowed: with normal"
        if (not self.is_drawn or way == "number") and self.sampling is not None:
            yield "sampling", f"has no effect on {way}; allowed: where values are drawn"
        if way not in ("uniform", "log_uniform", "normal") and self.whole:
            yield "whole", f"has no effect on {way}; allowed: with uniform, log_uniform or normal"
        elif self.whole and isinstance(getattr(self, way)[0], datetime):
            yield "whole", "has no effect on dates; allowed: with numbers"
        if self.normal is not None:
            if self.normal[1] <= 0:
                yield "normal[1]", f"{self.normal[1]:g} is no standard deviation; allowed: above 0"
            yield from _check_bounds("limits", self.limits)
            yield from self._check_limits()
        if self.whole:
            yield from self._check_whole()

    def _check_limits(self) -> Iterator[tuple[str, str]]:
        """Yield the problem of limits that hardly any value keeps: their draws would be no normal ones."""
        assert self.normal is not None
        if self.limits is not None and self.limits[0] < self.limits[1] and self.normal[1] > 0:
            below, above = ndtr((np.array(self.limits) - self.normal[0]) / self.normal[1])
            if above - below < LEAST_SHARE:
                text = f"leave less than {LEAST_SHARE:g} of the distribution; allowed: limits nearer to its mean"
                yield "limits", text

    def _check_whole(self) -> Iterator[tuple[str, str]]:
        """Yield the problems of bounds between which no whole numbers can be drawn."""
        for name in ("uniform", "log_uniform", "limits"):
            for i, bound in enumerate(getattr(self, name) or ()):
                if isinstance(bound, float) and not (bound.is_integer() and abs(bound) <= LARGEST_WHOLE):
                    text = f"{bound:.16g} is no bound of whole numbers; allowed: a whole number, 2**53 at most"
                    yield f"{name}[{i}]", text

    def _misnamed(self) -> Iterator[tuple[str, str]]:
        """Yield the problems of the keys that it sets."""
        tables = self.way == "list" and any(isinstance(value, Mapping) for value in self.values)
        if tables:
            yield from _check_tables(self)
        elif not self.key:
            yield "key", "is missing; allowed: a key path such as start.alt_m"
        for i, text in enumerate(self.key):
            path = keys.split(text.replace("[*]", "[0]"))
            if path is None or isinstance(path[0], int):
                yield f"key[{i}]", f"{text!r:.60} is no key path; allowed: one such as start.alt_m"


def _check_tables(axis: Axis) -> Iterator[tuple[str, str]]:
    """Yield the problems of a list whose items are tables of keys and values."""
    if axis.key:
        yield "key", "is given, though the list holds tables of keys and values; allowed: one of them"
    first = axis.values[0]
    names = list(first) if isinstance(first, Mapping) else []
    for i, value in enumerate(axis.values):
        if not isinstance(value, Mapping) or not value or list(value) != names:
            yield f"list[{i}]", f"differs from the first item; allowed: a table with {', '.join(map(str, names))}"
            return
    for name in names:
        path = keys.split(str(name).replace("[*]", "[0]"))
        if path is None or isinstance(path[0], int):
            yield "list[0]", f"{name!r:.60} is no key path; allowed: one such as start.alt_m, in quotes"


def _check_bounds(name: str, pair: object) -> Iterator[tuple[str, str]]:
    if not isinstance(pair, tuple):
        return
    low, high = pair
    if isinstance(low, datetime) != isinstance(high, datetime):
        yield name, "is a number and a date; allowed: two numbers, or two dates with times"
    elif isinstance(low, datetime) and (low.tzinfo is None) != (high.tzinfo is None):
        yield name, "has one date without time zone; allowed: both with one, for example 2025-03-13T06:00:00Z"
    elif high <= low:
        yield f"{name}[1]", f"{high} is not above {low}; allowed: more than the first"


class Split(Strict):
    """Shares of the flights whose rows are all for validation, or all for test; the others are for training."""

    valid: float = Field(default=0.0, ge=0, lt=1)
    test: float = Field(default=0.0, ge=0, lt=1)

    @model_validator(mode="after")
    def _leaves_training(self) -> "Split":
        if self.valid + self.test >= 1:
            raise Problems(("test", f"{self.test:g} and valid = {self.valid:g} leave nothing for training"))
        return self


class SweepSettings(Strict):
    """What a sweep flies."""

    scenario: str | None = Field(
        default=None,
        min_length=1,
        description="name of a shipped scenario, or a file beside this one that ends with .toml; without it, this file",
    )
    set_: Annotated[tuple[str, ...], BeforeValidator(_as_tuple)] = Field(
        default=(), alias="set", description="settings of every flight that replace the scenario's, as with --set"
    )
    flights: int | None = Field(
        default=None,
        ge=1,
        le=MOST_FLIGHTS,
        description="how many; a multiple of the size of the grid, which is the default",
    )
    seed: int = Field(default=0, ge=0, lt=2**63, description="what is drawn, and the seed of each flight, come from it")
    dressings: int = Field(
        default=1, ge=1, le=100_000, description="recordings of each flight that differ in aircraft, field, instruments"
    )
    new_seeds: bool = Field(
        default=True, description="a seed for each flight, and one for each recording's instruments; false: the file's"
    )
    sampling: Sampling = Field(default="random", description="how values are drawn")
    block: int = Field(
        default=100,
        ge=2,
        le=100_000,
        description="flights that make one Latin hypercube; more flights are more of them",
    )
    shard: int = Field(default=8, ge=1, le=10_000, description="flights in each file")
    split: Split | None = Field(
        default=None, description="of whole flights; without it, legs and circuits of each flight decide"
    )
    require: Annotated[tuple[Annotated[str, Field(max_length=200)], ...], BeforeValidator(_one_or_many)] = Field(
        default=(), description="comparisons of keys that a flight must meet, for example 'start.alt_m > 2 * start.x'"
    )
    axes: Annotated[tuple[Axis, ...], BeforeValidator(_as_tuple)] = Field(default=(), max_length=200)

    @model_validator(mode="after")
    def _lists_are_as_long(self) -> "SweepSettings":
        lengths = {i: len(axis.values) for i, axis in enumerate(self.axes) if axis.way == "list"}
        first = next(iter(lengths.values()), 0)
        found = [
            (f"axes[{i}].list", f"has {length} values, the first list {first}; allowed: as many")
            for i, length in lengths.items()
            if length != first
        ]
        if found:
            raise Problems(*found)
        return self

    @model_validator(mode="after")
    def _count(self) -> "SweepSettings":
        drawn = any(axis.is_drawn for axis in self.axes)
        size = self.grid_size
        if size > MOST_FLIGHTS:
            raise Problems(("axes", f"make a grid of {size} flights; allowed: at most {MOST_FLIGHTS}"))
        if self.flights is None and drawn:
            raise Problems(("flights", "is missing; allowed: a whole number, for values are drawn"))
        if self.flights is not None and self.flights % size:
            text = f"{self.flights} is no multiple of the grid's {size} flights; allowed: {size}, {2 * size}, ..."
            raise Problems(("flights", text))
        return self

    @property
    def grid_size(self) -> int:
        """Flights of the grid once, its lists and dressings included."""
        size, lists = self.dressings, 1
        for axis in self.axes:
            if axis.way == "grid":
                size *= len(axis.values)
            elif axis.way == "list":
                lists = len(axis.values)
        return size * lists

    @property
    def count(self) -> int:
        """How many flights there are, those included that ``require`` leaves out."""
        return self.flights or self.grid_size

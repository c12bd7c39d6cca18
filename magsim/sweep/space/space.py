"""The flights of a sweep, each computed from its number alone, so that a million need no memory.

Flight k has the digits of k in the mixed radix of the grids, the first axis fastest: a further axis at the end, or more
flights, leave what was there. *Dressing* axes change only what a finished flight is seen with; the digits of all
others, with the number of the round through the grid, are the number f of what is flown. Flights of one f stand
together in the order in which files are filled, whatever the order of the axes.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from magsim.config import keys
from magsim.sweep.settings import Axis, SweepSettings
from magsim.sweep.space.constraints import Constraint
from magsim.sweep.space.drawing import values
from magsim.sweep.space.sampling import numbers

DRESSING = frozenset({"individual", "day", "field", "sensors", "recording"})
"""Tables and keys of a scenario that dress a flight, as a rule. Where one of them changes the flight all the same, it
is flown again: only time is lost."""


@dataclass(frozen=True)
class SweptFlight:
    """One flight of a sweep.

    Attributes
    ----------
    number : int
        From 0; what names it.
    flown : int
        Number of what is flown: flights that agree in it differ in their dressing alone.
    values : mapping of str to object
        By key path.
    """

    number: int
    flown: int
    values: Mapping[str, object]

    @property
    def name(self) -> str:
        """Name of its recording."""
        return f"f{self.number:08d}"


@dataclass(frozen=True)
class _Digit:
    """One digit of a flight's number: a grid, all lists together, or the dressings."""

    size: int
    dressing: bool
    axes: tuple[int, ...] = ()


class Space:
    """All flights of a sweep.

    Parameters
    ----------
    settings : SweepSettings
    paths : sequence of sequence of str
        Key paths of each axis, ``[*]`` replaced; empty for a list of tables.
    constraints : sequence of Constraint
    fixed : mapping of str to float
        Values of the keys in constraints that do not vary.
    """

    def __init__(
        self,
        settings: SweepSettings,
        paths: Sequence[Sequence[str]],
        constraints: Sequence[Constraint] = (),
        fixed: Mapping[str, float] | None = None,
    ) -> None:
        self._settings = settings
        self._paths = paths
        self._constraints = constraints
        self._fixed = fixed or {}
        self._dressing = [all(_dresses(path) for path in self._keys(i)) for i in range(len(settings.axes))]
        self._digits = [*self._make_digits()]
        self._flown_size = _product(digit.size for digit in self._digits if not digit.dressing)
        self._dress_size = _product(digit.size for digit in self._digits if digit.dressing)
        sobol = [i for i, axis in enumerate(settings.axes) if axis.is_drawn and self._method(axis) == "sobol"]
        self._dimensions = {axis: number for number, axis in enumerate(sobol)}

    @property
    def count(self) -> int:
        """Flights, those included that constraints leave out."""
        return self._settings.count

    @property
    def flown_count(self) -> int:
        """Different flights that are flown, if dressing changes none."""
        return self.count // self._dress_size

    @property
    def names(self) -> tuple[str, ...]:
        """Key paths that vary, in the order of the file."""
        return tuple(name for names in self.names_by_axis for name in names)

    @property
    def names_by_axis(self) -> tuple[tuple[str, ...], ...]:
        """Key paths of each axis."""
        return tuple(tuple(self._keys(i)) for i in range(len(self._settings.axes)))

    def flights(self, first: int, last: int) -> Iterator[SweptFlight]:
        """Yield the flights at places first to last - 1 of the order in which files are filled.

        Those that a constraint leaves out are not among them.
        """
        place = np.arange(first, min(last, self.count), dtype=np.int64)
        number, flown = self._numbers(place)
        columns = self.columns(number, flown)
        keep = self._allowed(columns, len(number))
        names = list(columns)
        rows = zip(*columns.values(), strict=True) if names else [()] * len(number)
        for k, f, kept, row in zip(number.tolist(), flown.tolist(), keep.tolist(), rows, strict=True):
            if kept:
                yield SweptFlight(k, f, dict(zip(names, row, strict=True)))

    def columns(self, number: np.ndarray, flown: np.ndarray) -> dict[str, Sequence[object]]:
        """Return the values of flights by key path, each (n,)."""
        out: dict[str, Sequence[object]] = {}
        digits = self._digit_values(number)
        for i, axis in enumerate(self._settings.axes):
            if axis.is_drawn:
                index = number if self._dressing[i] else flown
                column = self._own(i, axis, index)
                out.update(dict.fromkeys(self._paths[i], column))
                continue
            given = axis.values
            chosen = [given[j] for j in digits[i]]
            if self._paths[i]:
                out.update(dict.fromkeys(self._paths[i], chosen))
            else:
                out.update({name: [_of(item, name) for item in chosen] for name in axis.table_keys})
        return out

    def examples(self) -> dict[str, Sequence[object]]:
        """Return values of each key: all of a grid, a list or a choice, and one of what is drawn."""
        out: dict[str, Sequence[object]] = {}
        one = np.zeros(1, dtype=np.int64)
        for i, axis in enumerate(self._settings.axes):
            if not self._paths[i]:
                out.update({name: [_of(item, name) for item in axis.values] for name in axis.table_keys})
            else:
                drawn = axis.is_drawn and axis.choice is None
                shown = self._own(i, axis, one) if drawn else axis.values
                out.update(dict.fromkeys(self._paths[i], shown))
        return out

    def _keys(self, axis: int) -> Sequence[str]:
        """Return the key paths of an axis."""
        return self._paths[axis] or self._settings.axes[axis].table_keys

    def _method(self, axis: Axis) -> str:
        return axis.sampling or self._settings.sampling

    def _own(self, i: int, axis: Axis, index: np.ndarray) -> Sequence[object]:
        """Return the values of an axis on which each flight has its own, (n,)."""
        if axis.number is not None:
            return (axis.number + index).tolist()
        method, settings = self._method(axis), self._settings
        name = " ".join(axis.key)
        if method == "latin_hypercube":
            drawn = numbers(method, settings.seed, name, index, block=settings.block)
        else:
            drawn = numbers(method, settings.seed, name, index, dimension=self._dimensions.get(i, 0))
        return values(axis, drawn)

    def _make_digits(self) -> Iterator[_Digit]:
        """Yield the digits, the fastest first."""
        axes = self._settings.axes
        if self._settings.dressings > 1:
            yield _Digit(self._settings.dressings, dressing=True)
        lists = tuple(i for i, axis in enumerate(axes) if axis.way == "list")
        for i, axis in enumerate(axes):
            if axis.way == "grid":
                yield _Digit(len(axis.values), self._dressing[i], (i,))
            elif lists and i == lists[0]:
                yield _Digit(len(axis.values), all(self._dressing[j] for j in lists), lists)

    def _numbers(self, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the numbers of the flights at places, and of what they fly."""
        round_, rest = np.divmod(place, self._flown_size * self._dress_size)
        flown, dress = np.divmod(rest, self._dress_size)
        number, stride = round_ * (self._flown_size * self._dress_size), 1
        left = {False: flown.copy(), True: dress.copy()}
        for digit in self._digits:
            left[digit.dressing], value = np.divmod(left[digit.dressing], digit.size)
            number = number + value * stride
            stride *= digit.size
        return number, round_ * self._flown_size + flown

    def _digit_values(self, number: np.ndarray) -> dict[int, np.ndarray]:
        """Return the index into its values of each axis with a grid or a list."""
        out, rest = {}, number % (self._flown_size * self._dress_size)
        for digit in self._digits:
            rest, value = np.divmod(rest, digit.size)
            out.update(dict.fromkeys(digit.axes, value))
        return out

    def _allowed(self, columns: Mapping[str, Sequence[object]], count: int) -> np.ndarray:
        """Return which flights meet every constraint, (n,)."""
        keep = np.ones(count, dtype=bool)
        for constraint in self._constraints:
            given = {
                name: np.array([_number(value) for value in columns[name]])
                if name in columns
                else np.asarray(self._fixed[name])
                for name in constraint.names
            }
            keep &= constraint.holds(given)
        return keep


def _dresses(path: str) -> bool:
    parts = keys.split(path)
    return parts is not None and parts[0] in DRESSING


def _of(item: object, name: str) -> object:
    assert isinstance(item, Mapping)  # SweepSettings has checked it
    return item[name]


def _number(value: object) -> float:
    return float(value) if isinstance(value, int | float) else float("nan")


def _product(sizes: Iterator[int]) -> int:
    out = 1
    for size in sizes:
        out *= size
    return out

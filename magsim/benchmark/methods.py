"""Which methods a benchmark compares: names, compensators, or everything that there is."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TypeGuard, cast

from magsim.benchmark.judging import NOISE_FLOOR
from magsim.compensation import Compensator, create, names, parse_method, presets_of
from magsim.errors import RequestError

Method = str | Compensator | tuple[str, Compensator]
"""A name with settings (``name:key=value``), ``noise_floor`` and ``all`` among them; a compensator; or a name for the
table and a compensator."""

ALL = "all"
"""Stands for every method by its name, and the noise floor."""

QUICK = "quick"
"""Preset for a first look."""


@dataclass(frozen=True)
class NamedMethod:
    """A method with its name in the table; the noise floor has no compensator.

    ``optional`` is what comes of ``all``: it is left out where it cannot work.
    """

    name: str
    compensator: Compensator | None
    optional: bool = False

    @property
    def given(self) -> bool:
        """Whether it came fitted."""
        return self.compensator is not None and self.compensator.is_fitted


def named_methods(
    methods: Method | Sequence[Method], *, quick: bool = False
) -> tuple[tuple[NamedMethod, ...], list[str]]:
    """Return methods with their names for the table, and a note on each of ``all`` that cannot be made.

    Raises
    ------
    RequestError
        If there is none, a name is unknown or given twice, or something else is no method.
    """
    alone = isinstance(methods, str | Compensator) or _is_pair(methods) or not isinstance(methods, Iterable)
    asked = (methods,) if alone else tuple(cast("Iterable[Method]", methods))
    named = {i: _named(method, quick=quick) for i, method in enumerate(asked) if method != ALL}
    given = [one.name for one in named.values()]
    twice = sorted({name for name in given if given.count(name) > 1})
    if asked.count(ALL) > 1:
        twice.append(ALL)
    if twice:
        msg = f"method {', '.join(twice)} is given twice"
        raise RequestError(msg)
    if not asked:
        msg = "no method to benchmark was given"
        raise RequestError(msg)
    rest, notes = _every(set(given), quick=quick) if ALL in asked else ([], [])
    out = [one for i in range(len(asked)) for one in ([named[i]] if i in named else rest)]
    return tuple(out), notes


def _every(without: set[str], *, quick: bool) -> tuple[list[NamedMethod], list[str]]:
    """Return all methods by name but those that are named apart, and notes on those that cannot be made."""
    found, notes = [], []
    for name in (*names(), NOISE_FLOOR):
        if name in without:
            continue
        try:
            found.append(NamedMethod(name, _named(name, quick=quick).compensator, optional=True))
        except RequestError as error:
            notes.append(f"method {name} is left out: {error}")
    return found, notes


def _named(method: object, *, quick: bool) -> NamedMethod:
    if isinstance(method, Compensator):
        return NamedMethod(method.name, method)
    if isinstance(method, str):
        name, settings = parse_method(method)
        if name != NOISE_FLOOR:
            return NamedMethod(method, _made(name, settings, quick=quick))
        if settings:
            msg = f"{NOISE_FLOOR} has no settings; {method!r} gives {', '.join(settings)}"
            raise RequestError(msg)
        return NamedMethod(method, None)
    if _is_pair(method):
        return NamedMethod(*method)
    msg = (
        f"{method!r} is no method; allowed: a name such as 'tl16', a compensator, or a pair of a name for the table "
        "and a compensator"
    )
    raise RequestError(msg)


def _made(name: str, settings: dict[str, object], *, quick: bool) -> Compensator:
    """Return an unfitted method; with its quick preset if that is asked for, it has one, and no other is named."""
    preset = settings.pop("preset", None)
    if preset is None and quick and QUICK in presets_of(name):
        preset = QUICK
    return create(name, preset=None if preset is None else str(preset), **settings)


def _is_pair(method: object) -> TypeGuard[tuple[str, Compensator]]:
    """Whether something is a name for the table and a compensator."""
    return (
        isinstance(method, tuple)
        and len(method) == 2
        and isinstance(method[0], str)
        and isinstance(method[1], Compensator)
    )

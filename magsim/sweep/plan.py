"""A sweep file, read and checked: the scenario that varies, its flights, and how each is loaded."""

import hashlib
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from pydantic import BaseModel, ConfigDict

import magsim
from magsim import assets, config
from magsim.config import Document, keys, toml
from magsim.errors import RequestError
from magsim.loading import LoadedScenario, load_document
from magsim.storage.sources import source_digest
from magsim.sweep.files import digests
from magsim.sweep.settings import SweepSettings
from magsim.sweep.space import Constraint, Space, SweptFlight, read_constraint
from magsim.sweep.space.sampling import numbers

_HEADER = re.compile(r"[ \t]*\[\[?[^\[\]{}=,]+\]\]?[ \t]*(?:#.*)?\r?\n?$")
_OF_SWEEP = re.compile(r"[ \t]*\[\[?[ \t]*(?:sweep|\"sweep\"|'sweep')[ \t]*[.\]]")


class _File(BaseModel):
    """The part of a sweep file that the scenario does not know."""

    model_config = ConfigDict(extra="ignore")

    sweep: SweepSettings


@dataclass(frozen=True)
class SweepFile:
    """A sweep as it travels to a process: its text, not what was read from it.

    Attributes
    ----------
    text : str
        Of the file.
    source : str
        How messages name it.
    name : str
        Of the sweep.
    folder : str
        In which its relative paths begin.
    overrides : tuple of str
        Settings on top of it.
    """

    text: str
    source: str
    name: str
    folder: str
    overrides: tuple[str, ...] = ()


@dataclass(frozen=True)
class SweepPlan:
    """A sweep that can be flown.

    Attributes
    ----------
    file : SweepFile
    settings : SweepSettings
    base : LoadedScenario
        The scenario without anything varied.
    space : Space
    """

    file: SweepFile
    settings: SweepSettings
    base: LoadedScenario
    space: Space

    @property
    def dataset_name(self) -> str:
        """Name of the data set that it makes: that of its file, in the letters that names may have."""
        plain = re.sub(r"[^a-z0-9_]", "_", self.file.name.lower())[:38]
        return plain if plain[:1].isalpha() else f"s_{plain}"

    @property
    def shards(self) -> int:
        """Number of files, those included that may stay empty."""
        return -(-self.space.count // self.settings.shard)

    def flights(self, shard: int) -> list[SweptFlight]:
        """Return the flights of one file, those of one flight in the air together."""
        size = self.settings.shard
        return [*self.space.flights(shard * size, (shard + 1) * size)]

    def flights_by_number(self, shard: int) -> dict[int, SweptFlight]:
        """Return the flights of one file by number."""
        return {flight.number: flight for flight in self.flights(shard)}

    def last_place(self, shard: int) -> int:
        """Return how many places of the order the sweep has filled at the end of a file."""
        return min((shard + 1) * self.settings.shard, self.space.count)

    def overrides(self, flight: SweptFlight) -> tuple[str, ...]:
        """Return the settings of a flight, on top of the scenario's."""
        out = [f"{name}={toml.text_of(value)}" for name, value in flight.values.items()]
        varied = flight.values.keys()
        if self.settings.new_seeds:
            if "seed" not in varied:
                out.append(f"seed={self._seed(0, flight.flown)}")
            if "sensors.seed" not in varied:
                out.append(f"sensors.seed={self._seed(1, flight.number)}")
        if self.settings.split is not None and "recording.split" not in varied:
            out.append(f"recording.split={self.split(flight.flown)}")
        return tuple(out)

    def load(self, flight: SweptFlight) -> LoadedScenario:
        """Return the scenario of a flight.

        Raises
        ------
        RequestError
            If it is none that can be flown.
        """
        return self.base.changed(self.overrides(flight), within=Path(self.file.folder))

    def told(self, reason: str) -> str:
        """Return why a flight was refused, with the axis and its line in place of the override that it made."""
        document = config.parse(self.file.text, overrides=self.file.overrides, source=self.file.source)
        places = {name: f"sweep.axes[{i}]" for i, names in enumerate(self.space.names_by_axis) for name in names}
        return _told(document, places, reason)

    def split(self, flown: int) -> str:
        """Return the split of what is flown under a number: the same for all its dressings."""
        shares = self.settings.split
        assert shares is not None
        drawn = numbers("random", self.settings.seed, "split", np.array([flown]))[0]
        if drawn < shares.test:
            return "test"
        return "valid" if drawn < shares.test + shares.valid else "train"

    @cached_property
    def identity(self) -> str:
        """SHA-256 of all that decides the bytes of its flights, but for how many they are."""
        settings = self.settings.model_dump(mode="json", by_alias=True, exclude={"flights"})
        parts = {
            "settings": settings,
            "base": self.base.digest,
            "version": magsim.__version__,
            "code": source_digest("magsim.simulation"),
            "flown": source_digest("magsim.sweep.shard"),
            "files": digests(self.space.examples(), Path(self.file.folder)),
        }
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()

    def _seed(self, purpose: int, number: int) -> int:
        """Return the seed of a flight in the air (purpose 0) or of the instruments of a recording (1)."""
        sequence = np.random.SeedSequence(self.settings.seed, spawn_key=(purpose, number))
        return int(sequence.generate_state(1, np.uint64)[0] >> np.uint64(1))


def read_sweep(name_or_path: str | Path, overrides: Sequence[str] = ()) -> SweepPlan:
    """Read and check a sweep file.

    Parameters
    ----------
    name_or_path : str or Path
        A TOML file, or the name of a shipped sweep, such as ``sweeps/random_places``.
    overrides : sequence of str
        ``key.path=value`` settings on top of the file, those of ``sweep`` included.

    Raises
    ------
    RequestError
        If anything is wrong: one line for each problem, with file and line.
    """
    path = assets.scenario_path(name_or_path)
    text = config.read(path).text
    return plan_of(SweepFile(text, str(path), path.stem, str(path.parent.absolute()), tuple(overrides)))


def plan_of(file: SweepFile) -> SweepPlan:
    """Return the plan of a sweep.

    Raises
    ------
    RequestError
        If anything in it is wrong.
    """
    document = config.parse(file.text, overrides=file.overrides, source=file.source)
    if "sweep" not in document.table:
        msg = f"{file.source}: has no [sweep]; magsim generate flies a scenario of one flight"
        raise RequestError(msg)
    settings = document.validate(_File).sweep
    for i, text in enumerate(settings.set_):
        if _is_of_sweep(text):
            why = f"{text!r:.60} is of the sweep itself; allowed: settings of the scenario"
            document.validate(_File, also=[(f"sweep.set[{i}]", why)])
    try:
        base = _base(file, document, settings)
    except RequestError as error:
        places = {_key_of(text): f"sweep.set[{i}]" for i, text in enumerate(settings.set_)}
        raise RequestError(_told(document, places, str(error))) from None
    assert base.document is not None
    table = base.document.table
    paths, problems = _paths(settings, table)
    constraints, fixed, more = _constraints(settings, paths, table)
    if problems or more:
        document.validate(_File, also=[*problems, *more])
    return SweepPlan(file, settings, base, Space(settings, paths, constraints, fixed))


def _base(file: SweepFile, document: Document, settings: SweepSettings) -> LoadedScenario:
    """Return the scenario that varies: the rest of the file, or the one that it names."""
    rest = {key: value for key, value in document.table.items() if key != "sweep"}
    own = tuple(text for text in file.overrides if not _is_of_sweep(text))
    if settings.scenario is None:
        text = _without_sweep(file.text, {**config.parse(file.text).table})
        overrides = (*settings.set_, *own)
        parsed = config.parse(text, overrides=overrides, source=file.source)
        return load_document(parsed, file.name, Path(file.folder), overrides=overrides, within=Path(file.folder))
    if rest and not own:
        key = next(iter(rest))
        text = f"has no effect beside sweep.scenario = {settings.scenario!r}; allowed: in its own file, or in sweep.set"
        document.validate(_File, also=[(key, text)])
    beside = settings.scenario.endswith(".toml")
    path = Path(file.folder) / settings.scenario if beside else assets.scenario_path(settings.scenario)
    overrides = (*settings.set_, *own)
    parsed = config.read(path, overrides=overrides)
    return load_document(parsed, path.stem, path.parent, overrides=overrides, within=Path(file.folder))


def _key_of(override: str) -> str:
    return keys.show(keys.split(override.partition("=")[0]) or ())


def _told(document: Document, places: Mapping[str, str], reason: str) -> str:
    """Return a reason in which overrides that nobody wrote as such are named by their places in the sweep's file."""
    lines = []
    for line in reason.splitlines():
        name, _, rest = line.removeprefix("--set ").partition(": ")
        placed = line.startswith("--set ") and name in places
        lines.append(document.placed(f"{places[name]}: {name}: {rest}") if placed else line)
    return "\n".join(lines)


def _is_of_sweep(override: str) -> bool:
    path = keys.split(override.partition("=")[0])
    return path is not None and path[0] == "sweep"


def _without_sweep(text: str, table: Mapping[str, object]) -> str:
    """Return the text without its ``[sweep]``; the lines of everything else stay where they are.

    Raises
    ------
    RequestError
        If it is not written as tables of its own.
    """
    out, inside = [], False
    for line in text.splitlines(keepends=True):
        if _HEADER.match(line):
            inside = _OF_SWEEP.match(line) is not None
        out.append("\n" if inside else line)
    rest = "".join(out).rstrip() + "\n"
    wanted = {key: value for key, value in table.items() if key != "sweep"}
    try:
        fits = toml.loads(rest) == wanted
    except ValueError:
        fits = False
    if not fits:
        msg = "sweep: is not written as tables of its own; allowed: [sweep], then [[sweep.axes]], with their keys below"
        raise RequestError(msg)
    return rest


def _paths(settings: SweepSettings, table: Mapping[str, object]) -> tuple[list[list[str]], list[tuple[str, str]]]:
    """Return the key paths of each axis, ``[*]`` replaced, and the problems of those that do not fit."""
    out: list[list[str]] = []
    problems: list[tuple[str, str]] = []
    seen: dict[tuple[str | int, ...], int] = {}
    for i, axis in enumerate(settings.axes):
        given = axis.key or axis.table_keys
        paths = [path for text in given for path in _expanded(str(text), table)]
        if axis.key:
            out.append(paths)
        else:
            out.append([])
            if any("[*]" in str(text) for text in given):
                problems.append((f"sweep.axes[{i}].list", "has [*]; allowed: with key"))
        if not paths:
            why = (
                f"{given[0]!r:.60} fits no list of the scenario; allowed: [*] after the key of one that is in its file"
            )
            problems.append((f"sweep.axes[{i}].key", why))
        for text in paths:
            parts = keys.split(text)
            assert parts is not None  # SweepSettings has checked it
            if parts[0] in ("sweep", "schema"):
                problems.append((f"sweep.axes[{i}].key", f"{text!r} cannot vary; allowed: keys of the scenario"))
            for other, j in seen.items():
                if other[: len(parts)] == parts or parts[: len(other)] == other:
                    problems.append(
                        (f"sweep.axes[{i}].key", f"{text!r} is set by axes[{j}] too; allowed: each key once")
                    )
                    break
            seen.setdefault(parts, i)
    return out, problems


def _expanded(text: str, table: Mapping[str, object]) -> Iterator[str]:
    """Yield the key paths that one with ``[*]`` means."""
    before, star, after = text.partition("[*]")
    if not star:
        yield keys.show(keys.split(text) or (text,))
        return
    found = _at(table, keys.split(before) or ())
    for i in range(len(found) if isinstance(found, list) else 0):
        yield from _expanded(f"{before}[{i}]{after}", table)


def _at(table: object, path: Sequence[str | int]) -> object:
    """Return what a table holds at a key path, or None."""
    for part in path:
        if isinstance(table, dict) and isinstance(part, str):
            table = table.get(part)
        elif isinstance(table, list) and isinstance(part, int) and part < len(table):
            table = table[part]
        else:
            return None
    return table


def _constraints(
    settings: SweepSettings, paths: Sequence[Sequence[str]], table: Mapping[str, object]
) -> tuple[list[Constraint], dict[str, float], list[tuple[str, str]]]:
    """Return the constraints, the values of keys in them that do not vary, and problems."""
    varied = {path for group in paths for path in group}
    varied.update(name for axis in settings.axes for name in axis.table_keys)
    out, fixed, problems = [], {}, []
    for i, text in enumerate(settings.require):
        try:
            constraint = read_constraint(text)
        except RequestError as error:
            problems.append((f"sweep.require[{i}]", str(error)))
            continue
        out.append(constraint)
        for name in sorted(constraint.names - varied):
            value = _at(table, keys.split(name) or ())
            if isinstance(value, int | float) and not isinstance(value, bool):
                fixed[name] = float(value)
            else:
                why = f"{name!r} neither varies nor is a number in the scenario's file; allowed: one that does or is"
                problems.append((f"sweep.require[{i}]", why))
    return out, fixed, problems

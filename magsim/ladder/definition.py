"""A ladder: which flights make a set, and in which worlds they are seen. Frozen in a file, and named by its digest."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from magsim import config
from magsim.config import Strict
from magsim.config.schema import did_you_mean
from magsim.errors import RequestError

HERE = Path(__file__).parent

LADDER = "v1"
"""The ladder of this version of magsim."""

Texts = Annotated[tuple[str, ...], Field(strict=False)]


class SetFlight(Strict):
    """One flight of a set: settings on top of the scenario, with words in braces that each set draws."""

    set: Texts = ()
    test: bool = False


class Level(Strict):
    """One world, and what becomes of the flights of a set in it.

    Attributes
    ----------
    of : str
        Name of the level whose settings it begins with.
    scenario : str
        File of the flight, beside that of the ladder.
    groups, set : tuple of str
        Settings on top.
    flights : mapping
        Further settings of single flights.
    sensors : tuple of str
        Scalar magnetometers that are judged, one after another.
    widths : bool
        Half widths of the steel's hysteresis are drawn for each set.
    days_later : int
        The tests are flown so many days after the training flights.
    individual : {"", "other", "transferred"}
        ``other``: all flights are of another individual; ``transferred``: only the tests are.
    updated_s : float [s]
        So much of a flight of the tests' individual is learned as well.
    site : {"", "elsewhere", "300 km"}
        Where the tests are flown.
    boxes : int
        Training flights that are learned from.
    foreign : bool
        The aircraft follows the laws of ``magsim.ladder.foreign``.
    family : {"", "strong"}
        Levels with exaggerated sizes stand apart.
    """

    name: str
    title: str
    note: str = ""
    of: str = ""
    scenario: str = "flight.toml"
    groups: Texts = ()
    set: Texts = ()
    flights: dict[str, Texts] = Field(default={})
    sensors: Texts = ("cabin",)
    widths: bool = False
    days_later: int = Field(default=0, ge=0)
    individual: Literal["", "other", "transferred"] = ""
    updated_s: float = Field(default=0.0, ge=0.0)
    site: Literal["", "elsewhere", "300 km"] = ""
    boxes: int = Field(default=2, ge=1)
    foreign: bool = False
    family: Literal["", "strong"] = ""


class _File(Strict):
    """A ladder's file."""

    schema_: Literal[1] = Field(alias="schema")
    name: str
    title: str
    quick: Texts
    networks: Texts
    flights: dict[str, SetFlight]
    groups: dict[str, Texts]
    levels: Annotated[tuple[Level, ...], Field(strict=False)]

    @model_validator(mode="after")
    def _refers_to_what_there_is(self) -> "_File":
        seen: list[str] = []
        for level in self.levels:
            wrong = [name for name in (level.of,) if name and name not in seen]
            wrong += [name for name in level.groups if name not in self.groups]
            wrong += [name for name in level.flights if name not in self.flights]
            if wrong or level.name in seen:
                msg = f"level {level.name} refers to {', '.join(wrong) or 'a name that is taken'}"
                raise ValueError(msg)
            seen.append(level.name)
        return self


@dataclass(frozen=True)
class Ladder:
    """A ladder, read.

    Attributes
    ----------
    name, title : str
    flights : mapping
        Flights of a set by role, in the order in which they are flown.
    levels : mapping
        By name; each with all that it has of other levels.
    quick, networks : tuple of str
        Levels of a quick look, and those of them that networks are shown on.
    texts : mapping
        The files by name.
    """

    name: str
    title: str
    flights: Mapping[str, SetFlight]
    levels: Mapping[str, Level]
    quick: tuple[str, ...]
    networks: tuple[str, ...]
    texts: Mapping[str, bytes]

    @cached_property
    def sha256(self) -> str:
        """Digest of all files: what scores name."""
        digest = hashlib.sha256()
        for name in sorted(self.texts):
            digest.update(f"{name} {len(self.texts[name])}\n".encode())
            digest.update(self.texts[name])
        return digest.hexdigest()

    def chosen(self, names: tuple[str, ...]) -> tuple[Level, ...]:
        """Return levels by name, in the ladder's order.

        Raises
        ------
        RequestError
            If there is no such level.
        """
        for name in names:
            if name not in self.levels:
                msg = f"there is no level {name!r}{did_you_mean(name, self.levels)}; allowed: {', '.join(self.levels)}"
                raise RequestError(msg)
        return tuple(level for level in self.levels.values() if level.name in names)


@lru_cache(maxsize=1)
def read_ladder(name: str = LADDER) -> Ladder:
    """Read a shipped ladder."""
    folder = HERE / name
    texts = {path.name: path.read_bytes() for path in sorted(folder.glob("*.toml"))}
    file = config.load(folder / "levels.toml", _File)
    levels: dict[str, Level] = {}
    for level in file.levels:
        levels[level.name] = _whole(level, levels.get(level.of), file.groups)
    return Ladder(file.name, file.title, file.flights, levels, file.quick, file.networks, texts)


def _whole(level: Level, base: Level | None, groups: Mapping[str, tuple[str, ...]]) -> Level:
    """Return a level with the settings of its groups, on top of what the level has that it begins with."""
    own = tuple(text for name in level.groups for text in groups[name]) + level.set
    if base is None:
        return level.model_copy(update={"set": own})
    inherited = base.model_dump(exclude={"name", "title", "note", "of", "groups", "set", "flights", "family"})
    given = {key: value for key, value in level.model_dump().items() if key in level.model_fields_set}
    flights = {
        role: base.flights.get(role, ()) + level.flights.get(role, ()) for role in {**base.flights, **level.flights}
    }
    return Level(**{**inherited, **given, "set": base.set + own, "flights": flights})

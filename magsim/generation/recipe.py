"""Recipes: the flights of a data set, their files, and what a user must know about it."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import date as Date
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, TypeAdapter, ValidationError

from magsim import assets, columns, config
from magsim.config import Document, Name, Strict
from magsim.errors import RequestError
from magsim.generation.flying import FlightTask
from magsim.loading import LoadedScenario, load_scenario

RECIPE = "recipe.toml"
"""Name of the file that makes a folder a data set."""

LONGEST_NAME = 40

Texts = Annotated[tuple[str, ...], Field(strict=False)]

_TEXTS = TypeAdapter(Texts)


class FlightRecipe(Strict):
    """One flight."""

    name: Name
    scenario: str = Field(
        min_length=1, description="name of a shipped scenario, or a file beside the recipe that ends with .toml"
    )
    set_: Texts = Field(default=(), alias="set", description="settings that replace the scenario's, as with --set")
    splits: Annotated[tuple[Literal["train", "valid", "test"], ...], Field(strict=False, min_length=1)] = Field(
        description="every split that its rows must have; no other is allowed"
    )


class ShardRecipe(Strict):
    """One file of flights."""

    name: Name
    note: str = Field(default="", description="its content, for the card")
    group: Name | None = Field(
        default=None, description="files of one group belong together: methods are fitted and judged on them as a whole"
    )
    level: int | None = Field(default=None, ge=0, le=1000, description="step of difficulty, for reports")
    set_: Texts = Field(default=(), alias="set", description="settings of all its flights")
    flights: Annotated[tuple[FlightRecipe, ...], Field(strict=False, min_length=1)]


class Recipe(Strict):
    """A data set."""

    schema_: Literal[1] = Field(alias="schema", description="version of this format")
    title: str = Field(min_length=1, max_length=200)
    description: str = Field(min_length=1, max_length=2000)
    version: str = Field(default="1.0.0", pattern=r"^\d+\.\d+\.\d+$", description="of the recipe")
    date: Date = Field(description="when this version of the recipe was made")
    license: str = Field(default="CC-BY-4.0", pattern=r"^[A-Za-z0-9.+-]+$", description="an SPDX identifier")
    creator: str = Field(default="The magsim developers", min_length=1)
    keywords: Texts = ()
    uses: Texts = Field(default=(), description="intended uses, a sentence each")
    limits: Texts = Field(default=(), description="limits, a sentence each")
    samples: int = Field(default=20, ge=2, le=1000, description="rows of each flight in samples.csv")
    shards: Annotated[tuple[ShardRecipe, ...], Field(strict=False, min_length=1)]


@dataclass(frozen=True)
class RecipeTask(FlightTask):
    """One flight of a recipe: its settings are those of the file, then those of the flight.

    Attributes
    ----------
    splits : frozenset of str
        Splits that its rows must have.
    digest : str
        Of the scenario with its aircraft.
    """

    splits: frozenset[str]
    digest: str


@dataclass(frozen=True)
class LoadedRecipe:
    """A recipe with its folder and its flights.

    Attributes
    ----------
    name : str
        Name of the data set, which is that of the folder.
    folder : Path
    recipe : Recipe
    tasks : tuple of RecipeTask
        In the order of the recipe.
    """

    name: str
    folder: Path
    recipe: Recipe
    tasks: tuple[RecipeTask, ...]


def load_recipe(name_or_path: str | Path) -> LoadedRecipe:
    """Read and check a recipe and every scenario that it names.

    Parameters
    ----------
    name_or_path : str or Path
        The name of a shipped data set, or the path of a folder with a ``recipe.toml``.

    Raises
    ------
    RequestError
        If anything is wrong: one line for each problem, with file and line.
    """
    folder = assets.dataset_dir(name_or_path)
    name = folder.resolve().name
    document = config.read(folder / RECIPE)
    scenarios: dict[tuple[int, int], LoadedScenario] = {}
    problems = [*_double_names(document)]
    if not re.fullmatch(columns.NAME_PATTERN, name) or len(name) > LONGEST_NAME:
        text = f"the folder's name {name[:60]!a} cannot name a data set; allowed: lower-case letters, digits and _"
        problems.append(("title", text))
    for i, j, path, overrides in _named_scenarios(document, folder):
        try:
            scenarios[i, j] = load_scenario(path, overrides)
        except RequestError as error:
            problems += [(f"shards[{i}].flights[{j}].scenario", line) for line in str(error).splitlines()]
    recipe = document.validate(Recipe, also=problems)
    tasks = []
    for i, shard in enumerate(recipe.shards):
        for j, flight in enumerate(shard.flights):
            path = _scenario_path(flight.scenario, folder)
            digest = scenarios[i, j].digest
            overrides = (*shard.set_, *flight.set_)
            tasks.append(RecipeTask(flight.name, shard.name, path, overrides, frozenset(flight.splits), digest))
    return LoadedRecipe(name, folder, recipe, tuple(tasks))


def _tables(value: object) -> list[dict[str, object]]:
    """Return the tables of a list; an empty one for anything else in it, and none if it is no list."""
    return [item if isinstance(item, dict) else {} for item in value] if isinstance(value, list) else []


def _double_names(document: Document) -> Iterator[tuple[str, str]]:
    """Yield the problems with names that are used twice."""
    seen = set()
    for i, shard in enumerate(_tables(document.table.get("shards"))):
        places = [(f"shards[{i}].name", "file", shard.get("name"))]
        flights = _tables(shard.get("flights"))
        places += [(f"shards[{i}].flights[{j}].name", "flight", flight.get("name")) for j, flight in enumerate(flights)]
        for key, kind, name in places:
            if isinstance(name, str) and (kind, name) in seen:
                yield key, f"{name[:60]!a} is the name of another {kind}; allowed: each name once"
            seen.add((kind, str(name)))


def _named_scenarios(document: Document, folder: Path) -> Iterator[tuple[int, int, Path, tuple[str, ...]]]:
    """Yield the scenarios of valid flights; validation of the whole recipe reports the others."""
    for i, shard in enumerate(_tables(document.table.get("shards"))):
        for j, table in enumerate(_tables(shard.get("flights"))):
            try:
                flight = FlightRecipe.model_validate(table)
                shared = _TEXTS.validate_python(shard.get("set", []), strict=False)
            except ValidationError:
                continue
            yield i, j, _scenario_path(flight.scenario, folder), (*shared, *flight.set_)


def _scenario_path(text: str, folder: Path) -> Path:
    """Return the file of a scenario: beside the recipe, or a shipped one; the working folder does not matter."""
    if text.endswith(".toml"):
        return folder / text
    return assets.ROOT / "scenarios" / f"{text}.toml" if text in assets.list_scenarios() else folder / text

"""A scenario with all that it refers to, read from its files."""

import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from pydantic import ValidationError

from magsim import assets, config
from magsim.aircraft import Aircraft, Bird, load_aircraft, load_bird
from magsim.config import Document
from magsim.errors import RequestError
from magsim.planning import FlyableScenario
from magsim.scenario import Scenario, Tow, TrackLog, TrackPattern, ground_of
from magsim.scenario.tracklog import TrackProblemsError, read_track, start_of
from magsim.terrain import Grid, Ground


@dataclass(frozen=True)
class LoadedScenario:
    """A scenario with all that it refers to: what ``simulate`` takes.

    Attributes
    ----------
    name : str
        Name of the scenario: the file's stem.
    scenario : Scenario
    aircraft : Aircraft
    text : str
        The scenario file as it was read.
    overrides : tuple of str
        ``key.path=value`` settings that were laid over the text.
    ground : Ground, optional
        What ``[terrain]`` means; None without it.
    track : TrackLog, optional
        The logged track that a pattern ``track`` flies.
    bird : Bird, optional
        What is towed.
    document : Document, optional
        The file, for messages that name a line of it.
    """

    name: str
    scenario: Scenario
    aircraft: Aircraft
    text: str
    overrides: tuple[str, ...] = ()
    ground: Ground | None = None
    track: TrackLog | None = None
    document: Document | None = None
    bird: Bird | None = None

    def placed(self, text: str) -> str:
        """A message that begins with a key of the scenario, with file and line; any other as it is."""
        return text if self.document is None else self.document.placed(text)

    @cached_property
    def digest(self) -> str:
        """SHA-256 over the meaning of the scenario, the aircraft's files and its own files, in hexadecimal.

        Comments, order of keys and values that equal the default do not count.
        """
        meaning = json.dumps(self.scenario.model_dump(mode="json", by_alias=True), sort_keys=True)
        parts = [meaning, self.aircraft.digest, *self._file_digests()]
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()

    def _file_digests(self) -> Iterator[str]:
        if self.ground is not None and isinstance(self.ground.surface, Grid):
            yield self.ground.surface.digest
        if self.track is not None:
            yield self.track.digest
        if self.bird is not None:
            yield self.bird.digest


def load_scenario(
    name_or_path: str | Path, overrides: Sequence[str] = (), *, aircraft: Aircraft | None = None
) -> LoadedScenario:
    """Read and check a scenario with the aircraft that it flies.

    Parameters
    ----------
    name_or_path : str or Path
        A TOML file, or the name of a shipped scenario with or without ``.toml``.
    overrides : sequence of str
        ``key.path=value`` settings that are laid over the file.
    aircraft : Aircraft, optional
        Flies instead of the one that the scenario names.

    Returns
    -------
    LoadedScenario
        Its ``scenario.aircraft`` is the name of the aircraft's folder, whatever path the file gives.

    Raises
    ------
    RequestError
        If anything is wrong: one line for each problem, with file and line.
    """
    path = assets.scenario_path(name_or_path)
    document = config.read(path, overrides=overrides)
    aircraft, problems = (aircraft, ()) if aircraft is not None else _aircraft_of(document, path.parent)
    also = [("aircraft", problem) for problem in problems]
    if aircraft is not None:
        document.table["aircraft"] = aircraft.name  # its files count in the digest, not where they lie
    bird, problems = _bird_of(document, path.parent)
    also += [("tow.bird", problem) for problem in problems]
    track, problems = _track_of(document.table, path.parent, aircraft)
    also += [("pattern.file", problem) for problem in problems]
    context = {"aircraft": aircraft, "bird": bird}
    scenario = document.validate(FlyableScenario, context=context, also=also)
    assert aircraft is not None  # else validate had told a problem
    ground = None
    try:
        ground = ground_of(scenario.terrain, scenario.start, scenario.seed, path.parent)
    except RequestError as error:
        document.validate(FlyableScenario, context=context, also=[("terrain.file", str(error))])
    return LoadedScenario(path.stem, scenario, aircraft, document.text, tuple(overrides), ground, track, document, bird)


def _aircraft_of(document: Document, folder: Path) -> tuple[Aircraft | None, Sequence[str]]:
    """The aircraft that a scenario names, with what is wrong in its files.

    A path in the file begins where the file lies; one that is set on the command line, in the working folder.
    """
    name = document.table.get("aircraft")
    if not isinstance(name, str):
        return None, ()  # told with everything else that is wrong in the scenario
    try:
        return load_aircraft(name, _base(document, ("aircraft",), folder)), ()
    except RequestError as error:
        return None, str(error).splitlines()


def _base(document: Document, key: tuple[str, ...], folder: Path) -> Path | None:
    """Where a path under a key begins: where the file lies, or the working folder for one of the command line."""
    return None if any(override.path == key for override in document.overrides) else folder


def _bird_of(document: Document, folder: Path) -> tuple[Bird | None, Sequence[str]]:
    """The bird that a scenario tows, with what is wrong in its files; see ``_aircraft_of``."""
    table = document.table.get("tow")
    name = table.get("bird", Tow.model_fields["bird"].default) if isinstance(table, dict) else None
    if not isinstance(name, str):
        return None, ()
    try:
        bird = load_bird(name, _base(document, ("tow", "bird"), folder))
    except RequestError as error:
        return None, str(error).splitlines()
    table["bird"] = bird.name
    return bird, ()


def _track_of(
    table: dict[str, object], folder: Path, aircraft: Aircraft | None
) -> tuple[TrackLog | None, tuple[str, ...]]:
    """The track that a scenario names, with what is wrong in its file.

    What ``[start]`` leaves out of place, height, speed and heading is filled from the track.
    """
    pattern, start = table.get("pattern"), table.setdefault("start", {})
    if not isinstance(pattern, dict) or pattern.get("kind") != "track" or not isinstance(start, dict):
        return None, ()
    track, problems, settings = None, (), None
    try:
        settings = TrackPattern.model_validate(pattern)
        track = read_track(settings, folder)
    except ValidationError:
        pass  # told with everything else that is wrong in the scenario
    except TrackProblemsError as error:
        problems = error.lines
    # What the file would have said is not told as missing where its settings are wrong.
    if track is not None or problems or settings is None:
        for name, value in start_of(track, aircraft).items():
            start.setdefault(name, value)
    return track, problems

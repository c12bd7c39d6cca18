"""Scenarios read from their files, together with everything that they refer to."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from pydantic import ValidationError

from magsim import assets, config
from magsim.aircraft import Aircraft, Bird, load_aircraft, load_bird
from magsim.config import Document
from magsim.errors import RequestError
from magsim.planning import FlyableScenario, check_swell
from magsim.population import what_is_flown
from magsim.scenario import Scenario, Tow, TrackLog, TrackPattern, ground_of, resting_settings
from magsim.scenario.tracklog import TrackProblemsError, read_track, start_of
from magsim.terrain import Ground


@dataclass(frozen=True)
class LoadedScenario:
    """A scenario with all that it refers to, ready to be flown.

    Attributes
    ----------
    name : str
        Name of the scenario: the file's stem.
    scenario : Scenario
        With what its day sets.
    aircraft : Aircraft
        The individual that flies, on that day.
    text : str
        The scenario file as it was read.
    overrides : tuple of str
        ``key.path=value`` settings that were applied on top of the text.
    ground : Ground, optional
        The surface that ``[terrain]`` describes; None without it.
    track : TrackLog, optional
        The logged track that a pattern ``track`` flies.
    document : Document, optional
        The file, for messages that name a line of it.
    bird : Bird, optional
        The towed bird.
    folder : Path, optional
        Folder of the file, where relative paths in it begin.
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
    folder: Path | None = None

    def placed(self, text: str) -> str:
        """Return a message that begins with a key of the scenario with file and line; any other unchanged."""
        return text if self.document is None else self.document.placed(text)

    @property
    def resting(self) -> tuple[str, ...]:
        """Settings of the file that have no effect, one line for each table; empty where it was not read from one."""
        if self.document is None:
            return ()
        vehicles = [self.aircraft] if self.bird is None else [self.aircraft, self.bird]
        found = resting_settings(self.scenario, self.document.table, vehicles)
        return tuple(self.placed(f"{key}: {text}") for key, text in found)

    def changed(self, overrides: Sequence[str], *, within: Path | None = None) -> "LoadedScenario":
        """Return the scenario with further overrides on top of its own.

        Its aircraft is kept unless an override names another one; other files are read again.

        Parameters
        ----------
        overrides : sequence of str
            ``key.path=value`` settings.
        within : Path, optional
            Folder in which a relative path of an override begins; the working folder by default.

        Raises
        ------
        RequestError
            If anything is wrong, or the scenario was not read from a file.
        """
        if not overrides:
            return self
        if self.document is None or self.folder is None:
            msg = f"{self.name}: was not read from a file; allowed: without further settings"
            raise RequestError(msg)
        overrides = (*self.overrides, *overrides)
        document = config.parse(self.text, overrides=overrides, source=self.document.source)
        renamed = any(override.path == ("aircraft",) for override in document.overrides[len(self.document.overrides) :])
        aircraft = None if renamed else self._type
        return load_document(document, self.name, self.folder, overrides=overrides, aircraft=aircraft, within=within)

    @property
    def _type(self) -> Aircraft:
        """The nominal aircraft of which the one that flies is an individual."""
        nominal = self.aircraft.nominal
        return nominal if isinstance(nominal, Aircraft) else self.aircraft

    @cached_property
    def digest(self) -> str:
        """SHA-256 over the meaning of the scenario, its aircraft, ground, track and bird, in hexadecimal.

        It is computed from what is flown, so that a changed copy has another one. Comments, order of keys and values
        that equal the default do not count.
        """
        meaning = json.dumps(self.scenario.model_dump(mode="json", by_alias=True), sort_keys=True)
        flown = {"aircraft": self.aircraft, "ground": self.ground, "track": self.track, "bird": self.bird}
        parts = [meaning, *(f"{name} {part.digest}" for name, part in flown.items() if part is not None)]
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def load_scenario(
    name_or_path: str | Path, overrides: Sequence[str] = (), *, aircraft: Aircraft | None = None
) -> LoadedScenario:
    """Read and check a scenario with the aircraft that it flies.

    Parameters
    ----------
    name_or_path : str or Path
        A TOML file, or the name of a shipped scenario with or without ``.toml``.
    overrides : sequence of str
        ``key.path=value`` settings that are applied on top of the file.
    aircraft : Aircraft, optional
        Flies instead of the one that the scenario names: the type, of which the scenario may set an individual.

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
    return load_document(
        config.read(path, overrides=overrides), path.stem, path.parent, overrides=overrides, aircraft=aircraft
    )


def load_document(
    document: Document,
    name: str,
    folder: Path,
    *,
    overrides: Sequence[str] = (),
    aircraft: Aircraft | None = None,
    within: Path | None = None,
) -> LoadedScenario:
    """Check a scenario that has been parsed, and read everything that it refers to from its folder.

    Parameters
    ----------
    document : Document
        With the overrides applied.
    name : str
        Of the scenario.
    folder : Path
        In which relative paths of the text begin.
    overrides : sequence of str
        Those of the document.
    aircraft : Aircraft, optional
        The type that flies instead of the one that the scenario names.
    within : Path, optional
        Folder in which a relative path of an override begins; the working folder by default.

    Raises
    ------
    RequestError
        If anything is wrong: one line for each problem, with file and line.
    """
    if "sweep" in document.table:
        msg = f"{document.source}: is a sweep of many flights ([sweep]); magsim sweep flies them"
        raise RequestError(msg)
    also: list[tuple[str, str]] = []
    _replace_other_way(document)
    if aircraft is None:
        aircraft, problems = _aircraft_of(document, folder, within)
        also += [("aircraft", problem) for problem in problems]
    if aircraft is not None:
        document.table["aircraft"] = aircraft.name  # its files count in the digest, not their place
    bird, problems = _bird_of(document, folder, within)
    also += [("tow.bird", problem) for problem in problems]
    beside = _base(document, ("pattern", "file"), folder, within) or folder
    track, problems = _track_of(document.table, beside, aircraft)
    also += [("pattern.file", problem) for problem in problems]
    context = {"aircraft": aircraft, "bird": bird}
    scenario = document.validate(FlyableScenario, context=context, also=also)
    assert aircraft is not None  # else validate had raised
    ground = None
    try:
        beside = _base(document, ("terrain", "file"), folder, within) or folder
        ground = ground_of(scenario.terrain, scenario.start, scenario.seed, beside)
    except RequestError as error:
        document.validate(FlyableScenario, context=context, also=[("terrain.file", str(error))])
    if found := [*check_swell(scenario, ground, track, bird)]:
        document.validate(FlyableScenario, context=context, also=found)
    try:
        flown, aircraft, bird = what_is_flown(scenario, aircraft, bird)
    except RequestError as error:
        document.validate(FlyableScenario, context=context, also=[("individual", str(error))])
    return LoadedScenario(
        name,
        flown,
        aircraft,
        document.text,
        tuple(overrides),
        ground=ground,
        track=track,
        document=document,
        bird=bird,
        folder=folder,
    )


EITHER = (("air", "turbulence_severity", "turbulence_mps"), ("pattern", "preset", "maneuvers"))
"""Tables with two keys that say the same in two ways."""


def _replace_other_way(document: Document) -> None:
    """Drop what the file gives in one way where an override gives it in the other."""
    given = {override.path for override in document.overrides}
    for name, *ways in EITHER:
        table = document.table.get(name)
        for way, other in (ways, ways[::-1]):
            if isinstance(table, dict) and (name, way) in given and (name, other) not in given:
                table.pop(other, None)


def _aircraft_of(document: Document, folder: Path, within: Path | None) -> tuple[Aircraft | None, Sequence[str]]:
    """Return the aircraft that a scenario names, and the problems of its files.

    A path in the file begins in the folder of the file; one that is set on the command line, in the working folder.
    """
    name = document.table.get("aircraft")
    if not isinstance(name, str):
        return None, ()  # reported with everything else that is wrong in the scenario
    try:
        return load_aircraft(name, _base(document, ("aircraft",), folder, within)), ()
    except RequestError as error:
        return None, str(error).splitlines()


def _base(document: Document, key: tuple[str, ...], folder: Path, within: Path | None) -> Path | None:
    """Return where a path under a key begins: the file's folder; for an override ``within``, or the working folder."""
    set_here = any(key[: len(override.path)] == override.path for override in document.overrides)
    return within if set_here else folder


def _bird_of(document: Document, folder: Path, within: Path | None) -> tuple[Bird | None, Sequence[str]]:
    """Return the bird that a scenario tows, and the problems of its files; see ``_aircraft_of``."""
    table = document.table.get("tow")
    if not isinstance(table, dict):
        return None, ()
    name = table.get("bird", Tow.model_fields["bird"].default)
    if not isinstance(name, str):
        return None, ()
    try:
        bird = load_bird(name, _base(document, ("tow", "bird"), folder, within))
    except RequestError as error:
        return None, str(error).splitlines()
    table["bird"] = bird.name
    return bird, ()


def _track_of(
    table: dict[str, object], folder: Path, aircraft: Aircraft | None
) -> tuple[TrackLog | None, Sequence[str]]:
    """Return the track that a scenario names, and the problems of its file.

    Place, height, speed and heading that ``[start]`` leaves out are filled from the track.
    """
    pattern, start = table.get("pattern"), table.setdefault("start", {})
    if not isinstance(pattern, dict) or pattern.get("kind") != "track" or not isinstance(start, dict):
        return None, ()
    track: TrackLog | None = None
    problems: Sequence[str] = ()
    settings: TrackPattern | None = None
    try:
        settings = TrackPattern.model_validate(pattern)
        track = read_track(settings, folder)
    except ValidationError:
        pass  # reported with everything else that is wrong in the scenario
    except TrackProblemsError as error:
        problems = error.lines
    # Keys of [start] that the file would have given are not reported as missing where its settings are wrong.
    if track is not None or problems or settings is None:
        for name, value in start_of(track, aircraft).items():
            start.setdefault(name, value)
    return track, problems

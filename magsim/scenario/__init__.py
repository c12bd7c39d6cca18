"""A scenario: where, when, how flown, which physics, which instruments, which seed.

The models here are the meaning of a scenario file; ``magsim.config`` reads it and reports every error with
file and line. Limits that belong to the aircraft are checked in the same pass: the aircraft comes in as
``context["aircraft"]`` of the validation.
"""

import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Discriminator, Field, ValidationError, ValidationInfo, field_validator

from magsim import assets, config
from magsim.aircraft import Aircraft, load_aircraft
from magsim.config import Document, Problems, Strict
from magsim.errors import RequestError
from magsim.scenario.air import Air, Gust, LinearShear, LogShear, RandomGusts, check_wind
from magsim.scenario.base import aircraft_of
from magsim.scenario.electronics import Electronics
from magsim.scenario.flaps import FlapMove, check_moves
from magsim.scenario.geology import (
    Crust,
    DipoleTarget,
    PrismTarget,
    SphereTarget,
    Target,
    check_crust,
    check_targets,
    shortest_crust_m,
)
from magsim.scenario.instruments import (
    Barometer,
    BaseStation,
    Cabin,
    Clock,
    Electrical,
    FluxgateSensor,
    Ins,
    Radar,
    ScalarSensor,
    Sensor,
    Sensors,
)
from magsim.scenario.loading import Loading
from magsim.scenario.maneuvers import Combined, Maneuver, PhasedSwing, Planned, Swing, Train, schedule
from magsim.scenario.patterns import (
    LEGS,
    Box,
    Centered,
    Cloverleaf,
    Diamond,
    Fom,
    FomPeakToPeak,
    HeadingCross,
    LegPattern,
    PatternBase,
    Square,
    StraightLine,
    Survey,
    check_pattern,
    check_surveys,
    heights_of,
    key_of,
    legs_allowed,
    needed_s,
    parts_of,
)
from magsim.scenario.patterns import (
    Sequence as PatternSequence,
)
from magsim.scenario.physics import Earth, Eddy, Field_, Part
from magsim.scenario.place import Place
from magsim.scenario.start import FlightSettings, Start
from magsim.scenario.terrain import FlatTerrain, FractalTerrain, GridTerrain, Terrain, ground_of
from magsim.scenario.track import Track, check_track
from magsim.scenario.tracklog import TrackLog, TrackProblemsError, read_track, start_of
from magsim.scenario.variation import Variation
from magsim.terrain import Grid, Ground

__all__ = [
    "LEGS",
    "Air",
    "Barometer",
    "BaseStation",
    "Box",
    "Cabin",
    "Centered",
    "Clock",
    "Cloverleaf",
    "Combined",
    "Crust",
    "Diamond",
    "DipoleTarget",
    "Earth",
    "Eddy",
    "Electrical",
    "Electronics",
    "Field_",
    "FlapMove",
    "FlatTerrain",
    "FlightSettings",
    "FluxgateSensor",
    "Fom",
    "FomPeakToPeak",
    "FractalTerrain",
    "GridTerrain",
    "Gust",
    "HeadingCross",
    "Ins",
    "LegPattern",
    "LinearShear",
    "LoadedScenario",
    "Loading",
    "LogShear",
    "Maneuver",
    "Part",
    "Pattern",
    "PatternBase",
    "PatternSequence",
    "PhasedSwing",
    "Place",
    "Planned",
    "PrismTarget",
    "Radar",
    "RandomGusts",
    "RecordingSettings",
    "ScalarSensor",
    "Scenario",
    "Sensor",
    "Sensors",
    "SphereTarget",
    "Square",
    "Start",
    "StraightLine",
    "Survey",
    "Swing",
    "Target",
    "Terrain",
    "Track",
    "TrackLog",
    "Train",
    "Variation",
    "ground_of",
    "heights_of",
    "key_of",
    "legs_allowed",
    "load_scenario",
    "needed_s",
    "parts_of",
    "schedule",
    "shortest_crust_m",
]

Pattern = Annotated[
    Box | Fom | FomPeakToPeak | Diamond | Cloverleaf | StraightLine | HeadingCross | Survey | PatternSequence | Track,
    Discriminator("kind"),
]
"""Every pattern that a scenario may name."""


class RecordingSettings(Strict):
    """The rows that are written, and which of them serve for training."""

    rate_hz: int = Field(default=10, ge=5, le=20, description="rows a second; divides flight.step_hz")
    truth: Literal["full", "sum", "none"] = Field(
        default="full",
        description="full: all truth; sum: without the vector of each part; none: neither truth nor labels",
    )
    train_circuits: Annotated[tuple[int, ...], Field(strict=False)] = (1,)
    valid_legs: Annotated[tuple[int, ...], Field(strict=False)] = Field(
        default=(4,), description="legs of the training circuits that are kept for validation"
    )


class Scenario(Strict):
    """One flight, complete."""

    schema_: Literal[1] = Field(alias="schema", description="version of this format")
    seed: int = Field(ge=0, lt=2**63, description="every random number comes from it")
    title: str = ""
    aircraft: str = Field(
        description="name of a shipped aircraft, or path of a folder of your own, with a slash: ./mine"
    )
    start: Start
    terrain: Terrain | None = Field(default=None, description="the ground; without it, the ellipsoid")
    loading: Loading = Loading()
    pattern: Pattern
    flight: FlightSettings = FlightSettings()
    air: Air = Air()
    field: Field_ = Field_()
    sensors: Sensors
    recording: RecordingSettings = RecordingSettings()

    @field_validator("pattern")
    @classmethod
    def _flyable(cls, pattern: Pattern, info: ValidationInfo) -> Pattern:
        start, terrain = info.data.get("start"), info.data.get("terrain", "wrong")
        if start:
            if isinstance(pattern, Track):
                found = [*check_track(pattern, has_ground=terrain is not None)]
            else:
                found = [
                    *check_pattern(pattern, start, aircraft_of(info)),
                    *check_surveys(pattern, has_ground=terrain is not None),
                ]
            if found:
                raise Problems(*found)
        return pattern

    @field_validator("flight")
    @classmethod
    def _flaps_are_flown(cls, flight: FlightSettings, info: ValidationInfo) -> FlightSettings:
        start, pattern = info.data.get("start"), info.data.get("pattern")
        if start and pattern and flight.flaps:
            if isinstance(pattern, Track):
                raise Problems(("flaps", "a logged track has the flaps of its file; allowed: none"))
            checked = {"speed_mps": start.speed_mps, "alt_m": min(heights_of(pattern, start))}
            reach = {"circuits": pattern.circuits, "legs": pattern.legs}
            found = [*check_moves(flight.flaps, aircraft_of(info), **checked, **reach)]
            if found:
                raise Problems(*found)
        return flight

    @field_validator("sensors")
    @classmethod
    def _ground_is_told(cls, sensors: Sensors, info: ValidationInfo) -> Sensors:
        if sensors.radar and info.data.get("terrain", "wrong") is None:
            text = "a radar altimeter needs the ground; allowed: with a table [terrain], for example kind = 'flat'"
            raise Problems(("radar", text))
        return sensors

    @field_validator("air")
    @classmethod
    def _slower_than_flight(cls, air: Air, info: ValidationInfo) -> Air:
        start, pattern = info.data.get("start"), info.data.get("pattern")
        legs = pattern and not isinstance(pattern, Track)
        heights = heights_of(pattern, start) if start and legs else ()
        found = [*check_wind(air, start, heights)] if start else []
        if found:
            raise Problems(*found)
        return air

    @field_validator("field")
    @classmethod
    def _geology_in_band(cls, field: Field_, info: ValidationInfo) -> Field_:
        start, air = info.data.get("start"), info.data.get("air")
        found = [("targets" + key, text) for key, text in check_targets(field.targets)]
        if field.crust and start and air:
            found += [(f"crust.{key}", text) for key, text in check_crust(field.crust, start, air)]
        if found:
            raise Problems(*found)
        return field

    @field_validator("recording")
    @classmethod
    def _rows_exist(cls, recording: RecordingSettings, info: ValidationInfo) -> RecordingSettings:
        found = [*_check_rows(recording, info.data.get("flight"), info.data.get("pattern"))]
        if found:
            raise Problems(*found)
        return recording


def _check_rows(
    recording: RecordingSettings, flight: FlightSettings | None, pattern: Pattern | None
) -> Iterator[tuple[str, str]]:
    """Rows and splits must exist."""
    rate = recording.rate_hz
    if flight and flight.step_hz % rate:
        yield "rate_hz", f"{rate} does not divide flight.step_hz = {flight.step_hz}; allowed: a divisor of it"
    circuits = pattern.circuits if pattern else 100
    legs = getattr(pattern, "legs", LEGS)
    for key, values, last in (
        ("train_circuits", recording.train_circuits, circuits),
        ("valid_legs", recording.valid_legs, legs),
    ):
        # The default leg for validation need not exist: then there is none.
        for i, value in enumerate(values):
            if not 1 <= value <= last and key in recording.model_fields_set:
                yield f"{key}[{i}]", f"{value} is not flown; allowed: 1 to {last}"


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
    track, problems = _track_of(document.table, path.parent, aircraft)
    also += [("pattern.file", problem) for problem in problems]
    context = {"aircraft": aircraft}
    scenario = document.validate(Scenario, context=context, also=also)
    assert aircraft is not None  # else validate had told a problem
    ground = None
    try:
        ground = ground_of(scenario.terrain, scenario.start, scenario.seed, path.parent)
    except RequestError as error:
        document.validate(Scenario, context=context, also=[("terrain.file", str(error))])
    return LoadedScenario(path.stem, scenario, aircraft, document.text, tuple(overrides), ground, track, document)


def _aircraft_of(document: Document, folder: Path) -> tuple[Aircraft | None, Sequence[str]]:
    """The aircraft that a scenario names, with what is wrong in its files.

    A path in the file begins where the file lies; one that is set on the command line, in the working folder.
    """
    name = document.table.get("aircraft")
    if not isinstance(name, str):
        return None, ()  # told with everything else that is wrong in the scenario
    typed = any(override.path == ("aircraft",) for override in document.overrides)
    try:
        return load_aircraft(name, None if typed else folder), ()
    except RequestError as error:
        return None, str(error).splitlines()


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
        settings = Track.model_validate(pattern)
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

"""A whole scenario: one flight, complete."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Discriminator, Field, ValidationInfo, field_validator

from magsim.aircraft import KinematicFacts, Vehicle
from magsim.config import Problems, Strict
from magsim.scenario.air import Air
from magsim.scenario.base import aircraft_of, bird_of
from magsim.scenario.instruments import Sensors
from magsim.scenario.patterns import (
    LEGS,
    Box,
    Cloverleaf,
    Diamond,
    Fom,
    FomPeakToPeak,
    HeadingCross,
    PatternSequence,
    StraightLine,
    SurveyPattern,
)
from magsim.scenario.payload import Loading
from magsim.scenario.physics import FieldSettings
from magsim.scenario.start import FlightSettings, Start
from magsim.scenario.terrain import Terrain
from magsim.scenario.tow import Tow
from magsim.scenario.track import TrackPattern

Pattern = Annotated[
    Box
    | Fom
    | FomPeakToPeak
    | Diamond
    | Cloverleaf
    | StraightLine
    | HeadingCross
    | SurveyPattern
    | PatternSequence
    | TrackPattern,
    Discriminator("kind"),
]
"""Every pattern that a scenario may name."""


class RecordingSettings(Strict):
    """The rows that are written, and which of them serve for training."""

    NEEDS: ClassVar[Mapping[str, tuple[str, ...]]] = {"valid_legs": ("train_circuits",)}

    rate_hz: int = Field(default=10, ge=5, le=20, description="rows a second; divides flight.step_hz")
    truth: Literal["full", "sum", "none"] = Field(
        default="full",
        description="full: all truth; sum: without the vector of each part; none: neither truth nor labels",
    )
    split: Literal["train", "valid", "test"] | None = Field(
        default=None, description="what all rows serve for; without it, circuits and legs decide"
    )
    train_circuits: Annotated[tuple[int, ...], Field(strict=False)] = (1,)
    valid_legs: Annotated[tuple[int, ...], Field(strict=False)] = Field(
        default=(4,), description="legs of the training circuits that are kept for validation"
    )

    def is_for_training(self, circuit: np.ndarray, leg: np.ndarray) -> np.ndarray:
        """Return whether rows of circuits and legs, (n,) each, are training rows: validation legs are not."""
        if self.split is not None:
            return np.full(np.shape(circuit), self.split == "train")
        return np.isin(circuit, self.train_circuits) & ~np.isin(leg, self.valid_legs)


class Scenario(Strict):
    """One flight, complete."""

    schema_: Literal[1] = Field(alias="schema", description="version of this format")
    seed: int = Field(ge=0, lt=2**63, description="every random number comes from it")
    title: str = ""
    aircraft: str = Field(
        description="name of a shipped aircraft, or path of a folder of your own, with a slash: ./mine"
    )
    individual: int = Field(
        default=0, ge=0, lt=2**31, description="which aircraft of the type, and which bird; 0: the nominal ones"
    )
    day: int = Field(
        default=0,
        ge=0,
        le=10_000,
        description="which day of that individual, in whose weather and load; 0: the aircraft as built, nothing drawn",
    )
    start: Start
    terrain: Terrain | None = Field(default=None, description="the ground; without it, the ellipsoid")
    loading: Loading = Loading()
    pattern: Pattern
    tow: Tow | None = Field(default=None, description="a bird on a rope; without it, none")
    flight: FlightSettings = FlightSettings()
    air: Air = Air()
    field: FieldSettings = FieldSettings()
    sensors: Sensors
    recording: RecordingSettings = RecordingSettings()

    @field_validator("flight")
    @classmethod
    def _sways(cls, flight: FlightSettings, info: ValidationInfo) -> FlightSettings:
        aircraft = aircraft_of(info)
        if flight.sway and aircraft and not isinstance(aircraft.facts, KinematicFacts):
            raise Problems(
                ("sway", f"{aircraft.name} is flown by a flight model; allowed: for a kinematic carrier alone")
            )
        return flight

    @field_validator("field")
    @classmethod
    def _moves(cls, field: FieldSettings, info: ValidationInfo) -> FieldSettings:
        vehicles = [vehicle for vehicle in (aircraft_of(info), bird_of(info)) if vehicle]
        found = [*_check_moving(field, vehicles)] if vehicles else []
        if found:
            raise Problems(*found)
        return field

    @field_validator("sensors")
    @classmethod
    def _ground_is_given(cls, sensors: Sensors, info: ValidationInfo) -> Sensors:
        if sensors.radar and info.data.get("terrain", "wrong") is None:
            text = "a radar altimeter needs the ground; allowed: with a table [terrain], for example kind = 'flat'"
            raise Problems(("radar", text))
        if info.data.get("tow", "wrong") is None:
            found = [(key, "there is no bird; allowed: with a table [tow]") for key in sensors.of_bird]
            if sensors.carrier_ins:
                found.append(("carrier_ins", "without a bird, ins is in the carrier; allowed: with a table [tow]"))
            if found:
                raise Problems(*found)
        return sensors

    @field_validator("recording")
    @classmethod
    def _rows_exist(cls, recording: RecordingSettings, info: ValidationInfo) -> RecordingSettings:
        found = [*_check_rows(recording, info.data.get("flight"), info.data.get("pattern"))]
        if found:
            raise Problems(*found)
        return recording


def _check_moving(field: FieldSettings, vehicles: Sequence[Vehicle]) -> Iterator[tuple[str, str]]:
    """Yield the problems of parts that are asked for and that no vehicle has: key and text."""
    magnetics = [vehicle.magnetics for vehicle in vehicles]
    for name, what, exists in (
        ("flex", "mount with flex", any(mount.flex for m in magnetics for mount in m.mounts.values())),
        ("controls", "[[controls]]", any(m.controls for m in magnetics)),
        ("suspension", "part with a suspension", any(m.hangs for m in magnetics)),
    ):
        if getattr(field, name).enabled and not exists:
            names = " and ".join(vehicle.name for vehicle in vehicles)
            yield f"{name}.enabled", f"there is no {what} in the magnetics.toml of {names}; allowed: false"


def _check_rows(
    recording: RecordingSettings, flight: FlightSettings | None, pattern: Pattern | None
) -> Iterator[tuple[str, str]]:
    """Yield the problems of rows and splits that do not exist: key and text."""
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

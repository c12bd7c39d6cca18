"""What each stage of a simulation depends on.

Each stage is handed these inputs and nothing else: the settings that are none of its business have been replaced by
placeholders. So equal inputs give equal results, whatever else of two scenarios differs, and no list of keys has to be
kept.
"""

import hashlib
import json
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol, TypeVar

from magsim.aircraft import Aircraft, Bird, Magnetics, Vehicle
from magsim.aircraft.magnetics import Mount
from magsim.loading import LoadedScenario
from magsim.scenario import (
    FieldSettings,
    FluxgateSensor,
    RecordingSettings,
    ScalarSensor,
    Scenario,
    Sensors,
    TrackLog,
)
from magsim.terrain import Ground

V = TypeVar("V", bound=Vehicle)

NO_METAL = Magnetics(datum="placeholder", mounts={"none": Mount(position_m=(0.0, 0.0, 0.0), source="placeholder")})
NO_INSTRUMENTS = Sensors(scalar=(ScalarSensor(name="none", mount="none"),))


class Digested(Protocol):
    """What has a digest of its content."""

    @property
    def digest(self) -> str:
        """SHA-256 in hexadecimal."""


@dataclass(frozen=True)
class FlightInputs:
    """What a flight depends on: nothing magnetic, no instrument, of the recording the rate of rows alone.

    Attributes
    ----------
    scenario : Scenario
        Without title, individual, day, field, instruments and splits.
    aircraft : Aircraft
        Name and facts of flight.
    bird : Bird, optional
    ground : Ground, optional
    track : TrackLog, optional
    """

    scenario: Scenario
    aircraft: Aircraft
    bird: Bird | None
    ground: Ground | None
    track: TrackLog | None

    @classmethod
    def of(cls, loaded: LoadedScenario) -> "FlightInputs":
        """Return the inputs of a scenario's flight."""
        scenario = loaded.scenario
        settings = {
            "title": "",
            "individual": 0,
            "day": 0,
            "field": FieldSettings(),
            "sensors": NO_INSTRUMENTS,
            "recording": RecordingSettings(rate_hz=scenario.recording.rate_hz),
        }
        bird = None if loaded.bird is None else _without_metal(loaded.bird)
        flown = scenario.model_copy(update=settings)
        return cls(flown, _without_metal(loaded.aircraft), bird, loaded.ground, loaded.track)

    @cached_property
    def key(self) -> str:
        """Digest of all inputs."""
        return _digest(self.scenario, self.aircraft, self.bird, self.ground, self.track)


@dataclass(frozen=True)
class BackgroundInputs:
    """What the background of a flight depends on beside the flight: nothing of the aircraft, no instrument.

    Attributes
    ----------
    scenario : Scenario
        That of ``FlightInputs``, with the tables of the background.
    ground : Ground, optional
    """

    scenario: Scenario
    ground: Ground | None

    @classmethod
    def of(cls, loaded: LoadedScenario) -> "BackgroundInputs":
        """Return the inputs of a scenario's background."""
        field = loaded.scenario.field
        tables = {name: getattr(field, name) for name in ("earth", "crust", "targets", "variation", "swell")}
        scenario = FlightInputs.of(loaded).scenario
        return cls(scenario.model_copy(update={"field": FieldSettings().model_copy(update=tables)}), loaded.ground)

    @cached_property
    def key(self) -> str:
        """Digest of all inputs."""
        return _digest(self.scenario, self.ground)


@dataclass(frozen=True)
class FieldInputs:
    """What the true field of a flight depends on beside flight and background: of the instruments, their mounts alone.

    Attributes
    ----------
    scenario : Scenario
        Without title, and with mounts in place of instruments.
    aircraft : Aircraft
    bird : Bird, optional
    """

    scenario: Scenario
    aircraft: Aircraft
    bird: Bird | None

    @classmethod
    def of(cls, loaded: LoadedScenario) -> "FieldInputs":
        """Return the inputs of a scenario's field."""
        scenario = loaded.scenario
        settings = {"title": "", "sensors": _mounts_of(scenario.sensors)}
        return cls(scenario.model_copy(update=settings), loaded.aircraft, loaded.bird)

    @cached_property
    def key(self) -> str:
        """Digest of all inputs."""
        return _digest(self.scenario, self.aircraft, self.bird)


def _without_metal(vehicle: V) -> V:
    """Return a vehicle with its facts of flight alone."""
    return replace(vehicle, magnetics=NO_METAL, files={}, nominal=None)


def _mounts_of(sensors: Sensors) -> Sensors:
    """Return bare magnetometers at the mounts of some instruments."""
    scalar = [ScalarSensor(name=f"s{i}", body=s.body, mount=s.mount) for i, s in enumerate(sensors.scalar)]
    fluxgate = [FluxgateSensor(name=f"f{i}", body=s.body, mount=s.mount) for i, s in enumerate(sensors.fluxgate)]
    return Sensors(scalar=tuple(scalar), fluxgate=tuple(fluxgate))


def _digest(scenario: Scenario, *parts: Digested | None) -> str:
    """Return the SHA-256 over settings, stated or left out, and over named contents."""
    stated = (scenario.model_dump(mode="json", exclude_unset=unset) for unset in (False, True))
    lines = [json.dumps(table, sort_keys=True) for table in stated]
    for part in parts:
        name = part.name if isinstance(part, Vehicle) else ""
        lines.append("none" if part is None else f"{type(part).__name__} {name} {part.digest}")
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()

"""The wiring of the aircraft in a scenario: on or off, and parameters of loads that differ from the aircraft's file."""

from typing import Any, get_args

from pydantic import Field, ValidationError, ValidationInfo, create_model, model_validator

from magsim.aircraft.magnetics import LOADS, Feeder
from magsim.config import Name, Problems, Strict
from magsim.config.wording import complaints
from magsim.scenario.base import FieldPart, aircraft_of, bird_of


def _parameters() -> dict[str, Any]:
    """Return every number of every load as a key that may be left out."""
    out: dict[str, Any] = {}
    for load in LOADS:
        for name, info in load.model_fields.items():
            if info.annotation is float:
                models = [other for other in LOADS if name in other.model_fields]
                kinds = [get_args(other.model_fields["kind"].annotation)[0] for other in models]
                text = f"of loads of kind {', '.join(kinds)}"
                out[name] = (float | None, Field(default=None, description=text))
    return out


class _Setting(Strict):
    """Changes of one feeder; a key that is left out keeps the value of the aircraft's file."""

    enabled: bool = Field(default=True, description="false: the feeder carries no current")

    @property
    def given(self) -> dict[str, float]:
        """Parameters of the load that are set."""
        return {key: value for key, value in self if key != "enabled" and value is not None}


FeederSetting = create_model("FeederSetting", __base__=_Setting, __doc__=_Setting.__doc__, **_parameters())


class Electronics(FieldPart):
    """Currents in the wiring."""

    least_times_on: int = Field(
        default=3,
        ge=0,
        le=100,
        description="loads of kind duty cycle faster where they would be on fewer times in the training rows; 0: never",
    )
    feeders: dict[Name, FeederSetting] = Field(
        default={}, description="by the names of the feeders of the aircraft, and of the bird that it tows"
    )

    @property
    def off(self) -> frozenset[str]:
        """Feeders that are switched off."""
        return frozenset(name for name, setting in self.feeders.items() if not setting.enabled)

    def apply(self, feeders: tuple[Feeder, ...]) -> tuple[Feeder, ...]:
        """Return the feeders of the aircraft with the parameters that are set here."""
        return tuple(
            feeder.model_copy(update={"load": _changed(feeder, self.feeders[feeder.name])})
            if feeder.name in self.feeders
            else feeder
            for feeder in feeders
        )

    @model_validator(mode="after")
    def _fits_the_aircraft(self, info: ValidationInfo) -> "Electronics":
        aircraft, bird = aircraft_of(info), bird_of(info)
        if aircraft:
            # a feeder of either: their names differ, see magsim.planning.tow
            feeders = aircraft.magnetics.feeders + (() if bird is None else bird.magnetics.feeders)
            unknown = f"{aircraft.name} has no such feeder"
            if bird is not None:
                unknown = f"neither {aircraft.name} nor {bird.name} has such a feeder"
            found = [
                problem
                for name, setting in self.feeders.items()
                for problem in _problems(name, setting, unknown, feeders)
            ]
            if found:
                raise Problems(*found)
        return self


def _changed(feeder: Feeder, setting: _Setting) -> Strict:
    load = feeder.load
    return type(load).model_validate(load.model_dump() | setting.given)


def _problems(name: str, setting: _Setting, unknown: str, feeders: tuple[Feeder, ...]) -> list[tuple[str, str]]:
    """Return what does not fit: the feeder's name, keys that its load does not have, values beyond their limits."""
    by_name = {feeder.name: feeder for feeder in feeders}
    if name not in by_name:
        return [(f"feeders.{name}", f"{unknown}; allowed: {', '.join(by_name) or 'none'}")]
    load = by_name[name].load
    known = [key for key, info in type(load).model_fields.items() if info.annotation is float]
    strange = [key for key in setting.given if key not in known]
    if strange:
        text = f"its load is of kind {load.kind!r} and has no such key; allowed: {', '.join(['enabled', *known])}"
        return [(f"feeders.{name}.{key}", text) for key in strange]
    merged = load.model_dump() | setting.given
    try:
        type(load).model_validate(merged)
    except ValidationError as error:
        return [
            (".".join(["feeders", name, *map(str, complaint.path)]), complaint.text)
            for complaint in complaints(error, type(load), merged)
        ]
    return []

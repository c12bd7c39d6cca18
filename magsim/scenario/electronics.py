"""The wiring of the aircraft in a scenario: on or off, and what its loads do otherwise than in the aircraft's file."""

from typing import Any

from pydantic import Field, ValidationError, ValidationInfo, create_model, model_validator

from magsim.aircraft.magnetics import LOADS, Circuit
from magsim.config import Name, Problems, Strict
from magsim.config.wording import complaints
from magsim.scenario.base import FieldPart, aircraft_of, bird_of


def _parameters() -> dict[str, Any]:
    """Every number of every load as a key that may be left out."""
    out: dict[str, Any] = {}
    for load in LOADS:
        for name, info in load.model_fields.items():
            if info.annotation is float:
                kinds = [
                    other.model_fields["kind"].annotation.__args__[0] for other in LOADS if name in other.model_fields
                ]
                text = f"of loads of kind {', '.join(kinds)}"
                out[name] = (float | None, Field(default=None, description=text))
    return out


class _Setting(Strict):
    """What a scenario changes of one circuit; a key that is left out stays as the aircraft's file says."""

    enabled: bool = Field(default=True, description="false: the circuit carries no current")

    @property
    def given(self) -> dict[str, float]:
        """Parameters of the load that are set."""
        return {key: value for key, value in self if key != "enabled" and value is not None}


CircuitSetting = create_model("CircuitSetting", __base__=_Setting, __doc__=_Setting.__doc__, **_parameters())


class Electronics(FieldPart):
    """Currents in the wiring."""

    circuits: dict[Name, CircuitSetting] = Field(
        default={}, description="by the names of the circuits of the aircraft, and of the bird that it tows"
    )

    @property
    def off(self) -> frozenset[str]:
        """Circuits that are switched off."""
        return frozenset(name for name, setting in self.circuits.items() if not setting.enabled)

    def apply(self, circuits: tuple[Circuit, ...]) -> tuple[Circuit, ...]:
        """The circuits of the aircraft with the parameters that are set here."""
        return tuple(
            circuit.model_copy(update={"load": _changed(circuit, self.circuits[circuit.name])})
            if circuit.name in self.circuits
            else circuit
            for circuit in circuits
        )

    @model_validator(mode="after")
    def _fits_the_aircraft(self, info: ValidationInfo) -> "Electronics":
        aircraft, bird = aircraft_of(info), bird_of(info)
        if aircraft:
            # a circuit of either: their names differ, see magsim.scenario.tow
            circuits = aircraft.magnetics.circuits + (() if bird is None else bird.magnetics.circuits)
            unknown = f"{aircraft.name} has no such circuit"
            if bird is not None:
                unknown = f"neither {aircraft.name} nor {bird.name} has such a circuit"
            found = [
                problem
                for name, setting in self.circuits.items()
                for problem in _problems(name, setting, unknown, circuits)
            ]
            if found:
                raise Problems(*found)
        return self


def _changed(circuit: Circuit, setting: _Setting) -> Strict:
    load = circuit.load
    return type(load).model_validate(load.model_dump() | setting.given)


def _problems(name: str, setting: _Setting, unknown: str, circuits: tuple[Circuit, ...]) -> list[tuple[str, str]]:
    """What does not fit: the circuit's name, keys that its load does not have, values beyond their limits."""
    by_name = {circuit.name: circuit for circuit in circuits}
    if name not in by_name:
        return [(f"circuits.{name}", f"{unknown}; allowed: {', '.join(by_name) or 'none'}")]
    load = by_name[name].load
    known = [key for key, info in type(load).model_fields.items() if info.annotation is float]
    strange = [key for key in setting.given if key not in known]
    if strange:
        text = f"its load is of kind {load.kind!r} and has no such key; allowed: {', '.join(['enabled', *known])}"
        return [(f"circuits.{name}.{key}", text) for key in strange]
    merged = load.model_dump() | setting.given
    try:
        type(load).model_validate(merged)
    except ValidationError as error:
        return [
            (".".join(["circuits", name, *map(str, told.path)]), told.text)
            for told in complaints(error, type(load), merged)
        ]
    return []

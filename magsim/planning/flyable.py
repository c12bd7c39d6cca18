"""The scenario whose plan is checked: what must hold between its tables, and with its aircraft, for it to be flown."""

from pydantic import ValidationInfo, field_validator

from magsim.aircraft import KinematicFacts
from magsim.config import Problems
from magsim.planning.air import check_still, check_wind
from magsim.planning.flaps import check_moves
from magsim.planning.geology import check_crust, check_targets
from magsim.planning.patterns import check_pattern, check_surveys, check_track, heights_of
from magsim.planning.tow import check_names, check_tow
from magsim.scenario import Air, FieldSettings, FlightSettings, Pattern, Scenario, Tow, TrackPattern, parts_of
from magsim.scenario.base import aircraft_of, bird_of


class FlyableScenario(Scenario):
    """A scenario that is checked in the same pass against what its tables demand of each other.

    Its aircraft and bird come in as ``context["aircraft"]`` and ``context["bird"]`` of the validation, as those of
    ``Scenario`` do.
    """

    @field_validator("pattern")
    @classmethod
    def _pattern_fits(cls, pattern: Pattern, info: ValidationInfo) -> Pattern:
        start, terrain = info.data.get("start"), info.data.get("terrain", "wrong")
        if start:
            if isinstance(pattern, TrackPattern):
                found = [*check_track(pattern, has_ground=terrain is not None)]
            else:
                found = [
                    *check_pattern(pattern, start, aircraft_of(info)),
                    *check_surveys(pattern, has_ground=terrain is not None),
                ]
            if found:
                raise Problems(*found)
        return pattern

    @field_validator("tow")
    @classmethod
    def _tow_fits(cls, tow: Tow | None, info: ValidationInfo) -> Tow | None:
        start, pattern, aircraft = info.data.get("start"), info.data.get("pattern"), aircraft_of(info)
        if tow and start and aircraft:
            parts = parts_of(pattern) if pattern and not isinstance(pattern, TrackPattern) else ()
            kinematic = isinstance(aircraft.facts, KinematicFacts) or isinstance(pattern, TrackPattern)
            found = [*check_tow(tow, start, parts, bird_of(info), kinematic=kinematic)]
            found += [*check_names(aircraft, bird_of(info))]
            if found:
                raise Problems(*found)
        return tow

    @field_validator("flight")
    @classmethod
    def _flaps_fit(cls, flight: FlightSettings, info: ValidationInfo) -> FlightSettings:
        start, pattern = info.data.get("start"), info.data.get("pattern")
        if start and pattern and flight.flaps:
            if isinstance(pattern, TrackPattern):
                raise Problems(("flaps", "a logged track has the flaps of its file; allowed: none"))
            checked = {"speed_mps": start.speed_mps, "alt_m": min(heights_of(pattern, start))}
            reach = {"circuits": pattern.circuits, "legs": pattern.legs}
            found = [*check_moves(flight.flaps, aircraft_of(info), **checked, **reach)]
            if found:
                raise Problems(*found)
        return flight

    @field_validator("air")
    @classmethod
    def _wind_is_slower(cls, air: Air, info: ValidationInfo) -> Air:
        start, pattern = info.data.get("start"), info.data.get("pattern")
        heights = heights_of(pattern, start) if start and pattern and not isinstance(pattern, TrackPattern) else ()
        found = [*check_wind(air, start, heights)] if start else []
        aircraft = aircraft_of(info)
        if aircraft and isinstance(aircraft.facts, KinematicFacts):
            found += [*check_still(air, aircraft.name)]
        if found:
            raise Problems(*found)
        return air

    @field_validator("field")
    @classmethod
    def _geology_in_band(cls, field: FieldSettings, info: ValidationInfo) -> FieldSettings:
        start, air = info.data.get("start"), info.data.get("air")
        found = [("targets" + key, text) for key, text in check_targets(field.targets)]
        if field.crust and start and air:
            found += [(f"crust.{key}", text) for key, text in check_crust(field.crust, start, air)]
        if found:
            raise Problems(*found)
        return field

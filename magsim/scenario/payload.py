"""The load of the aircraft."""

from pydantic import Field, ValidationInfo, model_validator

from magsim.aircraft import Facts, KinematicFacts
from magsim.config import Strict
from magsim.scenario.base import aircraft_of


class Loading(Strict):
    """Payload and fuel; a key that is left out takes the value of the aircraft's file."""

    payload_kg: float | None = Field(default=None, ge=0.0, description="crew and equipment")
    payload_aft_m: float = Field(
        default=0.0, ge=-5.0, le=5.0, description="payload farther aft than in the aircraft's file"
    )
    fuel_kg: float | None = Field(default=None, gt=0.0, description="fuel when the warm-up begins")
    burn_fuel: bool = Field(default=False, description="whether the flight burns its fuel")

    @model_validator(mode="after")
    def _allowed(self, info: ValidationInfo) -> "Loading":
        aircraft = aircraft_of(info)
        if aircraft:
            self.apply(aircraft.facts)
        return self

    def apply(self, facts: Facts | KinematicFacts) -> Facts | KinematicFacts:
        """Return the facts of the loaded aircraft.

        Raises
        ------
        ValueError
            If mass or center of gravity leave their limits, or there is nothing to burn.
        """
        if self.burn_fuel and (isinstance(facts, KinematicFacts) or facts.mass.balance is None):
            msg = f"{facts.title} burns no fuel; allowed: burn_fuel = false"
            raise ValueError(msg)
        return facts.loaded(self.payload_kg, self.fuel_kg, self.payload_aft_m)

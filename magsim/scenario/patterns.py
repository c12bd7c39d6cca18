"""Patterns of legs and the maneuvers on them."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Discriminator, Field, ValidationInfo, field_validator

from magsim.config import Numbers, Strict
from magsim.scenario.base import NonNegative, aircraft_of
from magsim.scenario.start import Start
from magsim.units import G0

if TYPE_CHECKING:
    from magsim.aircraft import Aircraft

LEGS = 4
"""Legs of one circuit, and passes of a cloverleaf."""


class Train(Strict):
    """A train of sine maneuvers on one axis, flown once on each leg.

    ``amplitude_deg`` (half of peak to peak) and ``period_s`` take one number, or a list that is gone through leg
    by leg over the whole flight.
    """

    axis: Literal["pitch", "roll", "yaw"]
    amplitude_deg: Numbers
    period_s: Numbers = (6.0,)
    cycles: int = Field(default=3, ge=1, le=50)
    rest_s: NonNegative = 6.0

    @field_validator("amplitude_deg")
    @classmethod
    def _within_limit(cls, values: tuple[float, ...], info: ValidationInfo) -> tuple[float, ...]:
        aircraft, axis = aircraft_of(info), info.data.get("axis")
        limit = aircraft.limits.amplitude_deg[axis] if aircraft and axis else 45.0
        name = aircraft.name if aircraft else "any aircraft"
        for value in values:
            if not 0.0 < value <= limit:
                msg = f"{value:g} deg is no {axis} amplitude for {name}; allowed: above 0, up to {limit:g}"
                raise ValueError(msg)
        return values

    @field_validator("period_s")
    @classmethod
    def _flyable(cls, values: tuple[float, ...]) -> tuple[float, ...]:
        for value in values:
            if not 3.0 <= value <= 30.0:
                msg = f"{value:g} s is no maneuver period; allowed: 3 to 30"
                raise ValueError(msg)
        return values

    def amplitude(self, index: int) -> float:
        """Amplitude [deg] on the leg with this index, counted from 0 over the whole flight."""
        return self.amplitude_deg[index % len(self.amplitude_deg)]

    def period(self, index: int) -> float:
        """Period [s] on the leg with this index, counted from 0 over the whole flight."""
        return self.period_s[index % len(self.period_s)]

    def duration(self, index: int) -> float:
        """Time that the train takes on that leg, rest included [s]."""
        return self.cycles * self.period(index) + self.rest_s


class PatternBase(Strict):
    """What every pattern of legs has."""

    turn: Literal["right", "left"] = "right"
    bank_deg: float = Field(default=25.0, ge=5.0, le=45.0, description="planned bank of the turns")
    lead_s: NonNegative = 15.0
    maneuvers: tuple[Train, ...] = Field(default=(), strict=False)

    @field_validator("bank_deg")
    @classmethod
    def _bank_within_limit(cls, value: float, info: ValidationInfo) -> float:
        aircraft = aircraft_of(info)
        if aircraft and value > aircraft.limits.turn_bank.value:
            limit = aircraft.limits.turn_bank.value
            msg = f"{value:g} deg is more bank than {aircraft.name} turns with; allowed: 5 to {limit:g}"
            raise ValueError(msg)
        return value


class Box(PatternBase):
    """Square circuits: four straight legs at right angles, joined by quarter turns."""

    kind: Literal["box"] = "box"
    circuits: int = Field(default=1, ge=1, le=100)
    leg_m: float = Field(default=10_000.0, ge=500.0, le=200_000.0, description="straight part of each leg")


class Cloverleaf(PatternBase):
    """Four passes over one point, which is the start point, joined by square leaves."""

    kind: Literal["cloverleaf"] = "cloverleaf"
    leaf_m: float = Field(default=5_000.0, ge=3_000.0, le=50_000.0, description="side of the square leaves")

    @property
    def circuits(self) -> int:
        """A cloverleaf is one circuit."""
        return 1

    @property
    def leg_m(self) -> float:
        """Length of a pass [m]: from one leaf over the center to the next, less nothing."""
        return 2.0 * self.leaf_m


Pattern = Annotated[Box | Cloverleaf, Discriminator("kind")]


def check_fit(pattern: Box | Cloverleaf, start: Start) -> Iterator[tuple[str, str]]:
    """Maneuvers must fit into the legs."""
    available = pattern.leg_m / start.speed_mps
    for leg in range(LEGS * pattern.circuits):
        needed = pattern.lead_s + sum(train.duration(leg) for train in pattern.maneuvers)
        if needed > available:
            text = (
                f"leg {leg + 1} needs {needed:.0f} s for its maneuvers, but a leg of {pattern.leg_m:g} m takes "
                f"{available:.0f} s at {start.speed_mps:g} m/s; allowed: shorter trains or longer legs"
            )
            yield "maneuvers", text
            return


def check_loads(pattern: Box | Cloverleaf, start: Start, aircraft: "Aircraft | None") -> Iterator[tuple[str, str]]:
    """Pitch maneuvers must stay within the aircraft's load factors: 1 g +- V A omega / g."""
    for number, train in enumerate(pattern.maneuvers):
        for leg in range(LEGS * pattern.circuits if aircraft and train.axis == "pitch" else 0):
            amplitude, period = train.amplitude(leg), train.period(leg)
            swing = start.speed_mps * math.radians(amplitude) * 2.0 * math.pi / period / G0
            low, high = aircraft.limits.load_factor
            if not low <= 1.0 - swing or not 1.0 + swing <= high:
                text = (
                    f"{amplitude:g} deg of pitch in {period:g} s swings from {1.0 - swing:.2f} to "
                    f"{1.0 + swing:.2f} g at {start.speed_mps:g} m/s; allowed for {aircraft.name}: "
                    f"{low:g} to {high:g} g (a longer period or a smaller amplitude)"
                )
                yield f"maneuvers[{number}].amplitude_deg", text
                break

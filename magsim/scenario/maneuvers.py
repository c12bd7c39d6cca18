"""Maneuvers: trains of sine swings on one axis or on several at once, and when each is flown on its leg."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Literal

from pydantic import Discriminator, Field, ValidationInfo, field_validator, model_validator

from magsim.aircraft import Aircraft
from magsim.config import Numbers, Problems, Strict
from magsim.scenario.base import NonNegative, aircraft_of

Axis = Literal["pitch", "roll", "yaw"]

FURTHEST = 2.1
"""No cycle departs farther from the mean, in standard deviations of its scatter."""

PRESETS: Mapping[str, Mapping[str, object]] = {
    "crew": {
        "maneuvers": [
            {
                "axis": "pitch",
                "amplitude_deg": [3.0, 4.0, 3.5, 2.5],
                "period_s": [6.0, 7.5, 6.5, 5.5],
                "amplitude_scatter": 0.15,
                "period_scatter": 0.10,
            },
            {
                "axis": "roll",
                "amplitude_deg": [8.0, 6.0, 9.0, 7.0],
                "period_s": [6.0, 5.0, 7.0, 5.5],
                "amplitude_scatter": 0.15,
                "period_scatter": 0.10,
            },
            {
                "axis": "yaw",
                "amplitude_deg": [4.0, 3.0, 4.5, 3.5],
                "period_s": [6.0, 7.0, 6.5, 5.5],
                "amplitude_scatter": 0.15,
                "period_scatter": 0.10,
                "roll_part": 0.3,
            },
        ]
    }
}
"""Keys of a pattern by the name of a preset.

``crew``: a figure of merit by hand, pitch and yaw of +-2.5 to 5 and roll of +-5 to 10 degrees in 4 to 8 s (SEG Wiki,
"Figure of merit", read as amplitudes or from peak to peak). Scatter and the roll in the yaw are estimates.
"""


def check_amplitude(axis: str | None, value: float, aircraft: Aircraft | None) -> None:
    """Raise a ValueError where an aircraft cannot swing so far.

    Parameters
    ----------
    axis : str, optional
        None where the axis itself is wrong.
    value : float
        Half of peak to peak [deg].
    aircraft : Aircraft, optional
    """
    limit = aircraft.limits.amplitude_deg[axis] if aircraft and axis else 45.0
    if aircraft and limit == 0.0:
        msg = f"{aircraft.name} is kinematic and swings by its own sway alone; allowed: no maneuvers"
        raise ValueError(msg)
    if not 0.0 < value <= limit:
        name = aircraft.name if aircraft else "any aircraft"
        msg = f"{value:g} deg is no {axis} amplitude for {name}; allowed: above 0, up to {limit:g}"
        raise ValueError(msg)


def check_period(value: float) -> None:
    """Raise a ValueError for a period that no aircraft here flies."""
    if not 3.0 <= value <= 30.0:
        msg = f"{value:g} s is no maneuver period; allowed: 3 to 30"
        raise ValueError(msg)


class Oscillation(Strict):
    """A sine on one axis.

    ``amplitude_deg`` (half of peak to peak) and ``period_s`` take one number, or a list that is gone through leg
    by leg over the pattern.
    """

    axis: Axis
    amplitude_deg: Numbers
    period_s: Numbers = (6.0,)

    @field_validator("amplitude_deg")
    @classmethod
    def _within_limit(cls, values: tuple[float, ...], info: ValidationInfo) -> tuple[float, ...]:
        for value in values:
            check_amplitude(info.data.get("axis"), value, aircraft_of(info))
        return values

    @field_validator("period_s")
    @classmethod
    def _flyable(cls, values: tuple[float, ...]) -> tuple[float, ...]:
        for value in values:
            check_period(value)
        return values

    @property
    def most(self) -> float:
        """Largest amplitude of a cycle over the mean."""
        return 1.0

    @property
    def shortest(self) -> float:
        """Shortest period of a cycle over the mean."""
        return 1.0

    def amplitude(self, index: int) -> float:
        """Return the amplitude [deg] on the leg with this index, counted from 0 over the pattern."""
        return self.amplitude_deg[index % len(self.amplitude_deg)]

    def period(self, index: int) -> float:
        """Return the period [s] on the leg with this index, counted from 0 over the pattern."""
        return self.period_s[index % len(self.period_s)]


class TrainBase(Strict):
    """Keys that every train has: cycles, rest and envelope."""

    cycles: int = Field(default=3, ge=1, le=50)
    rest_s: NonNegative = Field(default=6.0, description="straight flight after the train")
    envelope_cycles: float = Field(
        default=0.5,
        ge=0.0,
        le=3.0,
        description="cycles of growing swing before the first full cycle, and of fading swing after the last",
    )


class Train(Oscillation, TrainBase):
    """A train of sine maneuvers on one axis, flown once on each leg."""

    amplitude_scatter: float = Field(
        default=0.0, ge=0.0, le=0.3, description="standard deviation of the amplitude from cycle to cycle, as a part"
    )
    period_scatter: float = Field(
        default=0.0, ge=0.0, le=0.2, description="standard deviation of the period from cycle to cycle, as a part"
    )
    roll_part: float = Field(
        default=0.0, ge=0.0, le=1.0, description="roll that swings with a yaw train, as a part of its angle"
    )

    @model_validator(mode="after")
    def _scatter_is_flyable(self, info: ValidationInfo) -> "Train":
        if self.period_scatter and self.cycles == 1:
            msg = "period_scatter: one cycle takes the planned time; allowed: with two cycles or more"
            raise ValueError(msg)
        if self.roll_part and self.axis != "yaw":
            msg = f"roll_part: {self.axis} takes no roll with it; allowed: for a yaw train"
            raise ValueError(msg)
        for value in self.amplitude_deg:
            check_amplitude(self.axis, self.most * value, aircraft_of(info))
        for value in self.period_s:
            check_period(self.shortest * value)
        return self

    @property
    def most(self) -> float:
        """Largest amplitude of a cycle over the mean."""
        return 1.0 + FURTHEST * self.amplitude_scatter

    @property
    def shortest(self) -> float:
        """Shortest period of a cycle over the mean."""
        return 1.0 - FURTHEST * self.period_scatter

    @property
    def swings(self) -> tuple[Oscillation, ...]:
        """The one swing of the train."""
        return (self,)

    def length(self, index: int) -> float:
        """Return the time of the full cycles on the leg with this index [s]."""
        return self.cycles * self.period(index)


class PhasedOscillation(Oscillation):
    """One axis of a combined maneuver."""

    phase_deg: float = Field(default=0.0, ge=0.0, lt=360.0, description="lag behind the train, in its own period")

    def lag(self, index: int) -> float:
        """Return the time by which the oscillation begins after the train [s]."""
        return self.phase_deg / 360.0 * self.period(index)


def _scattering(prefix: str, table: object) -> Iterator[tuple[str, str]]:
    """Yield the keys of a table that only a train on one axis has, with what is allowed."""
    why = {
        "amplitude_scatter": "the cycles of a combined maneuver are alike; allowed: for trains on one axis",
        "period_scatter": "the cycles of a combined maneuver are alike; allowed: for trains on one axis",
        "roll_part": "the roll of a combined maneuver is a swing of its own; allowed: for a yaw train",
    }
    for key, text in why.items():
        if isinstance(table, Mapping) and key in table:
            yield prefix + key, text


class Combined(TrainBase):
    """Several axes at once, each with its own amplitude, period and phase, flown once on each leg.

    ``cycles`` counts those of the longest period; the other axes fly as many whole cycles as fit into that time.
    """

    axis: Literal["combined"]
    swings: Annotated[tuple[PhasedOscillation, ...], Field(strict=False, min_length=2, max_length=3)]

    @model_validator(mode="before")
    @classmethod
    def _flies_alike(cls, value: object) -> object:
        found = [*_scattering("", value)]
        if isinstance(value, Mapping) and isinstance(value.get("swings"), list):
            found += [p for i, swing in enumerate(value["swings"]) for p in _scattering(f"swings[{i}].", swing)]
        if found:
            raise Problems(*found)
        return value

    @field_validator("swings")
    @classmethod
    def _one_each(cls, swings: tuple[PhasedOscillation, ...]) -> tuple[PhasedOscillation, ...]:
        axes = [swing.axis for swing in swings]
        if len(set(axes)) < len(axes):
            msg = f"{', '.join(axes)}: an axis is given twice; allowed: pitch, roll and yaw, each once"
            raise ValueError(msg)
        return swings

    def cycles_of(self, swing: Oscillation, index: int) -> int:
        """Return the number of whole cycles of one of the oscillations."""
        longest = max(other.period(index) for other in self.swings)
        return max(1, int(self.cycles * longest / swing.period(index) + 1e-9))

    def length(self, index: int) -> float:
        """Return the time from the train's start to its end on the leg with this index [s]."""
        return max(s.lag(index) + self.cycles_of(s, index) * s.period(index) for s in self.swings)


Maneuver = Annotated[Train | Combined, Discriminator("axis")]

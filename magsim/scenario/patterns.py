"""Patterns of legs: their geometry, and the maneuvers on them. ``docs/patterns.md`` draws them."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

from pydantic import Discriminator, Field, TypeAdapter, ValidationInfo, field_validator

from magsim.config import Strict
from magsim.scenario.base import NonNegative, PresetTable, aircraft_of
from magsim.scenario.maneuvers import PRESETS, Maneuver, Train, check_amplitude, check_period
from magsim.scenario.start import Start

LEGS = 4
"""Legs of one circuit, and passes of a cloverleaf."""

LONGEST_LEG_M = 200_000.0


class PatternBase(Strict):
    """Keys and properties that every pattern of legs has."""

    courses_deg: ClassVar[tuple[float, float] | None] = None
    """Step of the courses that the first leg may have, and the first of them; None for any."""

    turn: Literal["right", "left"] = "right"
    bank_deg: float = Field(default=25.0, ge=5.0, le=45.0, description="planned bank of the turns")
    lead_s: NonNegative = 15.0
    north_m: float = Field(default=0.0, ge=-100_000.0, le=100_000.0, description="of the pattern from the start point")
    east_m: float = Field(default=0.0, ge=-100_000.0, le=100_000.0, description="of the pattern from the start point")
    heading_deg: float | None = Field(
        default=None, ge=0.0, lt=360.0, description="course of the first leg; else start.heading_deg"
    )
    alt_m: float | None = Field(
        default=None, gt=0.0, description="height above the ellipsoid of a part of a sequence; else start.alt_m"
    )
    allow_beyond_crew_g: bool = Field(
        default=False, description="let pitch maneuvers leave the loads that a crew flies, up to those of the airframe"
    )

    @property
    def legs(self) -> int:
        """Legs of one circuit."""
        return LEGS

    @property
    def quiet_around_center_s(self) -> float | None:
        """Time around the center of a leg without maneuvers [s]; None where legs have no center."""
        return None

    def course(self, start: Start) -> float:
        """Return the course of the first leg [deg]."""
        return start.heading_deg if self.heading_deg is None else self.heading_deg

    def height_m(self, start_m: float) -> float | None:
        """Return the height [m] at which it is flown after a start at a height; None where it follows the ground."""
        return start_m if self.alt_m is None else self.alt_m

    @field_validator("alt_m")
    @classmethod
    def _under_ceiling(cls, value: float | None, info: ValidationInfo) -> float | None:
        aircraft = aircraft_of(info)
        if aircraft and value is not None and value > aircraft.limits.alt_m:
            msg = f"{value:g} m is above the ceiling of {aircraft.name}; allowed: up to {aircraft.limits.alt_m:g}"
            raise ValueError(msg)
        return value

    @field_validator("bank_deg")
    @classmethod
    def _bank_within_limit(cls, value: float, info: ValidationInfo) -> float:
        aircraft = aircraft_of(info)
        if aircraft and value > aircraft.limits.turn_bank.value:
            limit = aircraft.limits.turn_bank.value
            msg = f"{value:g} deg is more bank than {aircraft.name} turns with; allowed: 5 to {limit:g}"
            raise ValueError(msg)
        return value


TRAINS: TypeAdapter[tuple[Maneuver, ...]] = TypeAdapter(Annotated[tuple[Maneuver, ...], Field(strict=False)])


class Maneuvering(PatternBase, PresetTable):
    """A pattern with maneuvers of the user's choice."""

    PRESETS: ClassVar[Mapping[str, Mapping[str, object]]] = PRESETS

    preset: Literal["crew"] | None = Field(
        default=None, description="maneuvers as crews fly them, in place of maneuvers"
    )
    maneuvers: tuple[Maneuver, ...] = Field(default=(), strict=False)

    @field_validator("maneuvers")
    @classmethod
    def _in_one_way(cls, value: tuple[Maneuver, ...], info: ValidationInfo) -> tuple[Maneuver, ...]:
        preset = info.data.get("preset")
        if preset and value != TRAINS.validate_python(PRESETS[preset]["maneuvers"]):
            msg = f"preset = {preset!r} states the maneuvers too; allowed: one of the two"
            raise ValueError(msg)
        return value


class Square(PatternBase):
    """Square circuits: four straight legs at right angles."""

    circuits: int = Field(default=1, ge=1, le=100)
    leg_m: float = Field(default=10_000.0, ge=500.0, le=LONGEST_LEG_M, description="straight part of each leg")
    order: Annotated[tuple[int, ...], Field(strict=False)] = Field(
        default=(1, 2, 3, 4), description="order in which the sides are flown, side 1 first"
    )

    @field_validator("order")
    @classmethod
    def _each_side_once(cls, order: tuple[int, ...]) -> tuple[int, ...]:
        if sorted(order) != [1, 2, 3, 4] or order[0] != 1:
            msg = f"{list(order)} is no order of sides; allowed: 1, 2, 3, 4 each once, 1 first"
            raise ValueError(msg)
        return order


class Box(Square, Maneuvering):
    """Square circuits on any headings."""

    kind: Literal["box"] = "box"


class Diamond(Square, Maneuvering):
    """Square circuits on the headings between the cardinal ones."""

    courses_deg: ClassVar[tuple[float, float] | None] = (90.0, 45.0)

    kind: Literal["diamond"] = "diamond"


class FomBase(Square):
    """Box on north, east, south and west with roll, pitch and yaw trains on each heading; angles are amplitudes."""

    courses_deg: ClassVar[tuple[float, float] | None] = (90.0, 0.0)

    roll_deg: float
    pitch_deg: float
    yaw_deg: float
    period_s: float = 10.0
    cycles: int = Field(default=3, ge=1, le=50)
    rest_s: NonNegative = 6.0
    axes: Annotated[tuple[Literal["pitch", "roll", "yaw"], ...], Field(strict=False, min_length=1, max_length=3)] = (
        "roll",
        "pitch",
        "yaw",
    )

    @field_validator("roll_deg", "pitch_deg", "yaw_deg")
    @classmethod
    def _within_limit(cls, value: float, info: ValidationInfo) -> float:
        check_amplitude(str(info.field_name).removesuffix("_deg"), value, aircraft_of(info))
        return value

    @field_validator("period_s")
    @classmethod
    def _flyable(cls, value: float) -> float:
        check_period(value)
        return value

    @property
    def maneuvers(self) -> tuple[Train, ...]:
        """The trains of each leg."""
        amplitudes = {"roll": self.roll_deg, "pitch": self.pitch_deg, "yaw": self.yaw_deg}
        return tuple(
            Train(
                axis=axis,
                amplitude_deg=(amplitudes[axis],),
                period_s=(self.period_s,),
                cycles=self.cycles,
                rest_s=self.rest_s,
            )
            for axis in self.axes
        )


class Fom(FomBase):
    """Figure-of-merit box on north, east, south and west: roll, pitch and yaw trains on each heading.

    The angles are amplitudes, half of peak to peak: +-10, +-5, +-5 degrees, three of each, 10 s each, as in the
    flight of paper 001.
    """

    kind: Literal["fom"] = "fom"
    roll_deg: float = 10.0
    pitch_deg: float = 5.0
    yaw_deg: float = 5.0


class FomPeakToPeak(FomBase):
    """The figure-of-merit box with 10, 5 and 5 degrees read as peak to peak: half the amplitudes of ``fom``."""

    kind: Literal["fom_peak_to_peak"] = "fom_peak_to_peak"
    roll_deg: float = 5.0
    pitch_deg: float = 2.5
    yaw_deg: float = 2.5


class Centered(Maneuvering):
    """A pattern whose legs all pass one point in their middle; no maneuver is flown there."""

    quiet_s: float = Field(
        default=10.0, ge=0.0, le=120.0, description="no maneuver this long before and after the center"
    )

    @property
    def quiet_around_center_s(self) -> float | None:
        """Time around the center of a leg without maneuvers [s]."""
        return self.quiet_s


class Cloverleaf(Centered):
    """Four passes over one point, two on each line and tie direction, joined by square leaves."""

    kind: Literal["cloverleaf"] = "cloverleaf"
    leaf_m: float = Field(default=5_000.0, ge=300.0, le=50_000.0, description="side of the square leaves")

    @property
    def circuits(self) -> int:
        """A cloverleaf is one circuit."""
        return 1

    @property
    def leg_m(self) -> float:
        """Length of a pass [m]: from one leaf over the center to the next, less nothing."""
        return 2.0 * self.leaf_m


class HeadingCross(Centered):
    """Repeated passes over one point on the four headings, joined by the shortest turns."""

    kind: Literal["heading_cross"] = "heading_cross"
    circuits: int = Field(default=2, ge=1, le=100, description="times that all headings are flown")
    leg_m: float = Field(default=5_000.0, ge=500.0, le=LONGEST_LEG_M, description="straight part of each pass")
    turned_deg: Annotated[tuple[float, ...], Field(strict=False, min_length=1, max_length=4)] = Field(
        default=(0.0, 180.0, 90.0, 270.0), description="courses of the passes, turned from that of the first"
    )

    @property
    def legs(self) -> int:
        """Passes of one circuit."""
        return len(self.turned_deg)

    @field_validator("turned_deg")
    @classmethod
    def _first_is_first(cls, turned: tuple[float, ...]) -> tuple[float, ...]:
        if turned[0] != 0.0 or not all(0.0 <= value < 360.0 for value in turned):
            msg = f"{list(turned)} are no courses; allowed: 0 first, then angles from 0 to below 360"
            raise ValueError(msg)
        return turned


class StraightLine(Maneuvering):
    """One straight line."""

    kind: Literal["straight"] = "straight"
    leg_m: float = Field(default=10_000.0, ge=500.0, le=LONGEST_LEG_M, description="length of the line")

    @property
    def circuits(self) -> int:
        """A line is one circuit."""
        return 1

    @property
    def legs(self) -> int:
        """A line is one leg."""
        return 1


class SurveyPattern(PatternBase):
    """Parallel lines flown to and fro, then tie lines across them; level, or draped over the ground.

    The first line begins at the pattern's origin on its course; the next lie beside it on the side that ``turn`` names.
    Lines are the legs of the first circuit, tie lines those of the second.
    """

    NEEDS: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "tie_spacing_m": ("ties",),
        "tie_overlap_m": ("ties",),
        "climb_slope": ("drape_m",),
    }

    kind: Literal["survey"] = "survey"
    lead_s: NonNegative = Field(default=5.0, le=120.0, description="flown on a line's course before it begins")
    lines: int = Field(default=4, ge=1, le=500, description="number of lines")
    line_m: float = Field(default=10_000.0, ge=500.0, le=LONGEST_LEG_M, description="length of a line")
    spacing_m: float = Field(default=500.0, ge=10.0, le=20_000.0, description="distance of the lines")
    ties: int = Field(default=0, ge=0, le=500, description="number of tie lines")
    tie_spacing_m: float = Field(default=2_000.0, ge=10.0, le=50_000.0, description="distance of the tie lines")
    tie_overlap_m: float = Field(
        default=500.0, ge=0.0, le=20_000.0, description="tie lines reach so far beyond the outer lines"
    )
    drape_m: float | None = Field(
        default=None, ge=20.0, le=3_000.0, description="least planned height above ground; without it start.alt_m"
    )
    climb_slope: float = Field(
        default=0.03, ge=0.005, le=0.2, description="steepest planned climb and descent, height over distance"
    )

    def height_m(self, start_m: float) -> float | None:
        """Return the height [m]; None where the survey is draped."""
        return super().height_m(start_m) if self.drape_m is None else None

    @property
    def maneuvers(self) -> tuple[()]:
        """A survey has none; a sequence can fly them before it."""
        return ()

    @property
    def circuits(self) -> int:
        """The lines, and the tie lines if there are any."""
        return 2 if self.ties else 1

    @property
    def legs(self) -> int:
        """Legs of the circuit that has most."""
        return max(self.lines, self.ties)

    @property
    def leg_m(self) -> float:
        """Length of a line [m]."""
        return self.line_m

    @property
    def tie_m(self) -> float:
        """Length of a tie line [m]."""
        return (self.lines - 1) * self.spacing_m + 2.0 * self.tie_overlap_m


LegPattern = Annotated[
    Box | Fom | FomPeakToPeak | Diamond | Cloverleaf | StraightLine | HeadingCross | SurveyPattern,
    Discriminator("kind"),
]
"""A pattern of legs: alone, or a part of a sequence."""


class PatternSequence(Strict):
    """Patterns one after another, joined by flown transits; their circuits are counted on."""

    kind: Literal["sequence"] = "sequence"
    parts: Annotated[tuple[LegPattern, ...], Field(strict=False, min_length=1, max_length=20)]

    @property
    def circuits(self) -> int:
        """Circuits of all parts."""
        return sum(part.circuits for part in self.parts)

    @property
    def legs(self) -> int:
        """Legs of the circuit that has most."""
        return max(part.legs for part in self.parts)


def parts_of(pattern: LegPattern | PatternSequence) -> tuple[LegPattern, ...]:
    """Return the parts of a sequence; another pattern is its own only part."""
    return pattern.parts if isinstance(pattern, PatternSequence) else (pattern,)


def key_of(pattern: LegPattern | PatternSequence, number: int) -> str:
    """Return the key path of a part in a scenario."""
    return f"pattern.parts[{number}]" if isinstance(pattern, PatternSequence) else "pattern"

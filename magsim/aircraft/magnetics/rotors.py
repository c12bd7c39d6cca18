"""What turns with a propeller: the rotor, and the moments and the steel on it."""

from pydantic import Field, field_validator

from magsim.aircraft.magnetics.base import Hangs, NonNegative, Positive, Source, unit
from magsim.aircraft.magnetics.permanent import Dipole
from magsim.config import Name, Strict, Vector


class Rotor(Strict):
    """A shaft. The rotor named ``propeller`` turns as it was flown, any other one at its own speed."""

    axis: Vector = Field(description="unit vector; positive turning follows the right-hand rule")
    speed_rpm: Positive = Field(description="speed where the flight does not log it")
    wander_rpm: NonNegative = Field(default=0.0, description="standard deviation of what the governor lets wander")
    wander_s: Positive = Field(default=5.0, description="time in which the wandering forgets itself")
    source: Source

    _axis = field_validator("axis")(unit)


class RotatingDipole(Dipole):
    """A moment on a rotor, at a point of its axis: the component along the axis stays, the one across it turns.

    Steel on the rotor that is longer one way than the other adds the second harmonic: ``polarizability_m3`` along
    ``blade``, across it, and along the axis.
    """

    rotor: Name
    suspension: Hangs = None
    blade: Vector | None = Field(default=None, description="unit vector across the axis, at phase zero")
    polarizability_m3: Vector = (0.0, 0.0, 0.0)

    @field_validator("blade")
    @classmethod
    def _blade(cls, blade: Vector | None) -> Vector | None:
        return None if blade is None else unit(blade)

    @field_validator("polarizability_m3")
    @classmethod
    def _positive(cls, value: Vector) -> Vector:
        if min(value) < 0.0:
            msg = f"{list(value)}: allowed: three values, none below 0"
            raise ValueError(msg)
        return value


def check_rotors(rotors: dict[str, Rotor], parts: tuple[RotatingDipole, ...]) -> None:
    """Check that every part refers to an existing rotor and that its blade is at right angles to the axis.

    Raises
    ------
    ValueError
    """
    for part in parts:
        if part.rotor not in rotors:
            there = ", ".join(rotors) or "none, give a table [rotors.NAME]"
            msg = f"rotating part {part.name!r} turns with rotor {part.rotor!r}, which is not there; allowed: {there}"
            raise ValueError(msg)
        steel = any(part.polarizability_m3)
        if steel and part.blade is None:
            msg = (
                f"rotating part {part.name!r} has a polarizability but no blade; allowed: a unit vector across the axis"
            )
            raise ValueError(msg)
        axis = rotors[part.rotor].axis
        if part.blade is not None and abs(sum(a * b for a, b in zip(part.blade, axis, strict=True))) > 1e-6:
            blade = f"rotating part {part.name!r}: blade = {list(part.blade)}"
            msg = f"{blade} is not across the axis {list(axis)} of its rotor; allowed: a unit vector across it"
            raise ValueError(msg)

"""Facts of an aircraft: the models of ``facts.toml``, each number with unit and source (``magsim.aircraft.fact``)."""

import math
from functools import cached_property
from itertools import pairwise
from typing import Annotated

from pydantic import AfterValidator, Field, model_validator

from magsim.aircraft.controls import Autopilot, Controls, Flap
from magsim.aircraft.engine import Engine
from magsim.aircraft.fact import (
    AngleRange,
    Area,
    CurveFact,
    DegreeRange,
    Degrees,
    Envelope,
    Fact,
    Length,
    Mass,
    Number,
    NumberRange,
    Position,
    Size,
    Speed,
    in_unit,
)
from magsim.config import Strict


class Datum(Strict):
    """Origin of body coordinates: where it lies in the structural frame (x aft, y right, z up)."""

    description: str
    station: Length
    buttline: Length
    waterline: Length


class Geometry(Strict):
    """Wing, tail and the distances between them."""

    span: Size
    wing_area: Area
    mean_chord: Size
    mean_chord_leading_edge: Length
    length: Size
    tailplane_span: Size
    tailplane_area: Area
    tailplane_arm: Size
    fin_height: Size
    fin_area: Area
    fin_arm: Size
    fin_center_above_cg: Size
    wheels: tuple[Position, ...] = Field(min_length=3, strict=False)


class Balance(Strict):
    """Where the mass is: what is fixed, what is carried, the fuel, and the limits of the whole."""

    maximum: Mass
    empty: Mass
    empty_position: Position
    payload: Mass
    payload_position: Position
    fuel: Mass
    fuel_capacity: Mass
    fuel_positions: tuple[Position, ...] = Field(min_length=1, strict=False)
    forward_limit: CurveFact
    aft_limit: Length


class MassFacts(Strict):
    """Mass, center of gravity, radii of gyration; ``balance`` where the load can be chosen.

    The center of gravity by chord is also the point to which the aerodynamic moments refer.
    """

    mass: Mass
    cg_chord_fraction: Number
    cg_below_datum: Length
    balance: Balance | None = None
    gyration_roll: Number
    gyration_pitch: Number
    gyration_yaw: Number
    ixz_over_izz: Number


class Aero(Strict):
    """Constants of the formulas that turn geometry into stability derivatives, and what they do not give."""

    lift_at_zero_alpha: Number
    lift_linear_range: AngleRange
    lift_curve: CurveFact
    oswald_efficiency: Number
    sideslip_drag: Number
    downwash_factor: Number
    tailplane_efficiency: Number
    surface_effectiveness: Number
    wing_center_chord_fraction: Number
    power_shift_chord_fraction: Number
    pitch_damping_factor: Number
    pitch_at_zero_alpha: Number
    fin_aspect_factor: Number
    fin_efficiency: Number
    body_side_force: Number
    body_yaw_stiffness: Number
    dihedral_roll: Number
    high_wing_roll: Number
    roll_damping: Number
    reference_lift: Number
    body_yaw_damping: Number
    aileron_roll: Number
    aileron_yaw: Number
    cruise_speed: Speed
    cruise_altitude: Size
    cruise_density: Annotated[Fact, AfterValidator(in_unit("kg/m^3", positive=True))]
    cruise_mass: Mass


class Limits(Envelope):
    """Limits of maneuvers and loads, and of the validity of the flight model."""

    pitch_amplitude: Degrees
    roll_amplitude: Degrees
    yaw_amplitude: Degrees
    design_load_factor: NumberRange
    crew_load_factor: NumberRange | None = None
    angle_of_attack: DegreeRange
    sideslip: Degrees
    bank: Degrees
    pitch: Degrees

    @cached_property
    def amplitude_deg(self) -> dict[str, float]:
        """Largest amplitude of a maneuver (half of peak to peak) [deg] on the axes pitch, roll, yaw."""
        return {axis: getattr(self, f"{axis}_amplitude").value for axis in ("pitch", "roll", "yaw")}

    @property
    def load_factor(self) -> tuple[float, float]:
        """Lowest and highest design load factor [g]."""
        return self.design_load_factor.value

    @property
    def crew(self) -> tuple[float, float] | None:
        """Lowest and highest load factor that a crew flies in a preset [g]; None where nobody is aboard."""
        return None if self.crew_load_factor is None else self.crew_load_factor.value


class Facts(Strict):
    """An aircraft as the flight model needs it."""

    title: str
    datum: Datum
    geometry: Geometry
    mass: MassFacts
    aero: Aero
    engine: Engine
    controls: Controls
    autopilot: Autopilot
    hook: Position | None = None
    limits: Limits

    @model_validator(mode="after")
    def _balanced(self) -> "Facts":
        if self.mass.balance:
            off = math.dist(self.cg_b, self.aerodynamic_reference_b)
            if abs(self.mass_kg - self.mass.mass.value) > 0.5 or off > 0.002:
                msg = (
                    f"mass.balance: empty, payload and fuel make {self.mass_kg:.1f} kg, {off:.4f} m from the center of "
                    f"gravity; allowed: {self.mass.mass.value:.1f} kg there"
                )
                raise ValueError(msg)
        return self

    @property
    def mass_kg(self) -> float:
        """Mass at the beginning of a flight [kg]."""
        balance = self.mass.balance
        if balance is None:
            return self.mass.mass.value
        return balance.empty.value + balance.payload.value + balance.fuel.value

    @property
    def cg_b(self) -> tuple[float, float, float]:
        """Center of gravity at the beginning of a flight, in body axes from the datum, (3,) [m]."""
        balance = self.mass.balance
        return self.aerodynamic_reference_b if balance is None else self._center(balance.fuel.value)

    @property
    def hook_b(self) -> tuple[float, float, float] | None:
        """Where a rope is tied, body axes from the datum, (3,) [m]; None where the file names no such point."""
        return None if self.hook is None else self.hook.value

    @property
    def bank_ease_s(self) -> float:
        """Time for a turn's bank to be taken up [s]."""
        return self.autopilot.bank_ease.value

    @property
    def climb_mps(self) -> float:
        """Steepest climb and descent [m/s]."""
        return self.autopilot.climb_limit.value

    @property
    def flap(self) -> Flap | None:
        """The flaps; None without."""
        return self.controls.flap

    @property
    def dry_cg_b(self) -> tuple[float, float, float]:
        """Center of gravity with empty tanks."""
        return self.cg_b if self.mass.balance is None else self._center(0.0)

    @property
    def aerodynamic_reference_b(self) -> tuple[float, float, float]:
        """The point to which the aerodynamic moments refer, in body axes from the datum, (3,) [m]."""
        geometry = self.geometry
        station = geometry.mean_chord_leading_edge.value
        station += self.mass.cg_chord_fraction.value * geometry.mean_chord.value
        return (self.datum.station.value - station, 0.0, self.mass.cg_below_datum.value)

    def _center(self, fuel_kg: float) -> tuple[float, float, float]:
        balance = self.mass.balance
        assert balance is not None
        part = fuel_kg / len(balance.fuel_positions)
        items = [(balance.empty.value, balance.empty_position), (balance.payload.value, balance.payload_position)]
        items += [(part, tank) for tank in balance.fuel_positions]
        whole = math.fsum(mass for mass, _ in items)
        x, y, z = (math.fsum(mass * place.value[axis] for mass, place in items) / whole for axis in range(3))
        return (x, y, z)

    def loaded(
        self, payload_kg: float | None = None, fuel_kg: float | None = None, payload_aft_m: float = 0.0
    ) -> "Facts":
        """Return the same aircraft with another load, the payload farther aft; None keeps the value of its file.

        Raises
        ------
        ValueError
            If the load is not allowed; the text names the limits.
        """
        balance = self.mass.balance
        if payload_kg is None and fuel_kg is None and payload_aft_m == 0.0:
            return self
        if balance is None:
            msg = f"{self.title} flies at {self.mass.mass.value:g} kg alone; allowed: no load"
            raise ValueError(msg)
        x, y, z = balance.payload_position.value
        place = balance.payload_position.model_copy(update={"value": (x - payload_aft_m, y, z)})
        update: dict[str, object] = {"payload_position": place}
        if payload_kg is not None:
            update["payload"] = balance.payload.model_copy(update={"value": payload_kg})
        if fuel_kg is not None:
            update["fuel"] = balance.fuel.model_copy(update={"value": fuel_kg})
        mass = self.mass.model_copy(update={"balance": balance.model_copy(update=update)})
        facts = self.model_copy(update={"mass": mass})
        facts._check_load()
        return facts

    def _check_load(self) -> None:
        """Raise a ValueError where mass or center of gravity leave their limits, with the fuel or without."""
        balance = self.mass.balance
        assert balance is not None
        fuel = balance.fuel.value
        if fuel > balance.fuel_capacity.value:
            msg = f"{fuel:g} kg of fuel; allowed: up to {balance.fuel_capacity.value:g}"
            raise ValueError(msg)
        if self.mass_kg > balance.maximum.value:
            over = self.mass_kg - balance.maximum.value
            msg = (
                f"{self.title} weighs {self.mass_kg:.0f} kg with it; allowed: up to {balance.maximum.value:.0f}, "
                f"that is {over:.0f} kg less of payload or fuel"
            )
            raise ValueError(msg)
        for label, mass, center in (
            ("", self.mass_kg, self.cg_b),
            (" without fuel", self.mass_kg - fuel, self.dry_cg_b),
        ):
            station = self.datum.station.value - center[0]
            forward, aft = self.cg_limits(mass)
            if not forward <= station <= aft:
                msg = (
                    f"the center of gravity{label} lies at station {station:.3f} m at {mass:.0f} kg; allowed: "
                    f"{forward:.3f} to {aft:.3f}"
                )
                raise ValueError(msg)

    def cg_limits(self, mass_kg: float) -> tuple[float, float]:
        """Return the foremost and aftmost station of the center of gravity [m] at a mass."""
        balance = self.mass.balance
        assert balance is not None
        points = list(zip(balance.forward_limit.at, balance.forward_limit.value, strict=True))
        forward = points[0][1] if mass_kg <= points[0][0] else points[-1][1]
        for (m0, s0), (m1, s1) in pairwise(points):
            if m0 <= mass_kg <= m1:
                forward = s0 + (mass_kg - m0) / (m1 - m0) * (s1 - s0)
        return forward, balance.aft_limit.value

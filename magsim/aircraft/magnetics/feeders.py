"""Wiring: feeders with their paths and loads, and the buses whose voltage they pull down."""

import itertools
import math
from typing import Annotated, Literal

from pydantic import BeforeValidator, Discriminator, Field, model_validator

from magsim.aircraft.magnetics.base import Positive, Source
from magsim.config import Name, Strict, Vector

SWITCHES = ("flap_motor", "autopilot")
"""Switches of a flight that may turn a load on."""

MOST_TURNS = 1000
"""Turns of a twisted pair beyond which it is refused."""

Amperes = Annotated[float, Field(ge=-1e4, le=1e4)]
Seconds = Annotated[float, Field(gt=0.0, le=1e6)]
LagSeconds = Annotated[float, Field(ge=0.0, le=1e3)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]


def _as_tuple(value: object) -> object:
    return tuple(value) if isinstance(value, list) else value


Line = Annotated[tuple[Vector, ...], BeforeValidator(_as_tuple), Field(min_length=2)]
Polygon = Annotated[tuple[Vector, ...], BeforeValidator(_as_tuple), Field(min_length=3)]


def _pieces(corners: tuple[Vector, ...]) -> list[tuple[Vector, Vector]]:
    return list(itertools.pairwise(corners))


def _distance_m(place: Vector, start: Vector, end: Vector) -> float:
    """Return the distance from a place to a straight piece [m]."""
    along = [e - s for s, e in zip(start, end, strict=True)]
    arm = [p - s for s, p in zip(start, place, strict=True)]
    at = sum(a * b for a, b in zip(along, arm, strict=True)) / sum(a * a for a in along)
    at = min(1.0, max(0.0, at))
    return math.dist(arm, [at * a for a in along])


class PathBase(Strict):
    """What every path of a current has."""

    vertices_m: Line = Field(description="corners from the source to the load")
    share: float = Field(default=1.0, ge=-10.0, le=10.0, description="part of the feeder's current")
    mirror: bool = Field(default=False, description="a second path, mirrored to the other side, with the same share")

    @property
    def wires(self) -> list[tuple[Vector, Vector]]:
        """Straight pieces that carry the current."""
        return _pieces(self.vertices_m)

    @property
    def thickness_m(self) -> float:
        """How far a wire's axis may lie from ``wires`` [m]."""
        return 0.0

    @model_validator(mode="after")
    def _corners_differ(self) -> "PathBase":
        for i, (start, end) in enumerate(_pieces(self.vertices_m)):
            if math.dist(start, end) < 1e-6:
                msg = f"vertices_m[{i}] and the next are the same place; allowed: corners that differ"
                raise ValueError(msg)
        return self

    def clearance_m(self, place: Vector) -> float:
        """Return the distance from a place to the axis of the nearest wire, mirror image included [m]."""
        places = [place, (place[0], -place[1], place[2])] if self.mirror else [place]
        nearest = min(_distance_m(where, *piece) for where in places for piece in self.wires)
        return nearest - self.thickness_m


class LoopPath(PathBase):
    """A closed loop: the way there and back, through the chassis for example; the last corner joins the first."""

    kind: Literal["loop"]
    vertices_m: Polygon = Field(description="corners in the sense of positive current; the last joins the first")

    @property
    def wires(self) -> list[tuple[Vector, Vector]]:
        """Straight pieces that carry the current."""
        return _pieces((*self.vertices_m, self.vertices_m[0]))


class PairPath(PathBase):
    """A wire and its return beside it."""

    kind: Literal["pair"]
    offset_m: Vector = Field(description="from the wire to its return")

    @property
    def wires(self) -> list[tuple[Vector, Vector]]:
        """Straight pieces that carry the current."""
        along = self.offset_m
        back = tuple((x + along[0], y + along[1], z + along[2]) for x, y, z in self.vertices_m)
        return [*_pieces(self.vertices_m), *_pieces(back)]

    @model_validator(mode="after")
    def _apart(self) -> "PairPath":
        if math.hypot(*self.offset_m) < 1e-4:
            msg = f"offset_m = {list(self.offset_m)}: allowed: at least 0.1 mm from wire to return"
            raise ValueError(msg)
        return self


class TwistedPath(PathBase):
    """A wire and its return wound around one line."""

    kind: Literal["twisted"]
    spacing_m: Positive = Field(description="between the axes of the two wires")
    pitch_m: Positive = Field(description="length of one turn")

    @property
    def thickness_m(self) -> float:
        """How far a wire's axis may lie from ``wires`` [m]."""
        return 0.5 * self.spacing_m

    @model_validator(mode="after")
    def _turns(self) -> "TwistedPath":
        length = sum(math.dist(*piece) for piece in self.wires)
        if length / self.pitch_m > MOST_TURNS:
            msg = f"pitch_m = {self.pitch_m:g} makes {length / self.pitch_m:.0f} turns; allowed: up to {MOST_TURNS}"
            raise ValueError(msg)
        if self.spacing_m > self.pitch_m:
            msg = f"spacing_m = {self.spacing_m:g} is wider than a turn is long; allowed: up to pitch_m"
            raise ValueError(msg)
        return self


Path = Annotated[LoopPath | PairPath | TwistedPath, Discriminator("kind")]


class Inrush(Strict):
    """What a switched load does when it is switched on."""

    rise_s: LagSeconds = Field(default=0.0, description="time constant of the lag; 0: it jumps")
    inrush: float = Field(default=1.0, ge=1.0, le=20.0, description="peak over steady current at switch-on")
    inrush_s: Seconds = Field(default=0.2, description="time constant with which the peak decays")

    @model_validator(mode="after")
    def _decays_after_it_rose(self) -> "Inrush":
        if self.inrush != 1.0 and self.inrush_s <= self.rise_s:
            msg = f"inrush_s = {self.inrush_s:g} is not above rise_s = {self.rise_s:g}; allowed: slower"
            raise ValueError(msg)
        return self


class ConstantLoad(Strict):
    """The same current all the time."""

    kind: Literal["constant"]
    current_a: Amperes


class PulseLoad(Strict):
    """Periodic pulses, as of a strobe light."""

    kind: Literal["pulse"]
    current_a: Amperes = Field(description="height of a pulse")
    period_s: Seconds
    width_s: Seconds
    phase_s: float = Field(default=0.0, description="time of a pulse's beginning")
    rise_s: LagSeconds = Field(default=0.0, description="time constant of the lag; 0: it jumps")
    idle_a: Amperes = Field(default=0.0, description="between pulses, beside their lag")

    @model_validator(mode="after")
    def _shorter_than_the_period(self) -> "PulseLoad":
        for key in ("width_s", "rise_s"):
            if not getattr(self, key) < self.period_s:
                msg = f"{key} = {getattr(self, key):g} is not below period_s = {self.period_s:g}; allowed: shorter"
                raise ValueError(msg)
        return self


class DutyLoad(Inrush):
    """On and off by turns, at times that the seed draws, as of a pump or a thermostat."""

    kind: Literal["duty"]
    current_a: Amperes = Field(description="while on")
    on_s: Seconds
    off_s: Seconds
    jitter: float = Field(default=0.2, ge=0.0, lt=1.0, description="each span is drawn within this part of its length")


class SwitchLoad(Inrush):
    """On while a switch of the flight is on."""

    kind: Literal["switch"]
    switch: Literal["flap_motor", "autopilot"]
    current_a: Amperes = Field(description="while on")
    unlogged: bool = Field(default=False, description="the switch where a flight does not log it")


class ServoLoad(Strict):
    """A servo: more current the faster its surface moves, and the more it is deflected."""

    kind: Literal["servo"]
    surface: Literal["elevator", "aileron_left", "aileron_right", "rudder", "flap"]
    idle_a: Amperes
    per_dps_a: float = Field(default=0.0, ge=0.0, le=100.0, description="A for each deg/s of motion, either way")
    per_deg_a: float = Field(default=0.0, ge=0.0, le=100.0, description="A for each degree of deflection, either way")
    rise_s: LagSeconds = Field(default=0.0, description="time constant of the lag; 0: none")


class MotorLoad(Strict):
    """Electric propulsion: current by the throttle."""

    kind: Literal["motor"]
    idle_a: Amperes = Field(default=0.0, description="at throttle 0")
    full_a: Amperes = Field(description="at throttle 1")
    exponent: float = Field(default=1.0, ge=0.25, le=4.0, description="of the throttle")
    rise_s: LagSeconds = Field(default=0.0, description="time constant of the lag; 0: none")
    unlogged: Share = Field(default=0.5, description="the throttle where a flight does not log it")


class ChargeLoad(Strict):
    """A battery that is charged after the start: its current decays."""

    kind: Literal["charge"]
    current_a: Amperes = Field(description="when charging began")
    float_a: Amperes = Field(default=0.0, description="in the end")
    decay_s: Seconds = Field(description="time constant")
    before_s: float = Field(default=600.0, ge=0.0, description="from the engine's start to the first row")


class SumLoad(Strict):
    """The sum of other feeders, as in the cable of a generator."""

    kind: Literal["sum"]
    of: Annotated[tuple[Name, ...], BeforeValidator(_as_tuple), Field(min_length=1)]
    current_a: Amperes = Field(default=0.0, description="of loads that have no feeder of their own")
    rise_s: LagSeconds = Field(default=0.0, description="time constant of the lag; 0: none")


Load = Annotated[
    ConstantLoad | PulseLoad | DutyLoad | SwitchLoad | ServoLoad | MotorLoad | ChargeLoad | SumLoad,
    Discriminator("kind"),
]

LOADS: tuple[type[Strict], ...] = (
    ConstantLoad,
    PulseLoad,
    DutyLoad,
    SwitchLoad,
    ServoLoad,
    MotorLoad,
    ChargeLoad,
    SumLoad,
)


class Feeder(Strict):
    """Wires that carry one current, and what draws it."""

    name: Name
    wire_radius_m: Positive = Field(description="of the wire with its insulation: nothing is computed inside it")
    paths: Annotated[tuple[Path, ...], Field(strict=False)] = Field(
        default=(), description="none for a current without a field of its own"
    )
    load: Load
    source: Source


class Bus(Strict):
    """A place where the voltage is measured: a source behind a resistance."""

    name: Name
    open_circuit_v: Annotated[float, Field(gt=0.0, le=1000.0)] | None = Field(
        default=None, description="without current; left out where another bus feeds it"
    )
    fed_by: Name | None = Field(default=None, description="a bus that stands above it in the file")
    resistance_ohm: float = Field(ge=0.0, le=100.0, description="between the source, or the bus before, and here")
    feeders: Annotated[tuple[Name, ...], BeforeValidator(_as_tuple), Field(min_length=1)] = Field(
        description="whose currents flow through the resistance"
    )
    source: Source

    @model_validator(mode="after")
    def _one_feeder(self) -> "Bus":
        if (self.open_circuit_v is None) == (self.fed_by is None):
            msg = "its source is not clear; allowed: either open_circuit_v or fed_by"
            raise ValueError(msg)
        return self


def check_feeders(feeders: tuple[Feeder, ...], buses: tuple[Bus, ...]) -> None:
    """Check that sums and buses refer to feeders and buses above them in the file.

    Raises
    ------
    ValueError
        Naming the feeder or bus, what it asks for, and what there is.
    """
    known: list[str] = []
    for feeder in feeders:
        if isinstance(feeder.load, SumLoad):
            _known(f"feeder {feeder.name!r}: load.of", feeder.load.of, known, "feeders above it")
        known.append(feeder.name)
    above: list[str] = []
    for bus in buses:
        _known(f"bus {bus.name!r}: feeders", bus.feeders, known, "feeders")
        if bus.fed_by is not None:
            _known(f"bus {bus.name!r}: fed_by", (bus.fed_by,), above, "buses above it")
        above.append(bus.name)


def _known(where: str, names: tuple[str, ...], known: list[str], what: str) -> None:
    for name in names:
        if name not in known:
            msg = f"{where}: {name!r} is not there; allowed: {what}: {', '.join(known) or 'none'}"
            raise ValueError(msg)
        if names.count(name) > 1:
            msg = f"{where}: {name!r} stands twice; allowed: once"
            raise ValueError(msg)


def wire_at(place: Vector, feeders: tuple[Feeder, ...]) -> str | None:
    """Return the wire around a place, with what is allowed; None where there is none.

    Parameters
    ----------
    place : (3,) [m]
    feeders : tuple of Feeder
    """
    for feeder in feeders:
        for i, path in enumerate(feeder.paths):
            distance = path.clearance_m(place)
            if distance < feeder.wire_radius_m:
                return (
                    f"{max(0.0, distance):.3g} m from the wire of feeder {feeder.name!r}, paths[{i}]; "
                    f"allowed: beyond its radius, {feeder.wire_radius_m:g} m"
                )
    return None

"""What ``magnetics.toml`` of an aircraft may say: mounts, permanent moments, what turns, steel parts, loops, wiring.

All places are in meters in body axes (forward, right, down) from the aircraft's datum. Each group of numbers
carries a ``source``: where it was read, or ``estimate: ...`` with the published level that set it.
"""

import math
from collections.abc import Iterable
from typing import Annotated

from pydantic import Field, model_validator

from magsim.aircraft.magnetics.coils import Coil
from magsim.aircraft.magnetics.feeders import LOADS, Bus, Feeder, check_feeders, wire_at
from magsim.aircraft.magnetics.memory import Memory
from magsim.aircraft.magnetics.mounts import FlexMode, Mount
from magsim.aircraft.magnetics.moving import ControlDipole, Suspension, check_suspensions
from magsim.aircraft.magnetics.permanent import (
    DIPOLE_CLEARANCE_M,
    SURFACES,
    Carried,
    Dipole,
    FixedDipole,
    HingedDipole,
    Surface,
)
from magsim.aircraft.magnetics.rotors import RotatingDipole, Rotor, check_rotors
from magsim.aircraft.magnetics.skin import Body, BodyShell, DrawnOutline, Panel, Skin
from magsim.aircraft.magnetics.steel import (
    Bar,
    BoxSheet,
    Cylinder,
    Loft,
    MeshPart,
    Plate,
    Steel,
    Strip,
    Tube,
)
from magsim.config import Name, Strict, Vector

__all__ = [
    "DIPOLE_CLEARANCE_M",
    "LOADS",
    "SURFACES",
    "Bar",
    "Body",
    "BodyShell",
    "BoxSheet",
    "Bus",
    "Carried",
    "Coil",
    "ControlDipole",
    "Cylinder",
    "Dipole",
    "DrawnOutline",
    "Feeder",
    "FixedDipole",
    "FlexMode",
    "HingedDipole",
    "Loft",
    "Magnetics",
    "Memory",
    "MeshPart",
    "Mount",
    "Panel",
    "Plate",
    "RotatingDipole",
    "Rotor",
    "Skin",
    "Steel",
    "Strip",
    "Surface",
    "Suspension",
    "Tube",
]


def _unique(what: str, names: Iterable[str]) -> None:
    names = list(names)
    double = sorted({name for name in names if names.count(name) > 1})
    if double:
        msg = f"names of {what} must differ, used twice: {', '.join(double)}"
        raise ValueError(msg)


class Magnetics(Strict):
    """Everything magnetic of an aircraft, and where sensors can be mounted."""

    datum: str = Field(min_length=4, description="the structural point that is the origin of body axes")
    mounts: dict[Name, Mount] = Field(min_length=1)
    permanent: Annotated[tuple[FixedDipole, ...], Field(strict=False)] = ()
    carried: Annotated[tuple[Carried, ...], Field(strict=False)] = Field(
        default=(), description="people and cases, aboard where a scenario sets a day"
    )
    hinged: Annotated[tuple[HingedDipole, ...], Field(strict=False)] = ()
    controls: Annotated[tuple[ControlDipole, ...], Field(strict=False)] = ()
    suspensions: dict[Name, Suspension] = Field(default_factory=dict)
    rotors: dict[Name, Rotor] = Field(default_factory=dict)
    rotating: Annotated[tuple[RotatingDipole, ...], Field(strict=False)] = ()
    memory: Memory | None = None
    steel: Annotated[tuple[Steel, ...], Field(strict=False)] = ()
    coils: Annotated[tuple[Coil, ...], Field(strict=False)] = ()
    skin: Skin | None = None
    outline: DrawnOutline | None = Field(default=None, description="what is drawn of an aircraft without a skin")
    feeders: Annotated[tuple[Feeder, ...], Field(strict=False)] = ()
    buses: Annotated[tuple[Bus, ...], Field(strict=False)] = ()

    @property
    def eddy_model(self) -> str:
        """``"skin"`` where the aircraft has one, else ``"coils"``."""
        return "coils" if self.skin is None else "skin"

    @property
    def hangs(self) -> bool:
        """Whether anything hangs on rubber mounts."""
        return any(part.suspension for part in (*self.permanent, *self.rotating, *self.steel))

    @property
    def _dipoles(self) -> tuple[Dipole, ...]:
        return (*self.permanent, *self.hinged, *self.controls, *self.rotating)

    @model_validator(mode="after")
    def _check_names(self) -> "Magnetics":
        carried = [part.name for part in self.carried]
        _unique("dipoles and what is carried", [*(dipole.name for dipole in self._dipoles), *carried])
        check_rotors(self.rotors, self.rotating)
        check_suspensions(self.suspensions, "dipole", self.permanent)
        check_suspensions(self.suspensions, "rotating part", self.rotating)
        check_suspensions(self.suspensions, "steel part", self.steel)
        _unique("steel parts", (name for part in self.steel for name in part.names))
        _unique("coils", (coil.name for coil in self.coils))
        _unique("feeders", (feeder.name for feeder in self.feeders))
        _unique("buses", (bus.name for bus in self.buses))
        check_feeders(self.feeders, self.buses)
        if self.skin is not None and self.outline is not None:
            msg = "an aircraft with [skin] is drawn by it; allowed: [skin] or [outline]"
            raise ValueError(msg)
        return self

    @model_validator(mode="after")
    def _check_clearance(self) -> "Magnetics":
        for name, mount in self.mounts.items():
            obstacle = self.obstacle(mount.position_m)
            if obstacle is not None:
                msg = f"mount {name!r} is {obstacle}"
                raise ValueError(msg)
        return self

    def obstacle(self, place: Vector) -> str | None:
        """Return the obstacle to a sensor at a place, with what is allowed; None where there is none.

        A mesh and a point dipole mean nothing closer than their own size; there is no field inside a wire. Lofts and
        files of triangles are known by their mesh alone; ``magsim.field.obstacles`` checks that.

        Parameters
        ----------
        place : (3,) [m]
            Body axes.
        """
        for part in self.steel:
            clearance = part.clearance_m(place)
            if clearance < part.element_size_m:
                where = f"{clearance:.3g} m from" if clearance >= 0.0 else "inside"
                return (
                    f"{where} steel part {part.name!r}; allowed: at least its element size, {part.element_size_m:g} m"
                )
        for dipole in self._dipoles:
            distance = math.dist(place, dipole.position_m)
            if distance < DIPOLE_CLEARANCE_M:
                return f"{distance:.3g} m from dipole {dipole.name!r}; allowed: at least {DIPOLE_CLEARANCE_M:g} m"
        return wire_at(place, self.feeders)

"""What hangs below a carrier: rope and body, their numbers as the equations of motion take them.

Nothing here is compiled: it is imported by what flies without a bird too.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np


@dataclass(frozen=True)
class Rope:
    """A rope.

    Attributes
    ----------
    length_m, diameter_m : float
    mass_per_m : float [kg/m]
    normal_drag, tangential_drag : float
        Coefficients of a cylinder across and along the flow, on its diameter and on its girth.
    """

    length_m: float
    diameter_m: float
    mass_per_m: float
    normal_drag: float
    tangential_drag: float


@dataclass(frozen=True)
class Body:
    """A towed body; axes from its center of gravity, forward, right, down.

    Attributes
    ----------
    mass_kg : float
    inertia_kgm2 : (3,)
        About the axes; they are the principal ones.
    bridle_m : (3,)
        From the center of gravity to the point where the rope is tied.
    drag_area_m2 : (3,)
        Drag area times each component of the flow: the first alone for a slender body, three alike for a ball.
    cross_area_m2 : float
        Drag area across the axis, times the square of each cross component.
    fin_area_m2, fin_slope : float
        Area of the fins in each plane and the slope of their lift [1/rad].
    fin_station_m : float
        Of the fins along the axis, negative behind the center of gravity.
    fin_radius_m : float
        Radius at which the fins damp a roll.
    munk_m3 : float
        Volume times the factor of the moment by which a slender body turns across the flow.
    """

    mass_kg: float
    inertia_kgm2: Sequence[float]
    bridle_m: Sequence[float]
    drag_area_m2: Sequence[float]
    cross_area_m2: float = 0.0
    fin_area_m2: float = 0.0
    fin_slope: float = 0.0
    fin_station_m: float = 0.0
    fin_radius_m: float = 0.0
    munk_m3: float = 0.0

    @property
    def turns(self) -> bool:
        """Whether anything can turn it."""
        return any(self.bridle_m) or self.fin_area_m2 != 0.0 or self.munk_m3 != 0.0


def ball(mass_kg: float, drag_area_m2: float) -> Body:
    """A body that is a point with drag, tied at its center: it does not turn."""
    return Body(mass_kg, (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), (drag_area_m2,) * 3)


class Numbers(NamedTuple):
    """Numbers of a line as the compiled equations take them; symbols of the equations where they have one."""

    links: int
    link_m: float
    link_kg: float
    across: float
    """Half of the link's length times normal drag and diameter: times density and square of the flow, a force."""
    along: float
    body_kg: float
    """With the lower half of the last link, which rides on the body."""
    inertia: np.ndarray
    bridle: np.ndarray
    drag_area: np.ndarray
    cross_area: float
    fin_lift: float
    fin_station: float
    fin_roll: float
    munk: float
    spin: np.ndarray
    """Rate at which the axes turn along which the motion is counted, (3,) [rad/s]."""


@dataclass(frozen=True)
class Line:
    """A rope of so many links with a body at its end.

    Attributes
    ----------
    rope : Rope
    body : Body
    links : int
        Two at least.
    spin : (3,) [rad/s]
        Rate at which the axes turn along which the motion is counted: that of the Earth for Earth-fixed axes.
    """

    rope: Rope
    body: Body
    links: int = 10
    spin: Sequence[float] = (0.0, 0.0, 0.0)
    numbers: Numbers = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if self.links < 2:
            msg = f"a rope of {self.links} links; at least 2 are needed"
            raise ValueError(msg)
        rope, body, link_m = self.rope, self.body, self.rope.length_m / self.links
        link_kg = rope.mass_per_m * link_m
        numbers = Numbers(
            links=self.links,
            link_m=link_m,
            link_kg=link_kg,
            across=0.5 * link_m * rope.normal_drag * rope.diameter_m,
            along=0.5 * link_m * math.pi * rope.tangential_drag * rope.diameter_m,
            body_kg=body.mass_kg + 0.5 * link_kg,
            inertia=np.array(body.inertia_kgm2, dtype=float),
            bridle=np.array(body.bridle_m, dtype=float),
            drag_area=np.array(body.drag_area_m2, dtype=float),
            cross_area=float(body.cross_area_m2),
            fin_lift=float(body.fin_area_m2 * body.fin_slope),
            fin_station=float(body.fin_station_m),
            fin_roll=float(0.5 * body.fin_area_m2 * body.fin_slope * body.fin_radius_m**2),
            munk=float(body.munk_m3),
            spin=np.array(self.spin, dtype=float),
        )
        object.__setattr__(self, "numbers", numbers)

    @property
    def size(self) -> int:
        """Numbers in a state."""
        return 6 * (self.links - 1) + 13

    def stable_tension_n(self, step_hz: float) -> float:
        """Tension [N] up to which Runge-Kutta steps of a rate are stable.

        The fastest motion is the transverse wave on one link, ``(2 / l) sqrt(T / mu)``; the method bears
        ``2 sqrt(2)`` of that in a step.
        """
        return 2.0 * self.rope.mass_per_m * (self.numbers.link_m * step_hz) ** 2

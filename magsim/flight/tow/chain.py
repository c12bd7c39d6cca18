"""Rope and body below a carrier, and their constants in the equations of motion.

Nothing here is compiled, so that importing it is fast.
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
class TowedBody:
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


def ball(mass_kg: float, drag_area_m2: float) -> TowedBody:
    """Return a body that is a point with drag, tied at its center: it does not turn."""
    return TowedBody(mass_kg, (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), (drag_area_m2,) * 3)


class ChainConstants(NamedTuple):
    """Constants of a chain for the compiled equations, with the symbols of the equations."""

    links: int
    link_m: float
    link_kg: float
    across: float
    """Half of the link's length times normal drag and diameter: times density and square of the flow, a force."""
    along: float
    body_kg: float
    """Including the lower half of the last link, which is added to the body."""
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
class Chain:
    """A rope as a chain of links with a body at its end.

    Attributes
    ----------
    rope : Rope
    body : TowedBody
    links : int
        At least 2.
    spin : (3,) [rad/s]
        Rate at which the axes turn along which the motion is counted: that of the Earth for Earth-fixed axes.
    """

    rope: Rope
    body: TowedBody
    links: int = 10
    spin: Sequence[float] = (0.0, 0.0, 0.0)
    constants: ChainConstants = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if self.links < 2:
            msg = f"a rope of {self.links} links; at least 2 are needed"
            raise ValueError(msg)
        rope, body, link_m = self.rope, self.body, self.rope.length_m / self.links
        link_kg = rope.mass_per_m * link_m
        constants = ChainConstants(
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
        object.__setattr__(self, "constants", constants)

    @property
    def size(self) -> int:
        """Number of values in a state."""
        return 6 * (self.links - 1) + 13

    def stable_tension_n(self, step_hz: float) -> float:
        """Return the tension [N] up to which Runge-Kutta steps of a rate are stable.

        The fastest motion is the transverse wave on one link, ``(2 / l) sqrt(T / mu)``; the method is
        stable up to ``2 sqrt(2)`` of that in a step.
        """
        return 2.0 * self.rope.mass_per_m * (self.constants.link_m * step_hz) ** 2

"""Permanent magnetism: point dipoles fixed in the aircraft, and dipoles that turn with a control surface."""

from dataclasses import dataclass, replace

import numpy as np

from magsim.field.kernels import add_turning_dipole
from magsim.units import MU0, NT_PER_T

SCALE = MU0 / (4.0 * np.pi) * NT_PER_T
"""mu0 / 4 pi in nT m / A."""

HINGE_STEP_RAD = 0.2
"""Deflection at which the field of a hinged dipole is expanded."""


def dipole_field(position: np.ndarray, moment: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the flux density of a point dipole (J. D. Jackson, Classical Electrodynamics, eq. 5.56).

    Parameters
    ----------
    position, moment : (..., 3) [m], [A m^2]
    points : (..., 3) [m]
        The three broadcast against each other.

    Returns
    -------
    (..., 3) [nT]
    """
    ray = np.asarray(points, dtype=float) - position
    dist = np.sqrt(np.einsum("...x,...x->...", ray, ray))[..., None]
    unit = ray / dist
    along = np.einsum("...x,...x->...", unit, np.asarray(moment, dtype=float))[..., None]
    return SCALE * (3.0 * along * unit - moment) / dist**3


@dataclass(frozen=True)
class DeflectedDipole:
    """A dipole on a control surface while the surface turns about its hinge.

    Attributes
    ----------
    position, moment : (3,) [m], [A m^2]
        With the surface at zero.
    hinge_point : (3,) [m]
    hinge_axis : (3,)
        Unit vector; positive deflection follows the right-hand rule.
    cos, sin : (n,)
        Of the deflection.
    """

    position: np.ndarray
    moment: np.ndarray
    hinge_point: np.ndarray
    hinge_axis: np.ndarray
    cos: np.ndarray
    sin: np.ndarray

    def terms(self, points: np.ndarray) -> np.ndarray:
        """Return what the field at fixed points (s, 3) is made of, (s, 8, 3): see ``kernels.add_turning_dipole``.

        Both the moment and the ray are linear in (1, cos, sin) of the deflection, which makes this as cheap as a fixed
        dipole: with d from the hinge to the dipole and x from the hinge to the point, ``m.r = (Q m).x - m.d`` and
        ``r^2 = x^2 + d^2 - 2 x.(Q d)``.
        """
        arm, offset = self.position - self.hinge_point, points - self.hinge_point
        moment, lever = _turned(self.hinge_axis, self.moment), _turned(self.hinge_axis, arm)
        along = offset @ moment.T
        along[:, 0] -= np.dot(self.moment, arm)
        square = -2.0 * (offset @ lever.T)
        square[:, 0] += np.einsum("si,si->s", offset, offset) + np.dot(arm, arm)
        ray = np.repeat(-lever.T[None], len(points), axis=0)
        ray[:, :, 0] += offset
        moments = np.broadcast_to(moment.T, ray.shape)
        return np.concatenate([square[:, None], along[:, None], ray, moments], axis=1)

    def along(self, places: np.ndarray) -> np.ndarray:
        """Return the field at moving places (n, s, 3) [m], (n, s, 3) [nT]."""
        arm, moment = (_turned(self.hinge_axis, v) for v in (self.position - self.hinge_point, self.moment))
        terms = np.stack([np.ones_like(self.cos), self.cos, self.sin])
        position, turned = self.hinge_point + terms.T @ arm, terms.T @ moment
        return dipole_field(position[:, None], turned[:, None], places)

    def gains(self, points: np.ndarray) -> np.ndarray:
        """Return the fields that ``strengths`` multiply, at fixed points (s, 3) [m], (s, 3, 3) [nT].

        The field is that at zero deflection plus multiples of ``cos - 1`` and ``sin``, fitted at a deflection of
        ``HINGE_STEP_RAD`` to both sides; between these it is right to 0.1 % some meters off.
        """
        angles = np.array([0.0, HINGE_STEP_RAD, -HINGE_STEP_RAD])
        turned = replace(self, cos=np.cos(angles), sin=np.sin(angles))
        rest, plus, minus = turned.along(np.broadcast_to(points, (3, *np.shape(points))))
        even = 0.5 * (plus + minus) - rest
        odd = 0.5 * (plus - minus)
        return np.stack([rest, even / (np.cos(HINGE_STEP_RAD) - 1.0), odd / np.sin(HINGE_STEP_RAD)], axis=-1)

    @property
    def strengths(self) -> np.ndarray:
        """What ``gains`` are multiplied by, (n, 3)."""
        return np.column_stack([np.ones_like(self.cos), self.cos - 1.0, self.sin])


@dataclass(frozen=True)
class DeflectedDipoles:
    """All dipoles on control surfaces, as one source.

    Attributes
    ----------
    dipoles : tuple of DeflectedDipole
    """

    dipoles: tuple[DeflectedDipole, ...]

    def at(self, points: np.ndarray) -> np.ndarray:
        """Return the field at fixed points (s, 3) [m], (n, s, 3) [nT]; n is 1 where all rest."""
        count = max((len(dipole.cos) for dipole in self.dipoles), default=1)
        out = np.zeros((len(points), count, 3))
        for dipole in self.dipoles:
            moves = len(dipole.cos) == count
            part = out if moves else np.zeros((len(points), 1, 3))
            add_turning_dipole(part, SCALE, dipole.terms(points), dipole.cos, dipole.sin)
            if not moves:
                out += part
        return np.swapaxes(out, 0, 1)

    def along(self, places: np.ndarray) -> np.ndarray:
        """Return the field at moving places (n, s, 3) [m], (n, s, 3) [nT]."""
        return sum((dipole.along(places) for dipole in self.dipoles), start=np.zeros(places.shape))

    def gains(self, points: np.ndarray) -> np.ndarray:
        """Return the fields that ``strengths`` multiply, at fixed points (s, 3) [m], (s, 3, c) [nT]."""
        none = np.zeros((len(points), 3, 0))
        return np.concatenate([none, *(dipole.gains(points) for dipole in self.dipoles)], axis=2)

    @property
    def strengths(self) -> np.ndarray:
        """What ``gains`` are multiplied by, (n, c); n is 1 where all rest."""
        count = max((len(dipole.cos) for dipole in self.dipoles), default=1)
        tables = [np.broadcast_to(dipole.strengths, (count, 3)) for dipole in self.dipoles]
        return np.concatenate([np.zeros((count, 0)), *tables], axis=1)


def _turned(axis: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Return rows a0, a1, a2 with ``rotated vector = a0 + a1 cos + a2 sin`` (Rodrigues)."""
    fixed = axis * np.dot(axis, vector)
    return np.stack([fixed, vector - fixed, np.cross(axis, vector)])

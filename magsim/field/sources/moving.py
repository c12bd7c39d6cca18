"""Dipoles that move, with the controls or in a seat, and the gradient of a dipole's field."""

from dataclasses import dataclass, replace

import numpy as np

from magsim.field.sources.dipoles import SCALE, dipole_field

STEP_RAD = 0.2
"""Deflection at which the field of a control is expanded."""


def dipole_gradient(position: np.ndarray, moment: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the derivatives ``dB_i/dx_j`` of a dipole's field along the place of the field point.

    With ``r`` from the dipole to the point,
    ``3 (m_i r_j + r_i m_j + (m.r) delta_ij) / r^5 - 15 (m.r) r_i r_j / r^7`` times mu0 / 4 pi.

    Parameters
    ----------
    position, moment : (3,) [m], [A m^2]
    points : (s, 3) [m]

    Returns
    -------
    (s, 3, 3) [nT/m]
    """
    ray = np.asarray(points, dtype=float) - position
    square = np.einsum("si,si->s", ray, ray)[:, None, None]
    along = np.einsum("si,i->s", ray, moment)[:, None, None]
    mixed = np.einsum("i,sj->sij", moment, ray)
    symmetric = mixed + mixed.transpose(0, 2, 1) + along * np.eye(3)
    return 3.0 * SCALE * (symmetric - 5.0 * along / square * np.einsum("si,sj->sij", ray, ray)) / square**2.5


def moving_field(position: np.ndarray, moment: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the field of a dipole that goes and turns: ``dipole_field`` by components, several times as fast.

    Parameters
    ----------
    position, moment : (n, 3) [m], [A m^2]
    points : (s, 3) [m]
        Fixed.

    Returns
    -------
    (n, s, 3) [nT]
    """
    place, turned = np.ascontiguousarray(position.T), np.ascontiguousarray(moment.T)
    out = np.empty((len(position), len(points), 3))
    for s, point in enumerate(points):
        ray = [x - at for x, at in zip(point, place, strict=True)]
        inverse = 1.0 / (ray[0] ** 2 + ray[1] ** 2 + ray[2] ** 2)
        cubed = SCALE * inverse * np.sqrt(inverse)
        radial = 3.0 * cubed * inverse * (turned[0] * ray[0] + turned[1] * ray[1] + turned[2] * ray[2])
        for i in range(3):
            out[:, s, i] = radial * ray[i] - cubed * turned[i]
    return out


@dataclass(frozen=True)
class LinkedDipole:
    """A dipole on a control, which goes and turns in proportion to the deflection of a surface.

    Attributes
    ----------
    position, moment : (3,) [m], [A m^2]
        With the surface at zero.
    travel : (3,) [m/rad]
    turn : float
        Angle about the axis for each radian of the surface.
    turn_point, turn_axis : (3,) [m], unit vector
    angle : (n,) [rad]
        Of the surface.
    """

    position: np.ndarray
    moment: np.ndarray
    travel: np.ndarray
    turn: float
    turn_point: np.ndarray
    turn_axis: np.ndarray
    angle: np.ndarray

    def _turned(self, vector: np.ndarray) -> np.ndarray:
        """Return a vector turned about the axis, (n, 3) (Rodrigues)."""
        angle, axis = self.turn * self.angle[:, None], self.turn_axis
        fixed = axis * np.dot(axis, vector)
        return fixed + np.cos(angle) * (vector - fixed) + np.sin(angle) * np.cross(axis, vector)

    def _pose(self) -> tuple[np.ndarray, np.ndarray]:
        """Return place and moment, (n, 3) each."""
        position = self.turn_point + self._turned(self.position - self.turn_point) + self.angle[:, None] * self.travel
        return position, self._turned(self.moment)

    def along(self, places: np.ndarray) -> np.ndarray:
        """Return the field at moving places (n, s, 3) [m], (n, s, 3) [nT]."""
        position, moment = self._pose()
        return dipole_field(position[:, None], moment[:, None], places)

    def at(self, points: np.ndarray) -> np.ndarray:
        """Return the field at fixed points (s, 3) [m], (n, s, 3) [nT]."""
        return moving_field(*self._pose(), points)

    def gains(self, points: np.ndarray) -> np.ndarray:
        """Return the fields that ``strengths`` multiply, at fixed points (s, 3) [m], (s, 3, 3) [nT].

        Powers of the deflection up to the second, fitted at ``STEP_RAD`` to both sides.
        """
        rest, plus, minus = replace(self, angle=STEP_RAD * np.array([0.0, 1.0, -1.0])).at(points)
        first, second = 0.5 * (plus - minus) / STEP_RAD, (0.5 * (plus + minus) - rest) / STEP_RAD**2
        return np.stack([rest, first, second], axis=-1)

    @property
    def strengths(self) -> np.ndarray:
        """What ``gains`` are multiplied by, (n, 3)."""
        return np.column_stack([np.ones_like(self.angle), self.angle, self.angle**2])


@dataclass(frozen=True)
class SeatedDipole:
    """The change that a person makes by moving in a seat.

    Attributes
    ----------
    position, moment : (3,) [m], [A m^2]
        In the mean posture.
    posture : (n, 4) [m], [rad]
        How far it is from there, and turned about the vertical.
    """

    position: np.ndarray
    moment: np.ndarray
    posture: np.ndarray

    def _pose(self) -> tuple[np.ndarray, np.ndarray]:
        """Return place and moment, (n, 3) each."""
        cos, sin = np.cos(self.posture[:, 3]), np.sin(self.posture[:, 3])
        x, y, z = self.moment
        moment = np.column_stack([cos * x - sin * y, sin * x + cos * y, np.full_like(cos, z)])
        return self.position + self.posture[:, :3], moment

    def along(self, places: np.ndarray) -> np.ndarray:
        """Return the change at moving places (n, s, 3) [m], (n, s, 3) [nT]."""
        position, moment = self._pose()
        moved = dipole_field(position[:, None], moment[:, None], places)
        return moved - dipole_field(self.position, self.moment, places)

    def at(self, points: np.ndarray) -> np.ndarray:
        """Return the change at fixed points (s, 3) [m], (n, s, 3) [nT]."""
        return moving_field(*self._pose(), points) - dipole_field(self.position, self.moment, points)

    def gains(self, points: np.ndarray) -> np.ndarray:
        """Return the fields that ``strengths`` multiply, to first order, at fixed points (s, 3) [m], (s, 3, 4)."""
        x, y, _ = self.moment
        turned = dipole_field(self.position, np.array([-y, x, 0.0]), points)
        return np.concatenate([-dipole_gradient(self.position, self.moment, points), turned[:, :, None]], axis=2)

    @property
    def strengths(self) -> np.ndarray:
        """What ``gains`` are multiplied by, (n, 4)."""
        return self.posture

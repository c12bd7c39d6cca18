"""The motion of one body: rows of a log with a smooth interpolant."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline, PPoly
from scipy.linalg import solveh_banded

from magsim.arrays import readonly
from magsim.earth.grid import grid_turn_of
from magsim.earth.wgs84 import ecef_from_geodetic, geodetic_from_ecef, quaternion_en_at, rot_ne_at, transport_rate
from magsim.frames import (
    attitude_from_quaternion_nb,
    quaternion_inverse,
    quaternion_nb_from_attitude,
    quaternion_product,
    rot_nb_from_attitude,
    rotate,
    rotate_back,
)


def hermite_spline(time_s: np.ndarray, values: np.ndarray, slopes: np.ndarray) -> PPoly:
    """Build the fifth-degree curve through values and slopes at evenly spaced times, with three continuous derivatives.

    Of all curves through both it has the least mean square of the third derivative, but for its ends. Its error falls
    with the sixth power of the step.

    Parameters
    ----------
    time_s : (n,) [s]
        Evenly spaced, three at least.
    values : (n, m)
    slopes : (n, m) [1/s]
        Derivatives of the values.

    Returns
    -------
    PPoly

    Raises
    ------
    ValueError
        If the times are too few or not even.
    """
    step = (time_s[-1] - time_s[0]) / (len(time_s) - 1)
    if len(time_s) < 3 or np.abs(np.diff(time_s) - step).max() > 1e-6 * step:
        msg = f"{len(time_s)} rows of a log, not three at least at even times"
        raise ValueError(msg)
    # Time in steps. The second derivatives ``bends`` make the third ones continuous; those of the two ends are
    # of the polynomial through the first and the last three rows.
    slopes = slopes * step
    rise = np.diff(values, axis=0)
    bends = np.empty_like(values)
    for end, near, far, sign in ((0, 1, 2, 1.0), (-1, -2, -3, -1.0)):
        bends[end] = 8.0 * values[near] + 3.5 * values[far] - 11.5 * values[end]
        bends[end] -= sign * (6.0 * slopes[end] + 8.0 * slopes[near] + slopes[far])
    known = 20.0 * (rise[1:] - rise[:-1]) - 8.0 * (slopes[2:] - slopes[:-2])
    known[0] += bends[0]
    known[-1] += bends[-1]
    band = np.stack([np.full(len(known), -1.0), np.full(len(known), 6.0)])
    bends[1:-1] = solveh_banded(band, known)
    f, g = slopes[:-1], slopes[1:]
    p, q = 0.5 * bends[:-1], 0.5 * bends[1:]
    parts = [
        6.0 * rise - 3.0 * (f + g) - p + q,
        -15.0 * rise + 8.0 * f + 7.0 * g + 3.0 * p - 2.0 * q,
        10.0 * rise - 6.0 * f - 4.0 * g - 3.0 * p + q,
        p,
        f,
        values[:-1],
    ]
    return PPoly(np.stack([part / step**power for part, power in zip(parts, range(5, -1, -1), strict=True)]), time_s)


def _on(curve: PPoly, time_s: np.ndarray, order: int = 0) -> np.ndarray:
    # numba takes half a second to import
    from magsim.trajectory.curves import values_on

    return values_on(curve, np.asarray(time_s, dtype=float), order)


class AttitudeCurve:
    """The rotation of a body from its own to Earth-fixed axes, as a smooth curve through rows of attitude.

    Roll, pitch and heading jump where an angle wraps, at the vertical and over the poles; the quaternion to the Earth
    does not. Its four numbers form a ``hermite_spline`` through the attitudes and rates of the rows, which leaves half
    to a third of the error of a cubic spline through the attitudes alone; where the rates are not known, they form
    that one. The rates between the rows are the derivatives of the same curve.

    Parameters
    ----------
    time_s : (n,) [s]
    lat_rad, lon_rad : (n,) [rad]
    attitude : (n, 3) [rad]
        Roll, pitch, heading.
    rate_eb_b : (n, 3) [rad/s], optional
        Angular rate of the body relative to the Earth, body axes.
    """

    def __init__(
        self,
        time_s: np.ndarray,
        lat_rad: np.ndarray,
        lon_rad: np.ndarray,
        attitude: np.ndarray,
        rate_eb_b: np.ndarray | None = None,
    ) -> None:
        self._time_s, self._heading = time_s, np.unwrap(attitude[:, 2])
        turned = quaternion_product(quaternion_en_at(lat_rad, lon_rad), quaternion_nb_from_attitude(attitude))
        # A quaternion and its negative are the same rotation: stay on one side.
        same = np.sum(turned[1:] * turned[:-1], axis=-1) >= 0.0
        turned[1:] *= np.cumprod(np.where(same, 1.0, -1.0))[:, None]
        if rate_eb_b is None:
            self._curve = CubicSpline(time_s, turned)
        else:
            pure = np.column_stack([np.zeros(len(rate_eb_b)), rate_eb_b])
            self._curve = hermite_spline(time_s, turned, 0.5 * quaternion_product(turned, pure))

    def at(self, time_s: np.ndarray, lat_rad: np.ndarray, lon_rad: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return attitude and rates at given times and places.

        Parameters
        ----------
        time_s : (m,) [s]
        lat_rad, lon_rad : (m,) [rad]
            Where the body is then: from there north and down are counted.

        Returns
        -------
        attitude : (m, 3) [rad]
            Roll in [-pi, pi), pitch, and heading as continuous as that of the rows.
        rate_eb_b : (m, 3) [rad/s]
            Angular rate of the body relative to the Earth, body axes.
        """
        turned = _on(self._curve, time_s)
        attitude = attitude_from_quaternion_nb(
            quaternion_product(quaternion_inverse(quaternion_en_at(lat_rad, lon_rad)), turned)
        )
        near = np.interp(time_s, self._time_s, self._heading)
        attitude[:, 2] += 2.0 * np.pi * np.round((near - attitude[:, 2]) / (2.0 * np.pi))
        return attitude, self.rate_eb_at(time_s)

    def rate_eb_at(self, time_s: np.ndarray) -> np.ndarray:
        """Return the angular rate of the body relative to the Earth at given times, body axes, (m, 3) [rad/s]."""
        turned, turning = _on(self._curve, time_s), _on(self._curve, time_s, 1)
        rate = quaternion_product(quaternion_inverse(turned), turning)[:, 1:]
        return 2.0 * rate / np.sum(turned * turned, axis=-1, keepdims=True)

    def rot_be_at(self, time_s: np.ndarray) -> np.ndarray:
        """Return the rotations from Earth-fixed to body axes at given times, (m, 3, 3)."""
        # numba takes half a second to import
        from magsim.trajectory.curves import rotations_on

        return rotations_on(self._curve.c, self._curve.x, np.asarray(time_s, dtype=float))


@dataclass(frozen=True)
class Trajectory:
    """Motion of one body at its log rate, with a smooth interpolant.

    Attributes
    ----------
    time_s : (n,) [s]
        Evenly spaced; may start before 0 and end after the last recorded row, so that filters have their run-in.
    lat_rad, lon_rad : (n,) [rad]
        WGS-84 latitude and longitude of the reference point; longitude continuous over the date line.
    alt_m : (n,) [m]
        Height of the reference point above the WGS-84 ellipsoid.
    velocity_n : (n, 3) [m/s]
        Over ground, north, east, down.
    attitude : (n, 3) [rad]
        Roll, pitch, heading; heading continuous (not wrapped).
    rate_b : (n, 3) [rad/s]
        Angular rate of the body relative to the local north-east-down frame, body axes: the derivative of the attitude.
    reference_b : (3,) [m]
        The point of the body that the position belongs to (the center of gravity), body axes.
    """

    time_s: np.ndarray
    lat_rad: np.ndarray
    lon_rad: np.ndarray
    alt_m: np.ndarray
    velocity_n: np.ndarray
    attitude: np.ndarray
    rate_b: np.ndarray
    reference_b: np.ndarray = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        n = len(self.time_s)
        shapes = {"velocity_n": (n, 3), "attitude": (n, 3), "rate_b": (n, 3), "reference_b": (3,)}
        for name in ("time_s", "lat_rad", "lon_rad", "alt_m", *shapes):
            value = readonly(getattr(self, name))
            if value.shape != shapes.get(name, (n,)):
                msg = f"{name} has shape {value.shape}, expected {shapes.get(name, (n,))}"
                raise ValueError(msg)
            object.__setattr__(self, name, value)

    def __len__(self) -> int:
        return len(self.time_s)

    def take(self, rows: np.ndarray | slice) -> "Trajectory":
        """Return some rows of the log, evenly spaced too."""
        cut = ("time_s", "lat_rad", "lon_rad", "alt_m", "velocity_n", "attitude", "rate_b")
        return replace(self, **{name: getattr(self, name)[rows] for name in cut})

    @property
    def rate_hz(self) -> float:
        """Log rate [Hz]."""
        return float((len(self.time_s) - 1) / (self.time_s[-1] - self.time_s[0]))

    @property
    def steady_attitude(self) -> np.ndarray:
        """Attitude with the heading of grid north near the poles, where the heading of north jumps; (n, 3) [rad]."""
        grid = grid_turn_of(self.lat_rad)
        if not grid:
            return self.attitude
        heading = np.unwrap(self.attitude[:, 2] + grid * self.lon_rad)
        return np.column_stack([self.attitude[:, :2], heading])

    @cached_property
    def _turning(self) -> AttitudeCurve:
        turning_n = transport_rate(self.lat_rad, self.alt_m, self.velocity_n)
        rate_eb_b = self.rate_b + rotate_back(rot_nb_from_attitude(self.attitude), turning_n)
        return AttitudeCurve(self.time_s, self.lat_rad, self.lon_rad, self.attitude, rate_eb_b)

    @cached_property
    def _path(self) -> CubicSpline:
        """Place and velocity in Earth-fixed axes, without singularities at poles and date line."""
        place_e = ecef_from_geodetic(self.lat_rad, self.lon_rad, self.alt_m)
        velocity_e = rotate_back(rot_ne_at(self.lat_rad, self.lon_rad), self.velocity_n)
        return CubicSpline(self.time_s, np.column_stack([place_e, velocity_e]))

    def _place_at(self, time_s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return latitude, longitude as continuous as that of the rows [rad], height [m], velocity (m, 3) [m/s]."""
        rows = _on(self._path, time_s)
        lat, lon, alt = geodetic_from_ecef(rows[:, :3])
        near = np.interp(time_s, self.time_s, self.lon_rad)
        velocity_n = rotate(rot_ne_at(lat, lon), rows[:, 3:])
        return lat, lon + 2.0 * np.pi * np.round((near - lon) / (2.0 * np.pi)), alt, velocity_n

    def moved_to(self, place_b: np.ndarray) -> "Trajectory":
        """Return the motion of another point of the same body.

        Parameters
        ----------
        place_b : (3,) [m]
            The point, body axes from the datum that ``reference_b`` counts from.

        Returns
        -------
        Trajectory
            Its place, its velocity ``v + w x arm`` with the rate ``w`` over the Earth, and the same attitude and rate
            against its own local axes.
        """
        arm_b = np.asarray(place_b, dtype=float) - self.reference_b
        rot_nb, rot_ne = rot_nb_from_attitude(self.attitude), rot_ne_at(self.lat_rad, self.lon_rad)
        rate_eb_b = self.rate_b + rotate_back(rot_nb, transport_rate(self.lat_rad, self.alt_m, self.velocity_n))
        arm_e = rotate_back(rot_ne, rotate(rot_nb, np.broadcast_to(arm_b, rate_eb_b.shape)))
        lat, lon, alt = geodetic_from_ecef(ecef_from_geodetic(self.lat_rad, self.lon_rad, self.alt_m) + arm_e)
        lon = lon + 2.0 * np.pi * np.round((self.lon_rad - lon) / (2.0 * np.pi))
        velocity_e = rotate_back(rot_ne, self.velocity_n + rotate(rot_nb, np.cross(rate_eb_b, arm_b)))
        velocity_n = rotate(rot_ne_at(lat, lon), velocity_e)
        turned = quaternion_product(
            quaternion_en_at(self.lat_rad, self.lon_rad), quaternion_nb_from_attitude(self.attitude)
        )
        attitude = attitude_from_quaternion_nb(
            quaternion_product(quaternion_inverse(quaternion_en_at(lat, lon)), turned)
        )
        attitude[:, 2] += 2.0 * np.pi * np.round((self.attitude[:, 2] - attitude[:, 2]) / (2.0 * np.pi))
        rate_b = rate_eb_b - rotate_back(rot_nb_from_attitude(attitude), transport_rate(lat, alt, velocity_n))
        return Trajectory(self.time_s, lat, lon, alt, velocity_n, attitude, rate_b, self.reference_b + arm_b)

    def inside(self, time_s: np.ndarray) -> np.ndarray:
        """Return the times if all of them are inside the logged span.

        Raises
        ------
        ValueError
            If one does not.
        """
        time_s = np.asarray(time_s, dtype=float)
        slack = 1e-9
        if len(time_s) and not (time_s.min() >= self.time_s[0] - slack and time_s.max() <= self.time_s[-1] + slack):
            msg = f"times {time_s.min()}..{time_s.max()} s leave the logged {self.time_s[0]}..{self.time_s[-1]} s"
            raise ValueError(msg)
        return time_s

    def motion_e_at(self, time_s: np.ndarray, *, order: int = 0) -> tuple[np.ndarray, np.ndarray]:
        """Return place and velocity of the reference point at other times, Earth-fixed axes, (m, 3) each [m], [m/s].

        Parameters
        ----------
        time_s : (m,) [s]
            Inside the logged span.
        order : int
            Of the time derivative of both.

        Raises
        ------
        ValueError
            If a time lies outside the logged span.
        """
        rows = _on(self._path, self.inside(time_s), order)
        return rows[:, :3], rows[:, 3:]

    def rate_eb_at(self, time_s: np.ndarray) -> np.ndarray:
        """Return the angular rate relative to the Earth at other times inside the logged span, body axes, (m, 3).

        Raises
        ------
        ValueError
            If a time lies outside the logged span.
        """
        return self._turning.rate_eb_at(self.inside(time_s))

    def rot_be_at(self, time_s: np.ndarray) -> np.ndarray:
        """Return the rotations from Earth-fixed to body axes at other times inside the logged span, (m, 3, 3).

        Raises
        ------
        ValueError
            If a time lies outside the logged span.
        """
        return self._turning.rot_be_at(self.inside(time_s))

    def at(self, time_s: np.ndarray) -> "Trajectory":
        """Return the motion at other times inside the logged span.

        Place and velocity are cubic splines through the rows in Earth-fixed axes, without singularities at
        date line and poles; attitude and rates are one curve, see ``AttitudeCurve``.

        Parameters
        ----------
        time_s : (m,) [s]

        Returns
        -------
        Trajectory
            With ``m`` rows.

        Raises
        ------
        ValueError
            If a time lies outside the logged span.
        """
        lat, lon, alt, velocity_n = self._place_at(self.inside(time_s))
        attitude, rate_eb_b = self._turning.at(time_s, lat, lon)
        rate_b = rate_eb_b - rotate_back(rot_nb_from_attitude(attitude), transport_rate(lat, alt, velocity_n))
        return Trajectory(time_s, lat, lon, alt, velocity_n, attitude, rate_b, self.reference_b)

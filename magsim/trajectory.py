"""What a flight leaves behind: trajectories with a smooth interpolant, control surfaces, segments."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline, PPoly
from scipy.linalg import solveh_banded

from magsim import columns
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
    """The curve of fifth degree through values and slopes at evenly spaced times, with three continuous derivatives.

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


class Turning:
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
        """Attitude and rates at given times and places.

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
        turned, turning = self._curve(time_s), self._curve(time_s, 1)
        attitude = attitude_from_quaternion_nb(
            quaternion_product(quaternion_inverse(quaternion_en_at(lat_rad, lon_rad)), turned)
        )
        near = np.interp(time_s, self._time_s, self._heading)
        attitude[:, 2] += 2.0 * np.pi * np.round((near - attitude[:, 2]) / (2.0 * np.pi))
        rate = quaternion_product(quaternion_inverse(turned), turning)[:, 1:]
        return attitude, 2.0 * rate / np.sum(turned * turned, axis=-1, keepdims=True)


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
    def _turning(self) -> Turning:
        turning_n = transport_rate(self.lat_rad, self.alt_m, self.velocity_n)
        rate_eb_b = self.rate_b + rotate_back(rot_nb_from_attitude(self.attitude), turning_n)
        return Turning(self.time_s, self.lat_rad, self.lon_rad, self.attitude, rate_eb_b)

    @cached_property
    def _path(self) -> CubicSpline:
        """Place and velocity in Earth-fixed axes, which know no poles and no date line."""
        place_e = ecef_from_geodetic(self.lat_rad, self.lon_rad, self.alt_m)
        velocity_e = rotate_back(rot_ne_at(self.lat_rad, self.lon_rad), self.velocity_n)
        return CubicSpline(self.time_s, np.column_stack([place_e, velocity_e]))

    def _place_at(self, time_s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Latitude, longitude as continuous as that of the rows [rad], height [m], velocity (m, 3) [m/s]."""
        rows = self._path(time_s)
        lat, lon, alt = geodetic_from_ecef(rows[:, :3])
        near = np.interp(time_s, self.time_s, self.lon_rad)
        velocity_n = rotate(rot_ne_at(lat, lon), rows[:, 3:])
        return lat, lon + 2.0 * np.pi * np.round((near - lon) / (2.0 * np.pi)), alt, velocity_n

    def inside(self, time_s: np.ndarray) -> np.ndarray:
        """The times, if all of them lie inside the logged span.

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

    def at(self, time_s: np.ndarray) -> "Trajectory":
        """The motion at other times inside the logged span.

        Place and velocity are cubic splines through the rows in Earth-fixed axes, which know neither date line nor
        pole; attitude and rates are one curve, see ``Turning``.

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


@dataclass(frozen=True)
class Segment:
    """One leg, the turn that follows it, or the transit to the next pattern."""

    circuit: int
    leg: int
    turn: bool
    heading_deg: float
    start_s: float
    stop_s: float
    length_m: float
    """Distance flown over ground [m]."""
    transit: bool = False
    """Whether it leads from one pattern to the next; it is a turn too."""


@dataclass(frozen=True)
class ManeuverFlown:
    """One maneuver train as it was asked and as it was flown."""

    axis: str
    circuit: int
    leg: int
    start_s: float
    stop_s: float
    period_s: float
    cycles: int
    asked_deg: float
    """Amplitude, half of peak to peak [deg]."""
    flown_deg: float
    """Amplitude of the sine fitted to the flown angle over the middle cycles [deg]."""
    residual_deg: float
    """RMS of what the fitted sine leaves of the flown angle [deg]."""
    off_axis_deg: tuple[float, float]
    """Peak departures of the two other angles from their straight line [deg], in the order roll, pitch, heading."""
    half_peak_to_peak_deg: float = 0.0
    """Half of the peak to peak of the flown angle over the middle cycles [deg]."""
    kind: str = ""
    """``combined`` where it is one axis of several that swing at once; else its axis."""


@dataclass(frozen=True)
class Flight:
    """A finished flight.

    Attributes
    ----------
    carrier : Trajectory
        The aircraft.
    duration_s : float
        Time of the last recorded row [s]; rows run from 0 to it.
    simulation_rate_hz : float
        Step rate of the flight model [Hz]; fields are integrated at this rate.
    controls : mapping of str to (n,) [rad]
        Deflection of each control surface about its hinge, at the carrier's log times, right-hand rule about the
        hinge axis that the aircraft file names (elevator and flap: trailing edge down is positive).
    segments : tuple of Segment
        Legs and turns in time order, without gaps.
    maneuvers : tuple of ManeuverFlown
    notes : mapping
        Plain facts of the run for provenance: integrators, rates, calibrated loop gains.
    wind_n : (n, 3) [m/s], optional
        Motion of the air over ground, north, east, down, at the carrier's log times; None where nobody knows it.
    switches : mapping of str to (n,)
        What the electric loads do at the carrier's log times: ``flap_motor`` 1 while it turns, ``autopilot`` 1 while it
        is engaged, ``throttle`` 0 to 1. Empty for a logged track.
    rotors : mapping of str to (n,) [rad/s], optional
        Angular speed of what turns, at the carrier's log times: ``propeller``; empty where nobody knows it.
    """

    carrier: Trajectory
    duration_s: float
    simulation_rate_hz: float
    controls: Mapping[str, np.ndarray]
    segments: tuple[Segment, ...]
    maneuvers: tuple[ManeuverFlown, ...]
    notes: Mapping[str, object] = field(default_factory=dict)
    wind_n: np.ndarray | None = None
    switches: Mapping[str, np.ndarray] = field(default_factory=dict)
    rotors: Mapping[str, np.ndarray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.wind_n is not None:
            wind_n = readonly(self.wind_n)
            if wind_n.shape != (len(self.carrier), 3):
                msg = f"wind_n has shape {wind_n.shape}, expected {(len(self.carrier), 3)}"
                raise ValueError(msg)
            object.__setattr__(self, "wind_n", wind_n)
        for kind in ("controls", "switches", "rotors"):
            table = {name: readonly(values) for name, values in getattr(self, kind).items()}
            for name, values in table.items():
                if values.shape != self.carrier.time_s.shape:
                    msg = f"{kind} {name!r} has shape {values.shape}, expected {self.carrier.time_s.shape}"
                    raise ValueError(msg)
            object.__setattr__(self, kind, table)
        object.__setattr__(self, "segments", tuple(self.segments))
        object.__setattr__(self, "maneuvers", tuple(self.maneuvers))

    @cached_property
    def _control_spline(self) -> CubicSpline:
        return CubicSpline(self.carrier.time_s, np.column_stack(list(self.controls.values())))

    def controls_at(self, time_s: np.ndarray) -> dict[str, np.ndarray]:
        """Deflections [rad] at other times inside the logged span, by cubic splines; (m,) for each surface.

        Raises
        ------
        ValueError
            If a time lies outside the logged span.
        """
        if not self.controls:
            return {}
        rows = self._control_spline(self.carrier.inside(time_s))
        return {name: readonly(rows[:, i]) for i, name in enumerate(self.controls)}

    def switches_at(self, time_s: np.ndarray) -> dict[str, np.ndarray]:
        """Switches at other times inside the logged span, straight between the rows of the log; (m,) for each.

        Raises
        ------
        ValueError
            If a time lies outside the logged span.
        """
        time_s = self.carrier.inside(time_s)
        return {name: readonly(np.interp(time_s, self.carrier.time_s, v)) for name, v in self.switches.items()}

    def wind_at(self, time_s: np.ndarray) -> np.ndarray | None:
        """Wind [m/s] at other times inside the logged span, straight between the rows of the log; (m, 3).

        Turbulence is rough: a smooth curve through its rows would overshoot. None where the wind is not known.

        Raises
        ------
        ValueError
            If a time lies outside the logged span.
        """
        if self.wind_n is None:
            return None
        time_s = self.carrier.inside(time_s)
        rows, at = self.carrier, self.carrier.at(time_s)
        wind_e = rotate_back(rot_ne_at(rows.lat_rad, rows.lon_rad), self.wind_n)
        columns_e = [np.interp(time_s, rows.time_s, wind_e[:, k]) for k in range(3)]
        return readonly(rotate(rot_ne_at(at.lat_rad, at.lon_rad), np.column_stack(columns_e)))

    def segment_columns(self, time_s: np.ndarray) -> dict[str, np.ndarray]:
        """Segment labels at given times, (m,) each, under the names of ``magsim.columns``.

        These are circuit, leg, turn, transit, leg_heading_deg, maneuver and cycle. Times before the first segment take
        the first, times after the last take the last.
        """
        time_s = np.asarray(time_s, dtype=float)
        starts = np.array([s.start_s for s in self.segments])
        index = np.clip(np.searchsorted(starts, time_s + 1e-9, side="right") - 1, 0, len(starts) - 1)
        out = {
            "circuit": np.array([s.circuit for s in self.segments], dtype=float)[index],
            "leg": np.array([s.leg for s in self.segments], dtype=float)[index],
            "turn": np.array([s.turn for s in self.segments], dtype=float)[index],
            "transit": np.array([s.transit for s in self.segments], dtype=float)[index],
            "leg_heading_deg": np.array([s.heading_deg for s in self.segments])[index],
            "maneuver": np.zeros(len(time_s)),
            "cycle": np.zeros(len(time_s)),
        }
        codes = {name: code for code, name in columns.MANEUVERS.items()}
        for maneuver in self.maneuvers:
            rows = (time_s >= maneuver.start_s - 1e-9) & (time_s < maneuver.stop_s - 1e-9)
            out["maneuver"][rows] = codes[maneuver.kind or maneuver.axis]
            begun = np.floor((time_s[rows] - maneuver.start_s) / maneuver.period_s + 1e-9) + 1.0
            # Of several axes at once the one that has flown most cycles counts.
            out["cycle"][rows] = np.maximum(out["cycle"][rows], np.minimum(begun, maneuver.cycles))
        return out

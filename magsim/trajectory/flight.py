"""The result of a flight: trajectories, control surfaces, segments, the bird."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from magsim import columns
from magsim.arrays import readonly
from magsim.earth.wgs84 import geodetic_from_ecef, rot_ne_at
from magsim.frames import rotate, rotate_back
from magsim.trajectory.motion import Trajectory


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
class CycleFlown:
    """One cycle of a sine train whose cycles scatter, commanded and flown."""

    start_s: float
    period_s: float
    asked_deg: float
    """Amplitude, half of peak to peak [deg]."""
    flown_deg: float
    """Half of the peak to peak of the flown angle [deg]."""


@dataclass(frozen=True)
class ManeuverFlown:
    """One sine train, commanded and flown.

    Where cycles scatter, amplitudes are means over the middle cycles, ``period_s`` is the mean, and the residual is
    that from the commanded angle.
    """

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
    """RMS of the flown angle less the fitted sine [deg]."""
    off_axis_deg: tuple[float, float]
    """Peak departures of the two other angles from their straight line [deg], in the order roll, pitch, heading."""
    half_peak_to_peak_deg: float = 0.0
    """Half of the peak to peak of the flown angle over the middle cycles [deg]."""
    kind: str = ""
    """``combined`` for one of several simultaneous axes, else its axis."""
    ease_in_s: float = 0.0
    """Time before the first cycle in which the oscillation rises [s]."""
    ease_out_s: float = 0.0
    """Time after the last cycle in which it falls [s]."""
    roll_part: float = 0.0
    """Commanded roll of a yaw train, over its angle."""
    scattered: tuple[CycleFlown, ...] = ()
    """Its cycles where they scatter."""

    @property
    def middle(self) -> tuple[CycleFlown, ...]:
        """Cycles that scatter, less the first and the last if there are more than two."""
        return self.scattered[1:-1] if self.cycles > 2 else self.scattered

    def cycle_at(self, time_s: np.ndarray) -> np.ndarray:
        """Return the number of the cycle at times within the train, from 1."""
        if self.scattered:
            return np.searchsorted([cycle.start_s - 1e-9 for cycle in self.scattered], time_s, side="right").astype(
                float
            )
        begun = np.floor((time_s - self.start_s) / self.period_s + 1e-9) + 1.0
        return np.minimum(begun, self.cycles)


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
        Motion of the air over ground, north, east, down, at the carrier's log times; None if unknown.
    switches : mapping of str to (n,)
        State of the electric loads at the carrier's log times: ``flap_motor`` 1 while it turns, ``autopilot`` 1 while
        it is engaged, ``throttle`` 0 to 1. Empty for a logged track.
    rotors : mapping of str to (n,) [rad/s], optional
        Angular speed of rotating parts, at the carrier's log times: ``propeller``; empty if unknown.
    bird : Trajectory, optional
        The towed bird, if any.
    rope : mapping of str to (n,), optional
        At the bird's log times: ``trail_rad`` and ``side_rad``, projections of the angle between the vertical and the
        line from hook to bridle, aft and to the right of the course over ground; ``tension_n`` at the hook.
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
    bird: Trajectory | None = None
    rope: Mapping[str, np.ndarray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.wind_n is not None:
            wind_n = readonly(self.wind_n)
            if wind_n.shape != (len(self.carrier), 3):
                msg = f"wind_n has shape {wind_n.shape}, expected {(len(self.carrier), 3)}"
                raise ValueError(msg)
            object.__setattr__(self, "wind_n", wind_n)
        for kind in ("controls", "switches", "rotors", "rope"):
            log = self.bird if kind == "rope" and self.bird is not None else self.carrier
            table = {name: readonly(values) for name, values in getattr(self, kind).items()}
            for name, values in table.items():
                if values.shape != log.time_s.shape:
                    msg = f"{kind} {name!r} has shape {values.shape}, expected {log.time_s.shape}"
                    raise ValueError(msg)
            object.__setattr__(self, kind, table)
        object.__setattr__(self, "segments", tuple(self.segments))
        object.__setattr__(self, "maneuvers", tuple(self.maneuvers))

    @property
    def instruments(self) -> Trajectory:
        """The body with the survey's instruments: the bird if one is towed, else the carrier."""
        return self.carrier if self.bird is None else self.bird

    def with_bird(self, bird: Trajectory, rope: Mapping[str, np.ndarray], notes: Mapping[str, object]) -> "Flight":
        """Return the same flight with a bird on a rope, and notes on it."""
        return replace(self, bird=bird, rope=rope, notes={**self.notes, **notes})

    def of_bird(self) -> "Flight":
        """Return the flight with the bird as its carrier, without the logs of the carrier itself.

        Raises
        ------
        ValueError
            If nothing is towed.
        """
        if self.bird is None:
            msg = "the flight has no bird"
            raise ValueError(msg)
        none: dict[str, np.ndarray] = {}
        return replace(
            self, carrier=self.bird, wind_n=None, controls=none, switches=none, rotors=none, bird=None, rope=none
        )

    def since(self, start_s: float) -> "Flight":
        """Return the same flight with logs that begin at a time."""
        rows = self.carrier.time_s >= start_s - 1e-9
        bird, rope = self.bird, self.rope
        if bird is not None:
            kept = bird.time_s >= start_s - 1e-9
            bird, rope = bird.take(kept), _rows_of(rope, kept)
        return replace(
            self,
            carrier=self.carrier.take(rows),
            controls=_rows_of(self.controls, rows),
            switches=_rows_of(self.switches, rows),
            rotors=_rows_of(self.rotors, rows),
            wind_n=None if self.wind_n is None else self.wind_n[rows],
            bird=bird,
            rope=rope,
        )

    @cached_property
    def _control_spline(self) -> CubicSpline:
        return CubicSpline(self.carrier.time_s, np.column_stack(list(self.controls.values())))

    @cached_property
    def _controls_read(self) -> list[tuple[np.ndarray, dict[str, np.ndarray]]]:
        """The last times, and the deflections at them: field and potentiometers ask for the same ones."""
        return []

    def controls_at(self, time_s: np.ndarray) -> dict[str, np.ndarray]:
        """Return deflections [rad] at other times inside the logged span, by cubic splines; (m,) for each surface.

        Raises
        ------
        ValueError
            If a time lies outside the logged span.
        """
        if not self.controls:
            return {}
        # numba takes half a second to import
        from magsim.trajectory.curves import values_on

        time_s, last = self.carrier.inside(time_s), self._controls_read
        if not (last and np.array_equal(last[0][0], time_s)):
            rows = values_on(self._control_spline, time_s)
            last[:] = [(readonly(time_s), {name: readonly(rows[:, i]) for i, name in enumerate(self.controls)})]
        return dict(last[0][1])

    def rope_at(self, time_s: np.ndarray) -> dict[str, np.ndarray]:
        """Return angles and tension of the rope at other times of the bird's logged span, by cubic splines; (m,) each.

        Raises
        ------
        ValueError
            If a time lies outside the logged span.
        """
        if self.bird is None:
            return {}
        time_s = self.bird.inside(time_s)
        return {name: readonly(CubicSpline(self.bird.time_s, values)(time_s)) for name, values in self.rope.items()}

    def wind_at(self, time_s: np.ndarray) -> np.ndarray | None:
        """Return the wind [m/s] at other times inside the logged span, linear between the rows of the log; (m, 3).

        Turbulence is rough: a smooth curve through its rows would overshoot. None if the wind is unknown.

        Raises
        ------
        ValueError
            If a time lies outside the logged span.
        """
        if self.wind_n is None:
            return None
        time_s, rows = self.carrier.inside(time_s), self.carrier
        lat, lon, _ = geodetic_from_ecef(rows.motion_e_at(time_s)[0])
        wind_e = rotate_back(rot_ne_at(rows.lat_rad, rows.lon_rad), self.wind_n)
        columns_e = [np.interp(time_s, rows.time_s, wind_e[:, k]) for k in range(3)]
        return readonly(rotate(rot_ne_at(lat, lon), np.column_stack(columns_e)))

    def segment_columns(self, time_s: np.ndarray) -> dict[str, np.ndarray]:
        """Return segment labels at given times, (m,) each, under the names of ``magsim.columns``.

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
            # Of several simultaneous axes the one with the most cycles counts.
            out["cycle"][rows] = np.maximum(out["cycle"][rows], maneuver.cycle_at(time_s[rows]))
        return out


def _rows_of(table: Mapping[str, np.ndarray], rows: np.ndarray) -> dict[str, np.ndarray]:
    """Select rows of every column."""
    return {name: values[rows] for name, values in table.items()}

"""Maneuver trains: when they fly, how large they came out, and what the loops must be asked so that they do."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from magsim.flight.autopilot import AXES
from magsim.flight.elements import Label
from magsim.planning import ScheduledOscillation, schedule
from magsim.scenario import PatternBase
from magsim.trajectory import ManeuverFlown, Trajectory

BOUNDS = ("elevator", "aileron", "rudder", "alpha", "beta")
"""Logged quantities that bound an amplitude."""

GRID_PERIODS_S = (3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 10.0, 12.0, 15.0, 20.0, 30.0)
"""Periods at which the loops' response is measured."""

ANGLES = {"roll": 0, "pitch": 1, "yaw": 2}
"""Column of ``Trajectory.attitude`` that a maneuver swings."""


class JointSwing(NamedTuple):
    """One axis of a maneuver, on the clock of the maneuver."""

    axis: str
    lag_s: float
    period_s: float
    cycles: int
    amplitude_deg: float
    ease_in_s: float
    ease_out_s: float


Joint = tuple[JointSwing, ...]
"""A maneuver, combined where it has more than one axis, with all that a calibration of its own depends on."""


class Drive(NamedTuple):
    """What a generator is told so that its axis flies what is asked.

    ``gain`` is the amplitude asked over that of the generator, ``lead`` [rad] the phase by which the generator leads.
    ``feed`` are the factors of the sine that is fed from another axis (``autopilot.FED``) and of its derivative [s].
    """

    gain: float
    lead: float
    feed: tuple[float, float] | None = None


@dataclass(frozen=True)
class Sweep:
    """One train on the clock of a flight.

    ``ease_in_s`` before the first cycle the generator rises from nothing, ``ease_out_s`` after the last it falls;
    half a period of it keeps the mean of the sine's integral, heading or height, where it was.
    """

    axis: str
    circuit: int
    leg: int
    start_s: float
    period_s: float
    cycles: int
    amplitude_deg: float
    ease_in_s: float
    ease_out_s: float
    joint: Joint = ()
    """The maneuver that it is a part of."""

    @property
    def kind(self) -> str:
        """``combined`` where several axes swing at once, else the axis."""
        return "combined" if len(self.joint) > 1 else self.axis

    @property
    def stop_s(self) -> float:
        """End of the last cycle [s]."""
        return self.start_s + self.cycles * self.period_s

    @property
    def omega(self) -> float:
        """Angular frequency [rad/s]."""
        return 2.0 * math.pi / self.period_s

    def angle(self, time_s: float) -> float:
        """The swing that is asked at a time [rad]."""
        tau = time_s - self.start_s
        rise = 1.0 + min(0.0, tau) / max(self.ease_in_s, 1e-3)
        fall = 1.0 - max(0.0, time_s - self.stop_s) / max(self.ease_out_s, 1e-3)
        if rise <= 0.0 or fall <= 0.0:
            return 0.0
        envelope = rise * rise * (3.0 - 2.0 * rise) * fall * fall * (3.0 - 2.0 * fall)
        return math.radians(self.amplitude_deg) * envelope * math.sin(self.omega * tau)

    def over(self, time_s: float) -> bool:
        """Whether the generator has come to rest."""
        return time_s >= self.stop_s + self.ease_out_s


def sweeps_of_leg(pattern: PatternBase, label: Label, start_s: float, leg_s: float) -> list[Sweep]:
    """The trains of a leg that begins at a time and takes a time."""
    planned, _ = schedule(pattern, label.index, leg_s)
    trains: dict[int, list[ScheduledOscillation]] = {}
    for swing in planned:
        trains.setdefault(swing.train, []).append(swing)
    joints = {number: joint_of(swings) for number, swings in trains.items()}
    return [
        Sweep(
            swing.axis,
            label.circuit,
            label.leg,
            start_s + swing.start_s,
            swing.period_s,
            swing.cycles,
            swing.amplitude_deg,
            swing.ease_in_s,
            swing.ease_out_s,
            joints[swing.train],
        )
        for swing in planned
    ]


def joint_of(swings: Sequence[ScheduledOscillation]) -> Joint:
    """The swings of one maneuver on its own clock, to the nanosecond, so that equal ones are equal."""
    zero_s = min(swing.start_s for swing in swings)
    return tuple(
        JointSwing(
            swing.axis,
            round(swing.start_s - zero_s, 9),
            swing.period_s,
            swing.cycles,
            swing.amplitude_deg,
            round(swing.ease_in_s, 9),
            round(swing.ease_out_s, 9),
        )
        for swing in sorted(swings, key=lambda swing: AXES.index(swing.axis))
    )


def joint_sweeps(joint: Joint, start_s: float) -> list[Sweep]:
    """The swings of a maneuver that begins at a time, in the order in which they begin to rise."""
    out = [
        Sweep(s.axis, 1, 1, start_s + s.lag_s, s.period_s, s.cycles, s.amplitude_deg, s.ease_in_s, s.ease_out_s, joint)
        for s in joint
    ]
    return sorted(out, key=lambda sweep: sweep.start_s - sweep.ease_in_s)


@dataclass(frozen=True)
class SineFit:
    """A sine with offset and slope, fitted by least squares."""

    amplitude: float
    phase: float
    """Of ``sin(omega (t - t0) + phase)`` [rad]."""
    residual_rms: float


def fit_sine(time_s: np.ndarray, values: np.ndarray, omega: float, t0_s: float) -> SineFit:
    """Fit ``a sin + b cos + c + d t`` to samples.

    Parameters
    ----------
    time_s, values : (n,)
        At least four samples.
    omega : float [rad/s]
    t0_s : float [s]
        Where the phase counts from.
    """
    tau = time_s - t0_s
    middle = 0.5 * (tau[0] + tau[-1])
    half = max(0.5 * (tau[-1] - tau[0]), 1e-9)
    basis = np.stack([np.sin(omega * tau), np.cos(omega * tau), np.ones_like(tau), (tau - middle) / half])
    # Normal equations by einsum: four well-scaled columns, and the same bits whatever the number of BLAS threads.
    gram = np.einsum("in,jn->ij", basis, basis)
    right = np.einsum("in,n->i", basis, values)
    solution = np.linalg.solve(gram, right)
    residual = values - np.einsum("i,in->n", solution, basis)
    return SineFit(
        float(math.hypot(solution[0], solution[1])),
        float(math.atan2(solution[1], solution[0])),
        float(np.sqrt(np.mean(residual**2))),
    )


def _departure(time_s: np.ndarray, values: np.ndarray) -> float:
    """Largest distance of samples from their straight line."""
    tau = time_s - time_s.mean()
    slope = float(np.einsum("n,n->", tau, values) / np.einsum("n,n->", tau, tau))
    return float(np.abs(values - values.mean() - slope * tau).max())


def middle_of(sweep: Sweep) -> tuple[float, float]:
    """Beginning and end of a train's middle cycles [s]: all but the first and the last, where it has more than two."""
    ends = sweep.period_s if sweep.cycles > 2 else 0.0
    return sweep.start_s + ends, sweep.stop_s - ends


def measure(sweep: Sweep, carrier: Trajectory) -> tuple[ManeuverFlown, float]:
    """A train as it was flown, and the phase [rad] by which it leads what was asked.

    The sine is fitted over the middle cycles: in the first one the loops still follow the growing swing.
    """
    time, attitude = carrier.time_s, carrier.steady_attitude
    rows = (time >= sweep.start_s - 1e-9) & (time <= sweep.stop_s + 1e-9)
    low, high = middle_of(sweep)
    middle = (time >= low - 1e-9) & (time <= high + 1e-9)
    axis = ANGLES[sweep.axis]
    fit = fit_sine(time[middle], attitude[middle, axis], sweep.omega, sweep.start_s)
    others = [_departure(time[rows], attitude[rows, i]) for i in range(3) if i != axis]
    flown = ManeuverFlown(
        axis=sweep.axis,
        circuit=sweep.circuit,
        leg=sweep.leg,
        start_s=sweep.start_s,
        stop_s=sweep.stop_s,
        period_s=sweep.period_s,
        cycles=sweep.cycles,
        asked_deg=sweep.amplitude_deg,
        flown_deg=math.degrees(fit.amplitude),
        residual_deg=math.degrees(fit.residual_rms),
        off_axis_deg=(math.degrees(others[0]), math.degrees(others[1])),
        half_peak_to_peak_deg=0.5 * math.degrees(float(np.ptp(attitude[middle, axis]))),
        kind=sweep.kind,
    )
    return flown, fit.phase


@dataclass(frozen=True)
class LoopResponse:
    """What the loops make of a sine on each axis: flown over asked, and its phase, over the period.

    Attributes
    ----------
    period_s : (n,) [s]
    gain : mapping of axis to (n,)
    phase : mapping of axis to (n,) [rad]
        Negative where the flown sine lags.
    largest_deg : mapping of axis to (n,)
        Amplitude at which a control reaches its stop or the air its limit.
    bound : mapping of axis to (n,)
        Which does, as an index of ``BOUNDS``.
    joints : mapping of Joint to mapping of axis to Drive
        What the generators are told in maneuvers with a calibration of their own.
    """

    period_s: np.ndarray
    gain: dict[str, np.ndarray]
    phase: dict[str, np.ndarray]
    largest_deg: dict[str, np.ndarray] = field(default_factory=dict)
    bound: dict[str, np.ndarray] = field(default_factory=dict)
    joints: Mapping[Joint, Mapping[str, Drive]] = field(default_factory=dict)

    def largest_at(self, axis: str, period_s: float) -> tuple[float, str]:
        """Largest amplitude [deg] at a period, straight between logarithms, and what bounds it."""
        x, at = np.log(self.period_s), math.log(period_s)
        largest = math.exp(float(np.interp(at, x, np.log(self.largest_deg[axis]))))
        return largest, BOUNDS[int(self.bound[axis][int(np.abs(x - at).argmin())])]

    def nearest_s(self, axis: str, amplitude_deg: float, period_s: float) -> float | None:
        """The period, in tenths, in which an amplitude can be flown and that is nearest; None if there is none."""
        periods = np.arange(round(10.0 * self.period_s[0]), round(10.0 * self.period_s[-1]) + 1) / 10.0
        near = sorted(periods.tolist(), key=lambda period: abs(period - period_s))
        return next((period for period in near if self.largest_at(axis, period)[0] >= amplitude_deg), None)

    def drive(self, sweep: Sweep) -> Drive:
        """What the generator of a train is told."""
        if sweep.joint in self.joints:
            return self.joints[sweep.joint][sweep.axis]
        gain, phase = self.at(sweep.axis, sweep.period_s)
        return Drive(gain, -phase)

    def at(self, axis: str, period_s: float) -> tuple[float, float]:
        """Gain and phase [rad] at a period, by cubic splines over its logarithm."""
        x = np.log(self.period_s)
        at = math.log(min(max(period_s, self.period_s[0]), self.period_s[-1]))
        return float(CubicSpline(x, self.gain[axis])(at)), float(CubicSpline(x, self.phase[axis])(at))

    def arrays(self) -> dict[str, np.ndarray]:
        """As plain arrays for the cache."""
        out = {"period_s": self.period_s}
        for axis in self.gain:
            out |= {f"gain_{axis}": self.gain[axis], f"phase_{axis}": self.phase[axis]}
        for axis in self.largest_deg:
            out |= {f"largest_deg_{axis}": self.largest_deg[axis], f"bound_{axis}": self.bound[axis]}
        return out

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray]) -> "LoopResponse":
        """From what ``arrays`` gave."""
        axes = [axis for axis in AXES if f"gain_{axis}" in arrays]
        limited = [axis for axis in axes if f"largest_deg_{axis}" in arrays]
        return cls(
            arrays["period_s"],
            {axis: arrays[f"gain_{axis}"] for axis in axes},
            {axis: arrays[f"phase_{axis}"] for axis in axes},
            {axis: arrays[f"largest_deg_{axis}"] for axis in limited},
            {axis: arrays[f"bound_{axis}"] for axis in limited},
        )


UNITY = LoopResponse(
    np.array([3.0, 6.0, 12.0, 30.0]), {axis: np.ones(4) for axis in AXES}, {axis: np.zeros(4) for axis in AXES}
)
"""Loops that would fly exactly what is asked: with it the raw response is measured."""


def calibration_sweeps(axis: str, amplitude_deg: Sequence[float]) -> list[Sweep]:
    """Trains of three cycles of each period of the grid on one axis, one after the other."""
    out, time = [], 20.0
    for period, amplitude in zip(GRID_PERIODS_S, amplitude_deg, strict=True):
        half = 0.5 * period
        time += half
        out.append(Sweep(axis, 1, 1, time, period, 3, amplitude, half, half))
        time += 3.0 * period + half + 10.0
    return out


def calibration_amplitude(axis: str, period_s: float, margin_deg: float) -> float:
    """Amplitude [deg] of a calibration train.

    It is ten degrees. In pitch it is no more than 0.8 of the margin to the stall. With short periods, where large
    swings load lift curve and elevator most, it is up to the load factor of fifteen degrees in five seconds, and up to
    1.2 of the margin: the path follows the pitch, so the angle of attack takes two thirds of it.
    """
    if axis != "pitch":
        return 10.0
    if period_s <= 6.0:
        return max(1.0, min(3.0 * period_s, 1.2 * margin_deg))
    return max(1.0, min(10.0, 0.8 * margin_deg))

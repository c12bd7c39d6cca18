"""Maneuver trains: when they fly, how large they came out, and what the loops must be asked so that they do."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from magsim.flight.autopilot import AXES
from magsim.flight.elements import Label
from magsim.scenario import PatternBase, schedule
from magsim.trajectory import ManeuverFlown, Trajectory

GRID_PERIODS_S = (3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 10.0, 12.0, 15.0, 20.0, 30.0)
"""Periods at which the loops' response is measured."""

ANGLES = {"roll": 0, "pitch": 1, "yaw": 2}
"""Column of ``Trajectory.attitude`` that a maneuver swings."""


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
    kind: str = ""
    """``combined`` where several axes swing at once; empty for a train of its own."""

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
            "combined" if swing.kind == "combined" else "",
        )
        for swing in planned
    ]


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
        kind=sweep.kind or sweep.axis,
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
    """

    period_s: np.ndarray
    gain: dict[str, np.ndarray]
    phase: dict[str, np.ndarray]

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
        return out

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray]) -> "LoopResponse":
        """From what ``arrays`` gave."""
        axes = [axis for axis in AXES if f"gain_{axis}" in arrays]
        return cls(
            arrays["period_s"],
            {axis: arrays[f"gain_{axis}"] for axis in axes},
            {axis: arrays[f"phase_{axis}"] for axis in axes},
        )


UNITY = LoopResponse(
    np.array([3.0, 6.0, 12.0, 30.0]), {axis: np.ones(4) for axis in AXES}, {axis: np.zeros(4) for axis in AXES}
)
"""Loops that would fly exactly what is asked: with it the raw response is measured."""


def calibration_sweeps(axis: str, margin_deg: float) -> list[Sweep]:
    """Trains of three cycles of each period of the grid on one axis, one after the other.

    The amplitude is ten degrees. In pitch it is no more than 0.8 of the margin to the stall. With short periods, where
    large swings load lift curve and elevator most, it is up to the load factor of fifteen degrees in five seconds, and
    up to 1.2 of the margin: the path follows the pitch, so the angle of attack takes two thirds of it.
    """
    out, time = [], 20.0
    for period in GRID_PERIODS_S:
        amplitude = 10.0
        if axis == "pitch":
            amplitude = max(1.0, min(3.0 * period, 1.2 * margin_deg) if period <= 6.0 else min(10.0, 0.8 * margin_deg))
        half = 0.5 * period
        time += half
        out.append(Sweep(axis, 1, 1, time, period, 3, amplitude, half, half))
        time += 3.0 * period + half + 10.0
    return out

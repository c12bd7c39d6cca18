"""Amplitude and phase of a flown sine train, by a sine fitted to the angle."""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from magsim.flight.pilot.trains import SineTrain
from magsim.trajectory import CycleFlown, ManeuverFlown, Trajectory

ANGLES = {"roll": 0, "pitch": 1, "yaw": 2}
"""Column of ``Trajectory.attitude`` that a maneuver oscillates."""


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


def _from_line(time_s: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the distances of samples from their straight line, (n,)."""
    tau = time_s - time_s.mean()
    slope = float(np.einsum("n,n->", tau, values) / np.einsum("n,n->", tau, tau))
    return values - values.mean() - slope * tau


def _departure(time_s: np.ndarray, values: np.ndarray) -> float:
    """Return the largest distance of samples from their straight line."""
    return float(np.abs(_from_line(time_s, values)).max())


def middle_of(train: SineTrain) -> tuple[float, float]:
    """Return begin and end of a train's middle cycles [s]: all but first and last, if there are more than two."""
    starts = train.curve.starts_s
    first, last = (starts[1], starts[-2]) if train.cycles > 2 else (starts[0], starts[-1])
    return train.start_s + first, train.start_s + last


def rows_between(time_s: np.ndarray, first_s: float, last_s: float) -> slice:
    """Return the rows of a log, (n,) times in order, from one time to another, both included."""
    return slice(*np.searchsorted(time_s, (first_s - 1e-9, last_s + 1e-9)).tolist())


def measure(train: SineTrain, carrier: Trajectory) -> tuple[ManeuverFlown, float]:
    """Measure a flown train, and the phase [rad] by which it leads the command; 0 where its cycles scatter.

    The sine is fitted over the middle cycles: in the first one the loops still follow the growing oscillation.
    """
    time, attitude = carrier.time_s, carrier.steady_attitude
    rows = rows_between(time, train.start_s, train.stop_s)
    middle = rows_between(time, *middle_of(train))
    axis = ANGLES[train.axis]
    others = [_departure(time[rows], attitude[rows, i]) for i in range(3) if i != axis]
    asked, phase = train.amplitude_deg, 0.0
    half = 0.5 * math.degrees(float(np.ptp(attitude[middle, axis])))
    scattered: tuple[CycleFlown, ...] = ()
    if train.drawn:
        scattered = _cycles(train, time, attitude[:, axis])
        kept = scattered[1:-1] if train.cycles > 2 else scattered
        asked = math.fsum(cycle.asked_deg for cycle in kept) / len(kept)
        flown = half = math.fsum(cycle.flown_deg for cycle in kept) / len(kept)
        wanted = np.array([train.angle(t) for t in time[middle].tolist()])
        residual = _from_line(time[middle], attitude[middle, axis] - wanted)
        off = math.degrees(float(np.sqrt(np.mean(residual**2))))
    else:
        fit = fit_sine(time[middle], attitude[middle, axis], train.omega, train.start_s)
        flown, off, phase = math.degrees(fit.amplitude), math.degrees(fit.residual_rms), fit.phase
    maneuver = ManeuverFlown(
        axis=train.axis,
        circuit=train.circuit,
        leg=train.leg,
        start_s=train.start_s,
        stop_s=train.stop_s,
        period_s=train.period_s,
        cycles=train.cycles,
        asked_deg=asked,
        flown_deg=flown,
        residual_deg=off,
        off_axis_deg=(math.degrees(others[0]), math.degrees(others[1])),
        half_peak_to_peak_deg=half,
        kind=train.kind,
        ease_in_s=train.ease_in_s,
        ease_out_s=train.ease_out_s,
        roll_part=train.roll_part,
        scattered=scattered,
    )
    return maneuver, phase


def _cycles(train: SineTrain, time_s: np.ndarray, angle: np.ndarray) -> tuple[CycleFlown, ...]:
    """Measure each cycle of a train: both peaks lie inside of it."""
    out = []
    for cycle, (start, stop) in zip(train.drawn, pairwise(train.curve.starts_s), strict=True):
        rows = rows_between(time_s, train.start_s + start, train.start_s + stop)
        half = 0.5 * math.degrees(float(np.ptp(angle[rows])))
        out.append(CycleFlown(train.start_s + start, stop - start, cycle.amplitude_deg, half))
    return tuple(out)

"""How large a sine train was flown, by a sine fitted to the angle."""

import math
from dataclasses import dataclass

import numpy as np

from magsim.flight.pilot.trains import Sweep
from magsim.trajectory import ManeuverFlown, Trajectory

ANGLES = {"roll": 0, "pitch": 1, "yaw": 2}
"""Column of ``Trajectory.attitude`` that a maneuver swings."""


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

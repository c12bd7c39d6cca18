"""Maneuver trains: when they fly, how large they came out, and what the loops must be asked so that they do."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from magsim.flight.model.autopilot import AXES
from magsim.flight.pilot.trains import Joint, Sweep

BOUNDS = ("elevator", "aileron", "rudder", "alpha", "beta")
"""Logged quantities that bound an amplitude."""


class Drive(NamedTuple):
    """What a generator is told so that its axis flies what is asked.

    ``gain`` is the amplitude asked over that of the generator, ``lead`` [rad] the phase by which the generator leads.
    ``feed`` are the factors of the sine that is fed from another axis (``autopilot.FED``) and of its derivative [s].
    """

    gain: float
    lead: float
    feed: tuple[float, float] | None = None


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

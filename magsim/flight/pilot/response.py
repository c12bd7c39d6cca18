"""Response of the autopilot loops to a sine, and the drives that compensate it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from magsim.flight.model.autopilot import AXES
from magsim.flight.pilot.nodes import Arrays, Parts, mean, weighted
from magsim.flight.pilot.trains import ManeuverKey, SineTrain

BOUNDS = ("elevator", "aileron", "rudder", "alpha", "beta")
"""Logged quantities that bound an amplitude."""


FED = {"roll": "yaw", "yaw": "roll"}
"""Axes that disturb each other by their own frequencies; pitch does not, as the aircraft is symmetric."""


class Drive(NamedTuple):
    """How an axis is commanded for it to fly a train as asked.

    ``gain`` is the amplitude that is asked over the commanded one, ``lead`` [rad] the phase by which the command leads.
    ``feed`` are the factors of the swing that is fed from another axis (``FED``) and of its derivative [s].
    """

    gain: float
    lead: float
    feed: tuple[float, float] | None = None


@dataclass(frozen=True)
class LoopResponse:
    """Response of the loops to a sine on each axis, over the period: flown over commanded amplitude, and phase.

    Attributes
    ----------
    period_s : (n,) [s]
    gain : mapping of axis to (n,)
    phase : mapping of axis to (n,) [rad]
        Negative where the flown sine lags.
    largest_deg : mapping of axis to (n,)
        Amplitude at which a control reaches its stop or the air its limit.
    bound : mapping of axis to (n,)
        Which of them, as an index of ``BOUNDS``.
    maneuvers : mapping of ManeuverKey to mapping of axis to Drive
        Drives of maneuvers with a calibration of their own.
    """

    period_s: np.ndarray
    gain: dict[str, np.ndarray]
    phase: dict[str, np.ndarray]
    largest_deg: dict[str, np.ndarray] = field(default_factory=dict)
    bound: dict[str, np.ndarray] = field(default_factory=dict)
    maneuvers: Mapping[ManeuverKey, Mapping[str, Drive]] = field(default_factory=dict)

    def largest_at(self, axis: str, period_s: float) -> tuple[float, str]:
        """Return the largest amplitude [deg] at a period, linear between logarithms, and what bounds it."""
        x, at = np.log(self.period_s), math.log(period_s)
        largest = math.exp(float(np.interp(at, x, np.log(self.largest_deg[axis]))))
        return largest, BOUNDS[int(self.bound[axis][int(np.abs(x - at).argmin())])]

    def nearest_s(self, axis: str, amplitude_deg: float, period_s: float) -> float | None:
        """Return the nearest period, in tenths of a second, in which an amplitude can be flown, or None."""
        periods = np.arange(round(10.0 * self.period_s[0]), round(10.0 * self.period_s[-1]) + 1) / 10.0
        near = sorted(periods.tolist(), key=lambda period: abs(period - period_s))
        return next((period for period in near if self.largest_at(axis, period)[0] >= amplitude_deg), None)

    def drive(self, train: SineTrain) -> Drive:
        """Return the drive of a train."""
        if train.maneuver in self.maneuvers:
            return self.maneuvers[train.maneuver][train.axis]
        gain, phase = self.at(train.axis, train.period_s)
        return Drive(gain, -phase)

    def at(self, axis: str, period_s: float) -> tuple[float, float]:
        """Return gain and phase [rad] at a period, by cubic splines over its logarithm."""
        at = math.log(min(max(period_s, self.period_s[0]), self.period_s[-1]))
        gain, phase = self._splines[axis](at).tolist()
        return gain, phase

    @cached_property
    def _splines(self) -> dict[str, CubicSpline]:
        x = np.log(self.period_s)
        return {axis: CubicSpline(x, np.stack([self.gain[axis], self.phase[axis]], axis=-1)) for axis in self.gain}

    def arrays(self) -> dict[str, np.ndarray]:
        """Return plain arrays for the cache."""
        out = {"period_s": self.period_s}
        for axis in self.gain:
            out |= {f"gain_{axis}": self.gain[axis], f"phase_{axis}": self.phase[axis]}
        for axis in self.largest_deg:
            out |= {f"largest_deg_{axis}": self.largest_deg[axis], f"bound_{axis}": self.bound[axis]}
        return out

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray]) -> "LoopResponse":
        """Restore a response from the result of ``arrays``."""
        axes = [axis for axis in AXES if f"gain_{axis}" in arrays]
        limited = [axis for axis in axes if f"largest_deg_{axis}" in arrays]
        return cls(
            arrays["period_s"],
            {axis: arrays[f"gain_{axis}"] for axis in axes},
            {axis: arrays[f"phase_{axis}"] for axis in axes},
            {axis: arrays[f"largest_deg_{axis}"] for axis in limited},
            {axis: arrays[f"bound_{axis}"] for axis in limited},
        )


def mixed_responses(parts: Parts) -> Arrays:
    """Return arrays of a response between measured ones.

    Gains and phases are linear, largest amplitudes linear in their logarithms; what bounds these is that of the
    response with the largest weight.
    """
    _, nearest = max(parts, key=lambda part: part[0])
    out = mean(parts)
    for name in nearest:
        if name.startswith("bound_"):
            out[name] = nearest[name]
        elif name.startswith("largest_deg_"):
            out[name] = np.exp(weighted([(weight, np.log(arrays[name])) for weight, arrays in parts]))
    return out


UNITY = LoopResponse(
    np.array([3.0, 6.0, 12.0, 30.0]), {axis: np.ones(4) for axis in AXES}, {axis: np.zeros(4) for axis in AXES}
)
"""Loops that fly exactly what is commanded; with it the raw response is measured."""

"""A field of the Earth along the paths of places in a body: evaluated at few knots, joined by cubic splines.

Each place is followed on its own path, rotation included; nothing is expanded about the reference point. The knots
lie as close as the field demands at each place.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from magsim.field.kernels import spline_in_body
from magsim.field.situation import Passage
from magsim.trajectory import Trajectory

TOLERANCE_NT = 3e-6
"""What the spline between the knots may miss [nT], by bounds that are some times larger than what it does miss."""

SWING_RAD_S4 = 30.0
"""Fourth time derivative of an attitude in turbulence: half a degree at 1.2 Hz (estimate)."""

LEAST_HZ = 10.0
"""Fewest knots a second."""

SURVEY_HZ = 10.0
"""Rate at which a path is sampled before knots are set."""

REACH_STEP_M = 1.0
"""The reach of places is rounded up to whole ones of this: individuals of a type share their knots."""


@dataclass(frozen=True)
class BodyPlaces:
    """BodyPlaces in a body at which a field is asked for.

    Attributes
    ----------
    names : tuple of str
        For messages.
    arms_b : (p, 3) [m]
        From the reference point, body axes.
    reach_m : float
        No place of the body that is asked for, now or with these, is farther from the reference point.
    """

    names: tuple[str, ...]
    arms_b: np.ndarray
    reach_m: float

    @classmethod
    def of(cls, arms_b: Mapping[str, np.ndarray]) -> "BodyPlaces":
        """Return places by name, with the distance of the farthest, rounded up, as their reach."""
        arms = np.array(list(arms_b.values()), dtype=float).reshape(-1, 3)
        longest = float(np.sqrt(np.einsum("pi,pi->p", arms, arms)).max(initial=0.0))
        return cls(tuple(arms_b), arms, REACH_STEP_M * math.ceil(longest / REACH_STEP_M))

    def some(self, chosen: list[int]) -> "BodyPlaces":
        """Return some of the places, with the reach of all."""
        return BodyPlaces(tuple(self.names[p] for p in chosen), self.arms_b[chosen], self.reach_m)


@dataclass(frozen=True)
class Knots:
    """A path sampled for the spacing of knots.

    Attributes
    ----------
    time_s : (n,) [s]
    center_e : (n, 3) [m]
        Earth-fixed position of the reference point.
    speed_mps : (n,) [m/s]
        Over ground.
    """

    time_s: np.ndarray
    center_e: np.ndarray
    speed_mps: np.ndarray


FieldE = Callable[[np.ndarray], np.ndarray]
"""Field (m, 3) [nT] at positions (m, 3) [m], both along Earth-fixed axes."""

Bounds = Callable[[Knots], tuple[np.ndarray, np.ndarray]]
"""Bounds of the field's first and fourth derivative along any line at each place, (n,) [nT/m] and [nT/m^4]."""


def positions_along(path: Trajectory, arms_b: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """Return the Earth-fixed positions of points of a body at some times, (n, s, 3) [m].

    Parameters
    ----------
    path : Trajectory
    arms_b : (s, 3) [m]
        From the reference point, body axes.
    time_s : (n,) [s]
    """
    rot_be, center_e = path.rot_be_at(time_s), path.motion_e_at(time_s)[0]
    out = np.empty((len(time_s), len(arms_b), 3))
    for s, arm_b in enumerate(arms_b):
        # Place by place: the last bits of one do not depend on how many there are.
        out[:, s] = center_e + np.einsum("njk,j->nk", rot_be, arm_b)
    return out


def sampled(path: Trajectory, time_s: np.ndarray) -> Knots:
    """Return what the spacing of knots is computed from."""
    center_e, velocity_e = path.motion_e_at(time_s)
    return Knots(time_s, center_e, np.sqrt(np.einsum("ni,ni->n", velocity_e, velocity_e)))


def knots_of(path: Trajectory, reach_m: float, time_s: np.ndarray, bounds: Bounds) -> np.ndarray:
    """Return the times of the knots from the first to the last sample, (k,) [s].

    A cubic spline misses h^4 / 384 of the fourth time derivative. The path makes one of the speed, and a place on an
    arm makes one of the swings of the attitude.
    """
    survey = np.linspace(time_s[0], time_s[-1], max(8, int((time_s[-1] - time_s[0]) * SURVEY_HZ)))
    sampled_path = sampled(path, survey)
    first, fourth = bounds(sampled_path)
    curved = fourth * sampled_path.speed_mps**4 + first * reach_m * SWING_RAD_S4
    rate = np.maximum((curved / (384.0 * TOLERANCE_NT)) ** 0.25, LEAST_HZ)
    # Between two samples the larger of both rates holds.
    steps = np.maximum(rate[1:], rate[:-1]) * np.diff(survey)
    count = np.concatenate([[0.0], np.cumsum(steps)])
    whole = max(8, int(np.ceil(count[-1])))
    return np.interp(np.linspace(0.0, count[-1], whole + 1), count, survey)


def along_path(passage: Passage, places: BodyPlaces, knots: np.ndarray, field_e: FieldE) -> np.ndarray:
    """Return a field at several places of a body along its path, (p, n, 3) [nT] body axes.

    Parameters
    ----------
    passage : Passage
    places : BodyPlaces
    knots : (k,) [s]
        From ``knots_of``.
    field_e : callable
        The field at Earth-fixed positions.
    """
    positions = positions_along(passage.path, places.arms_b, knots)
    return joined(passage, knots, [field_e(positions[:, p]) for p in range(len(places.arms_b))])


def joined(passage: Passage, knots: np.ndarray, fields_e: list[np.ndarray]) -> np.ndarray:
    """Return fields (k, 3) [nT] at knots, Earth-fixed axes, at the samples of a flight in body axes, (p, n, 3) [nT].

    Earth-fixed axes do not turn with the place as north does near a pole.
    """
    out = np.empty((len(fields_e), len(passage.time_s), 3))
    for p, field_e in enumerate(fields_e):
        out[p] = spline_in_body(CubicSpline(knots, field_e).c, knots, passage.time_s, passage.rot_be)
    return out

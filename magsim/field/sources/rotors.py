"""What turns: dipoles and steel on a propeller shaft, as the mean over each step.

A propeller turns faster than fields are sampled. A sample here is not the value at an instant but the exact mean over
the step around it, so that the sum of whole steps is the integral over them: a frequency counter that counts over such
a window gets the alias that its own window and rate make, whatever the step of the simulation is.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

from magsim.aircraft.magnetics import RotatingDipole, Rotor
from magsim.field.kernels import summed
from magsim.field.sources.dipoles import SCALE, dipole_field
from magsim.field.tones import integrated, mean_tones
from magsim.streams import stream

RPM = math.pi / 30.0
"""Turn a minute in rad/s."""

WANDER_HZ = 10.0
"""Knots a second of the wandering of a governor; a cubic spline joins them, so no step of the simulation counts."""


@dataclass(frozen=True)
class Rotation:
    """Angle of a rotor and its first three derivatives at the samples, (n,) each [rad], [rad/s], ..."""

    phase: np.ndarray
    speed: np.ndarray
    rise: np.ndarray
    jerk: np.ndarray
    _tones: dict[float, np.ndarray] = field(default_factory=dict, init=False, repr=False, compare=False)

    def tone(self, step_s: float) -> np.ndarray:
        """Return ``mean_tone`` of the rotation, computed once, (n,) complex."""
        if step_s not in self._tones:
            self._tones[step_s] = mean_tone(self, step_s)
        return self._tones[step_s]

    def at_ratio(self, ratio: float) -> "Rotation":
        """Return the rotation of a rotor that turns ``ratio`` times as fast."""
        return Rotation(ratio * self.phase, ratio * self.speed, ratio * self.rise, ratio * self.jerk)


def wander(time_s: np.ndarray, sigma: float, correlation_s: float, rng: np.random.Generator) -> CubicSpline:
    """Return a wandering speed [rad/s]: a Gauss-Markov process at knots, joined by a cubic spline.

    Parameters
    ----------
    time_s : (n,) [s]
        Its span is covered.
    sigma : float [rad/s]
        Standard deviation at the knots.
    correlation_s : float [s]
        The autocorrelation falls to 1/e in this time.
    rng : numpy.random.Generator
    """
    count = max(4, math.ceil((time_s[-1] - time_s[0]) * WANDER_HZ) + 3)
    knots = time_s[0] + (np.arange(count) - 1.0) / WANDER_HZ
    keep = math.exp(-1.0 / (WANDER_HZ * correlation_s))
    steps = sigma * math.sqrt(1.0 - keep**2) * rng.standard_normal(count)
    steps[0] *= 1.0 / math.sqrt(1.0 - keep**2)
    return CubicSpline(knots, lfilter([1.0], [1.0, -keep], steps))


def rotation_of(time_s: np.ndarray, speeds: Sequence[CubicSpline], phase: float) -> Rotation:
    """Return the angle of a rotor, by exact integration of its speed.

    Parameters
    ----------
    time_s : (n,) [s]
    speeds : sequence of CubicSpline [rad/s]
        Their sum is the speed.
    phase : float [rad]
        Angle at time 0.
    """
    whole = np.zeros((4, len(time_s)))
    for spline in speeds:
        curve = spline.c.reshape(4, -1)
        whole += integrated(curve, spline.x, time_s)
        whole[0] -= integrated(curve, spline.x, np.zeros(1))[0]
    angle, speed, rise, jerk = whole
    return Rotation(phase + angle, speed, rise, jerk)


def mean_tone(motion: Rotation, step_s: float) -> np.ndarray:
    """Return the mean of ``exp(i phase)`` over the step around each sample, (n,) complex.

    Within a step the phase is ``p + w t + a t^2 / 2 + j t^3 / 6``. The part linear in time is integrated in closed
    form, the rest as a series whose first neglected terms are ``a^3`` and ``a j``: the moments of ``exp(i x s)`` over
    -1..1 are spherical Bessel functions (Abramowitz and Stegun, 10.1.14).

    Parameters
    ----------
    motion : Rotation
    step_s : float [s]
    """
    table = np.stack([motion.phase, motion.speed, motion.rise, motion.jerk])
    return mean_tones(table, step_s).view(complex)[:, 0]


@dataclass(frozen=True)
class ShaftDipole:
    """A dipole and a piece of steel on a shaft, small beside the distance to a mount.

    Attributes
    ----------
    position : (3,) [m]
        On the axis.
    axis : (3,)
        Unit vector; positive turning follows the right-hand rule.
    moment : (3,) [A m^2]
        Permanent, at phase zero. What lies along the axis stays.
    blade : (3,)
        Unit vector across the axis that turns with the part.
    polarizability : (3,) [m^3]
        Of the steel along the blade, across it, and along the axis.
    """

    position: np.ndarray
    axis: np.ndarray
    moment: np.ndarray
    blade: np.ndarray
    polarizability: np.ndarray

    def kernel(self, points: np.ndarray) -> np.ndarray:
        """Return the field of unit moments along x, y, z at points (s, 3), as (s, 3, 3) [nT / (A m^2)]."""
        ray = np.asarray(points, dtype=float) - self.position
        dist = np.sqrt(np.einsum("si,si->s", ray, ray))[:, None, None]
        return SCALE * (3.0 * np.einsum("si,sj->sij", ray, ray) / dist**5 - np.eye(3) / dist**3)

    def moments(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the moments that are constant and that go with cosine and sine of the phase, (3,) each [A m^2]."""
        along = self.axis * np.dot(self.axis, self.moment)
        across = self.moment - along
        return along, across, np.cross(self.axis, across)

    def polarizabilities(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the tensors that are constant and that go with cosine and sine of twice the phase, (3, 3) [m^3]."""
        side = np.cross(self.axis, self.blade)
        blade, across, along = self.polarizability
        axial, radial = np.outer(self.axis, self.axis), np.outer(self.blade, self.blade)
        mixed = np.outer(self.blade, side) + np.outer(side, self.blade)
        half = 0.5 * (blade - across)
        mean = 0.5 * (blade + across) * (np.eye(3) - axial) + along * axial
        return mean, half * (radial - np.outer(side, side)), half * mixed

    @classmethod
    def of(cls, dipole: RotatingDipole, rotor: Rotor) -> "ShaftDipole":
        """Return the source of a dipole of the aircraft file that turns with a rotor."""
        return cls(
            position=np.array(dipole.position_m),
            axis=np.array(rotor.axis),
            moment=np.array(dipole.moment_am2),
            blade=np.zeros(3) if dipole.blade is None else np.array(dipole.blade),
            polarizability=np.array(dipole.polarizability_m3),
        )


def rotating_moment(source: ShaftDipole, motion: Rotation, step_s: float, ambient_b: np.ndarray) -> np.ndarray:
    """Return the moment of a source on a shaft, each sample the mean over its step.

    The permanent moment makes a constant and the first harmonic, the steel a constant and the second harmonic of the
    ambient field, which is held over a step.

    Parameters
    ----------
    source : ShaftDipole
    motion : Rotation
    step_s : float [s]
    ambient_b : (n, 3) [nT]

    Returns
    -------
    (n, 3) [A m^2]
    """
    fixed, cosine, sine = source.moments()
    once = motion.tone(step_s)
    out = fixed + once.real[:, None] * cosine + once.imag[:, None] * sine
    if np.any(source.polarizability):
        twice = mean_tone(motion.at_ratio(2.0), step_s)
        steady, even, odd = (_magnetized(alpha, ambient_b) for alpha in source.polarizabilities())
        out += steady + twice.real[:, None] * even + twice.imag[:, None] * odd
    return out


def mean_moment(source: ShaftDipole, ambient_b: np.ndarray) -> np.ndarray:
    """Return the moment of a source on a shaft as its mean over whole turns, (n, 3) [A m^2].

    It is what remains of ``rotating_moment`` where steps are much longer than a turn.

    Parameters
    ----------
    source : ShaftDipole
    ambient_b : (n, 3) [nT]
    """
    return source.moments()[0] + _magnetized(source.polarizabilities()[0], ambient_b)


def _magnetized(polarizability: np.ndarray, ambient_b: np.ndarray) -> np.ndarray:
    """Return the moments that steel takes on, ``alpha B / mu0`` in terms of the constant of a dipole's field."""
    return 1.0 / (4.0 * np.pi * SCALE) * np.einsum("jk,nk->nj", polarizability, ambient_b)


@dataclass(frozen=True)
class SpinningDipole:
    """A source on a shaft with its moment along a flight.

    Attributes
    ----------
    source : ShaftDipole
    strengths : (n, 3) [A m^2]
        The moment.
    """

    source: ShaftDipole
    strengths: np.ndarray

    def gains(self, points: np.ndarray) -> np.ndarray:
        """Return the fields of unit moments at fixed points (s, 3) [m], (s, 3, 3) [nT / (A m^2)]."""
        return self.source.kernel(points)

    def at(self, points: np.ndarray) -> np.ndarray:
        """Return the field at fixed points (s, 3) [m], (n, s, 3) [nT]."""
        return np.swapaxes(summed(self.gains(points), np.ascontiguousarray(self.strengths)), 0, 1)

    def along(self, places: np.ndarray) -> np.ndarray:
        """Return the field at moving places (n, s, 3) [m], (n, s, 3) [nT]."""
        return dipole_field(self.source.position, self.strengths[:, None], places)


def rotor_stream(seed: int, rotor: str) -> np.random.Generator:
    """Return the random numbers of a rotor: its first phase and its wandering."""
    return stream(seed, f"rotor/{rotor}")


def rotor_rotation(
    rotor: Rotor, random: np.random.Generator, logged_s: np.ndarray, flown: np.ndarray | None, time_s: np.ndarray
) -> Rotation:
    """Return the angle of a rotor along a flight: the flown speed or its own, with the wandering of its governor.

    Parameters
    ----------
    rotor : Rotor
    random : numpy.random.Generator
        Draws the phase at time 0 and the wandering.
    logged_s : (m,) [s]
        Times of the flight's log.
    flown : (m,) [rad/s], optional
        Speed at these times; without it the speed of the aircraft file.
    time_s : (n,) [s]
        Times of the samples.
    """
    own = np.full(len(logged_s), rotor.speed_rpm * RPM)
    speed = CubicSpline(logged_s, own if flown is None else flown)
    phase = random.uniform(0.0, 2.0 * np.pi)
    return rotation_of(time_s, [speed, wander(logged_s, rotor.wander_rpm * RPM, rotor.wander_s, random)], phase)

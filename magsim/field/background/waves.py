"""Waves along great circles: a random potential field for the whole globe.

With a complex vector ``c = u + i v`` of two perpendicular unit vectors, ``c . c = 0``, so ``(c . x)^n`` is a solution
of Laplace's equation, and so is its mirror image at a sphere of radius ``R``,

    potential = Re a R / (n + 1) (R / r)^(n + 1) w^n,    w = c . x / r.

It is a wave of length ``2 pi R / n`` that runs along the great circle across ``u x v``, dies out to both sides of it as
``exp(-n angle^2 / 2)``, and upward as ``r^-(n + 2)``. Waves along random circles make one field for all places, without
a seam at the date line and without poles.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import gammaln

from magsim.arrays import readonly

WAVELENGTHS_M = (5e3, 500e3)
"""Shortest and longest wave."""

BINS = 24
"""Bins of equal logarithmic width, with equal power: as much in each octave.

Estimate, from the root mean squares of crustal models at the ground: some 60 nT from 2500 to 300 km, 100 nT to 55 km.
"""

NEGLIGIBLE_NT = 1e-8
"""Waves that are smaller than this on the whole path are left out."""

MEAN_RADIUS_M = 6_371_000.0
CHUNK = 128

SYMMETRIC_3 = tuple((i, j, k) for i in range(3) for j in range(i, 3) for k in range(j, 3))
"""The ten numbers of a symmetric array of three indices."""


@dataclass(frozen=True)
class Waves:
    """Waves along great circles around an origin.

    Attributes
    ----------
    degree : (k,)
        ``n``.
    circle : (k, 2, 3)
        ``u`` and ``v``: two perpendicular unit vectors in the plane of the circle.
    amplitude_nt : (k,) [nT]
        Size of ``a``: of the upward component at the circle on the sphere.
    phase : (k,) [rad]
        Of ``a``.
    """

    degree: np.ndarray
    circle: np.ndarray
    amplitude_nt: np.ndarray
    phase: np.ndarray

    def __post_init__(self) -> None:
        for name in ("degree", "circle", "amplitude_nt", "phase"):
            object.__setattr__(self, name, readonly(getattr(self, name)))

    @property
    def complex_circle(self) -> np.ndarray:
        """``c``, (k, 3)."""
        return self.circle[:, 0] + 1j * self.circle[:, 1]

    def near(self, place: np.ndarray, radius_m: float) -> "Waves":
        """Return those that matter at some places (n, 3) [m] from the center of a sphere."""
        size = np.zeros(len(self.degree))
        for x in place:
            r = math.sqrt(float(np.einsum("i,i->", x, x)))
            w = np.abs(np.einsum("ki,i->k", self.complex_circle, x / r))
            growth = self.degree * np.log(np.maximum(w, 1e-300)) + (self.degree + 2) * math.log(radius_m / r)
            size = np.maximum(size, self.amplitude_nt * np.exp(growth))
        kept = size > NEGLIGIBLE_NT
        return Waves(self.degree[kept], self.circle[kept], self.amplitude_nt[kept], self.phase[kept])


def draw_waves(random: np.random.Generator, down_nt: float) -> Waves:
    """Draw waves: random circles and phases, equal power in each bin of wavelengths.

    A wave of degree ``n`` is ``sqrt(pi / n) / 2`` of the sphere wide, so that of short waves there are more.

    Parameters
    ----------
    random : numpy.random.Generator
    down_nt : float [nT]
        Root mean square of the vertical component on the sphere, over many draws; ``1 / sqrt(2)`` of it in each
        horizontal one, as in every isotropic potential field.
    """
    last, first = (2.0 * math.pi * MEAN_RADIUS_M / length for length in WAVELENGTHS_M)
    edges = np.linspace(math.log(first), math.log(last), BINS + 1)
    counts = [math.ceil(2.0 * math.sqrt(math.exp(edge) / math.pi)) for edge in edges[1:]]
    share = np.repeat([down_nt**2 / BINS / count for count in counts], counts)
    place = np.concatenate([edges[b] + (edges[b + 1] - edges[b]) * random.random(n) for b, n in enumerate(counts)])
    degree = np.clip(np.rint(np.exp(place)), math.ceil(first), math.floor(last))
    u, v = random.standard_normal((2, len(degree), 3))
    u /= np.sqrt(np.einsum("ki,ki->k", u, u))[:, None]
    v -= np.einsum("ki,ki->k", u, v)[:, None] * u
    v /= np.sqrt(np.einsum("ki,ki->k", v, v))[:, None]
    # Mean of |w|^2n over the sphere: the power that a wave leaves at a random place.
    mean = 0.5 * math.sqrt(math.pi) * np.exp(gammaln(degree + 1.0) - gammaln(degree + 1.5))
    phase = 2.0 * math.pi * random.random(len(degree))
    return Waves(degree, np.stack([u, v], axis=1), np.sqrt(2.0 * share / mean), phase)


def derivatives(waves: Waves, radius_m: float, place: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return field, gradient and second derivatives of waves, exactly.

    Parameters
    ----------
    waves : Waves
    radius_m : float [m]
        Of the sphere.
    place : (n, 3) [m]
        From its center.

    Returns
    -------
    field : (n, 3) [nT]
    gradient : (n, 3, 3) [nT/m]
    second : (n, 3, 3, 3) [nT/m^2]
        Along the axes of ``place``.
    """
    sums = [_sums(waves, radius_m, place[start : start + CHUNK]) for start in range(0, len(place), CHUNK)]
    none, one, two, three = (np.concatenate(part) for part in zip(*sums, strict=True))
    square = 1.0 / np.einsum("ni,ni->n", place, place)
    x = place * square[:, None]  # the gradient of log r
    delta = np.eye(3) * square[:, None, None]
    field = -(one[:, 0] - none[:, 0, None] * x)
    xx = np.einsum("ni,nj->nij", x, x)
    mixed = np.einsum("ni,nj->nij", one[:, 1], x)
    gradient = two[:, 0] - mixed - mixed.transpose(0, 2, 1)
    gradient = -(gradient + none[:, 1, None, None] * xx - none[:, 0, None, None] * delta)
    second = np.zeros((len(place), 3, 3, 3))
    cubic = np.einsum("nij,nk->nijk", two[:, 1], x)
    square_part = np.einsum("nij,nk->nijk", xx, one[:, 2]) - np.einsum("nij,nk->nijk", delta, one[:, 1])
    last = np.einsum("nij,nk->nijk", delta, x) * none[:, 1, None, None, None]
    for part, sign in ((cubic, 1.0), (square_part, -1.0), (last, -1.0)):
        for order in ((0, 1, 2, 3), (0, 1, 3, 2), (0, 3, 2, 1)):
            second += sign * part.transpose(order)
    second += none[:, 2, None, None, None] * np.einsum("nij,nk->nijk", xx, x) - three
    return field, gradient, second


def _sums(waves: Waves, radius_m: float, place: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return sums over the waves of the potential times products of ``c / (c . x)``, of order 0 to 3.

    Each is a column of factors: with ``n`` the degree and ``m = 2 n + 1`` the power of ``1 / r`` in the potential
    ``(c . x)^n / r^m``; order 0: ``m``, ``m (m + 2)``, ``m (m + 2) (m + 4)``; order 1: ``n`` times 1, ``m``,
    ``m (m + 2)``; order 2: ``n (n - 1)`` times 1, ``m``; order 3: ``n (n - 1) (n - 2)``.
    """
    n, c = waves.degree, waves.complex_circle
    m = 2.0 * n + 1.0
    r = np.sqrt(np.einsum("ni,ni->n", place, place))[:, None]
    along = np.einsum("ni,ki->nk", place, c)
    # The complex logarithm in two parts: ten times as fast.
    size = 0.5 * n * np.log((along.real**2 + along.imag**2) / r**2) + (n + 1.0) * np.log(radius_m / r)
    angle = n * np.arctan2(along.imag, along.real) + waves.phase
    value = waves.amplitude_nt * (radius_m / (n + 1.0)) * np.exp(size) * (np.cos(angle) + 1j * np.sin(angle))
    inverse = 1.0 / along

    def summed(values: np.ndarray, factors: np.ndarray) -> np.ndarray:
        real = np.einsum("nk,ck->nc", values.real, np.ascontiguousarray(factors.real))
        return real - np.einsum("nk,ck->nc", values.imag, np.ascontiguousarray(factors.imag))

    pairs, triples = np.triu_indices(3), np.array(SYMMETRIC_3).T
    none = np.einsum("nk,ck->nc", value.real, np.stack([m, m * (m + 2.0), m * (m + 2.0) * (m + 4.0)]))
    value = value * inverse
    ones = [n * factor * c.T for factor in (1.0, m, m * (m + 2.0))]
    one = summed(value, np.concatenate(ones)).reshape(-1, 3, 3)
    value = value * inverse
    both = (n * (n - 1.0)) * c.T[pairs[0]] * c.T[pairs[1]]
    packed = summed(value, np.concatenate([both, m * both])).reshape(-1, 2, 6)
    two = np.empty((len(place), 2, 3, 3))
    two[:, :, pairs[0], pairs[1]] = two[:, :, pairs[1], pairs[0]] = packed
    value = value * inverse
    thrice = n * (n - 1.0) * (n - 2.0) * c.T[triples[0]] * c.T[triples[1]] * c.T[triples[2]]
    return none, one, two, unpacked(summed(value, thrice))


def unpacked(packed: np.ndarray) -> np.ndarray:
    """Return symmetric arrays of three indices, (n, 3, 3, 3), from their ten numbers, (n, 10)."""
    return packed[:, _INDEX_3].reshape(-1, 3, 3, 3)


_INDEX_3 = [SYMMETRIC_3.index(tuple(sorted((i, j, k)))) for i in range(3) for j in range(3) for k in range(3)]

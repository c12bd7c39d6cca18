"""How the main field departs from its model: what WMM2025's error model describes, as a field that can exist.

The published errors of a global model at the ground are 137, 89 and 141 nT to north, east and down (WMM2025, one standard
deviation). They are drawn as the sum of two fields without sources in the air: waves of 5 to 500 km, and a vector that
changes over hours and days.

**Waves.** With a complex vector ``c = u + i v`` of two perpendicular unit vectors, ``c . c = 0``, so ``(c . x)^n`` is a
solution of Laplace's equation, and so is its mirror image at a sphere of radius ``R``,

    potential = Re a R / (n + 1) (R / r)^(n + 1) w^n,    w = c . x / r.

It is a wave of length ``2 pi R / n`` that runs along the great circle across ``u x v``, dies out to both sides of it as
``exp(-n angle^2 / 2)``, and upward as ``r^-(n + 2)``. Waves along random circles of the whole globe make one field for all
places, without a seam at the date line and without poles.

**The sphere** touches the ellipsoid at the whole degrees of latitude and longitude next to the start. So all flights that
start near such a point meet exactly the same field, and neighbors nearly the same.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import gammaln

from magsim.arrays import readonly
from magsim.earth import LocalFrame, ecef_from_geodetic, radii_of_curvature, rot_ne_at
from magsim.field.background.main_field import KNOT_HZ
from magsim.field.background.path import in_body
from magsim.field.situation import Situation
from magsim.scenario import Scenario
from magsim.streams import stream

ERROR_NT = (137.0, 89.0, 141.0)
"""Errors of the model to north, east, down, standard deviations [nT] (WMM2025 Technical Report, error model)."""

WAVES_DOWN_NT = 120.0
"""Share of the waves in the last of them; ``1 / sqrt(2)`` of it in each of the others, as in every isotropic potential field.

Estimate: the report tells no shares. More than 126 nT would exceed the whole error to the east.
"""

WAVELENGTHS_M = (5e3, 500e3)
"""Shortest and longest wave. Longer ones are the vector's, shorter ones geology's."""

BINS = 24
"""Bins of equal logarithmic width, with equal power: as much in each octave.

Estimate, from the root mean squares of crustal models at the ground: some 60 nT from 2500 to 300 km, 100 to 55 km.
"""

PERIODS_S = (3.0 * 3600.0, 27.0 * 86400.0)
"""Periods of the vector: from what ``field.variation`` leaves to a rotation of the Sun."""

PERIODS = 24
"""Waves in time; their power grows as the period, a density of ``f^-2`` (usual for the disturbed field; estimate)."""

NEGLIGIBLE_NT = 1e-8
"""Waves that are smaller than this on the whole path are left out."""

MEAN_RADIUS_M = 6_371_000.0
CHUNK = 128

SYMMETRIC_3 = tuple((i, j, k) for i in range(3) for j in range(i, 3) for k in range(j, 3))


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


def draw_waves(random: np.random.Generator) -> Waves:
    """Draw the waves of one world: random circles and phases, equal power in each bin of wavelengths.

    A wave of degree ``n`` is ``sqrt(pi / n) / 2`` of the sphere wide, so that of short waves there are more.
    """
    last, first = (2.0 * math.pi * MEAN_RADIUS_M / length for length in WAVELENGTHS_M)
    edges = np.linspace(math.log(first), math.log(last), BINS + 1)
    counts = [math.ceil(2.0 * math.sqrt(math.exp(edge) / math.pi)) for edge in edges[1:]]
    share = np.repeat([WAVES_DOWN_NT**2 / BINS / count for count in counts], counts)
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
    return none, one, two, _unpacked(summed(value, thrice))


def _unpacked(packed: np.ndarray) -> np.ndarray:
    """Return symmetric arrays of three indices, (n, 3, 3, 3), from their ten numbers, (n, 10)."""
    return packed[:, _INDEX_3].reshape(-1, 3, 3, 3)


_INDEX_3 = [SYMMETRIC_3.index(tuple(sorted((i, j, k)))) for i in range(3) for j in range(3) for k in range(3)]


@dataclass(frozen=True)
class Disturbance:
    """A vector that changes over hours and days: the same at every place of a survey.

    Attributes
    ----------
    rate : (k,) [rad/s]
    amplitude_nt, phase : (k, 3) [nT], [rad]
        North, east, down.
    """

    rate: np.ndarray
    amplitude_nt: np.ndarray
    phase: np.ndarray

    def __post_init__(self) -> None:
        for name in ("rate", "amplitude_nt", "phase"):
            object.__setattr__(self, name, readonly(getattr(self, name)))

    def at(self, unix_s: np.ndarray) -> np.ndarray:
        """Return the vector at some times [s] since 1970 in UTC, (n, 3) [nT] north, east, down."""
        angle = np.asarray(unix_s)[:, None, None] * self.rate[:, None] + self.phase
        return np.einsum("nkc,kc->nc", np.cos(angle), self.amplitude_nt)


def draw_disturbance(random: np.random.Generator) -> Disturbance:
    """Draw the vector of one world; with the waves it has the error of the model in each component."""
    shares = (0.5, 0.5, 1.0)
    rms = np.sqrt(np.array(ERROR_NT) ** 2 - WAVES_DOWN_NT**2 * np.array(shares))
    edges = np.linspace(*np.log(PERIODS_S), PERIODS + 1)
    period = np.exp(edges[:-1] + random.random(PERIODS) * np.diff(edges))
    power = np.diff(np.exp(edges))
    amplitude = np.sqrt(2.0 * power / power.sum())[:, None] * rms
    return Disturbance(2.0 * math.pi / period, amplitude, 2.0 * math.pi * random.random((PERIODS, 3)))


@dataclass(frozen=True)
class Departure:
    """The departure of a scenario's main field.

    Attributes
    ----------
    frame : LocalFrame
        At the point of the ellipsoid that the sphere touches.
    radius_m : float [m]
        Of the sphere.
    waves : Waves
    disturbance : Disturbance
    scale : float
    """

    frame: LocalFrame
    radius_m: float
    waves: Waves
    disturbance: Disturbance
    scale: float = 1.0

    def place(self, position_e: np.ndarray) -> np.ndarray:
        """Return Earth-fixed positions (..., 3) [m] as counted from the center of the sphere."""
        return position_e - (self.frame.origin_e + self.radius_m * self.frame.rot_ne[2])

    def vector_e(self, unix_s: np.ndarray) -> np.ndarray:
        """Return the vector that changes with time along Earth-fixed axes, (n, 3) [nT]."""
        return self.scale * self.frame.to_earth(self.disturbance.at(unix_s))

    def expanded(self, position_e: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the waves' field, gradient and second derivatives at Earth-fixed positions; see ``derivatives``."""
        place = self.place(position_e)
        # 1 km is so little of a wave's width that what is small there is small between.
        near = self.waves.near(place[_thinned(place, 1000.0)], self.radius_m)
        field, gradient, second = derivatives(near, self.radius_m, place)
        return self.scale * field, self.scale * gradient, self.scale * second


def _thinned(place: np.ndarray, step_m: float) -> np.ndarray:
    """Return rows of a path (n, 3) [m] that are about a step apart, its ends among them."""
    steps = np.diff(place, axis=0)
    way = np.concatenate([[0.0], np.cumsum(np.sqrt(np.einsum("ni,ni->n", steps, steps)))])
    return np.unique(np.searchsorted(way, np.linspace(0.0, way[-1], 2 + int(way[-1] / step_m))).clip(max=len(way) - 1))


def departure_of(scenario: Scenario) -> Departure:
    """Return the departure of a scenario's main field from its model."""
    settings, start = scenario.field.earth.departure, scenario.start
    lat, lon = math.radians(round(start.lat_deg)), math.radians(round(start.lon_deg))
    meridian, normal = radii_of_curvature(lat)
    return Departure(
        LocalFrame(lat, lon, 0.0),
        math.sqrt(float(meridian * normal)),
        draw_waves(stream(settings.seed, "departure/waves")),
        draw_disturbance(stream(settings.seed, "departure/disturbance")),
        settings.scale,
    )


def vector_along(departure: Departure, scenario: Scenario, time_s: np.ndarray) -> np.ndarray:
    """Return the slow vector at times from row 0, (n, 3) [nT] Earth-fixed axes: knots a minute apart are exact."""
    knots = np.linspace(time_s[0], time_s[-1], max(8, math.ceil((time_s[-1] - time_s[0]) / 60.0) + 1))
    return CubicSpline(knots, departure.vector_e(scenario.start.time_utc.timestamp() + knots))(time_s)


def departure(situation: Situation) -> np.ndarray:
    """Return the departure in body axes, by its derivatives at each mount, (n, s + 1, 3) [nT].

    To second order: at the end of an arm of 11 m the third leaves 2e-5 nT of a wave of 5 km and 45 nT.
    """
    scenario, time_s, arms_b = situation.scenario, situation.time_s, situation.arms_b
    field = departure_of(scenario)
    count = max(8, math.ceil((time_s[-1] - time_s[0]) * KNOT_HZ) + 1)
    knots = np.linspace(time_s[0], time_s[-1], count)
    path = situation.flight.carrier.at(knots)
    value, gradient, second = field.expanded(ecef_from_geodetic(path.lat_rad, path.lon_rad, path.alt_m))
    rows, columns = np.triu_indices(3)
    triples = np.array(SYMMETRIC_3).T
    packed = np.column_stack([value, gradient[:, rows, columns], second[:, triples[0], triples[1], triples[2]]])
    table = CubicSpline(knots, packed)(time_s)
    gradient = np.empty((len(time_s), 3, 3))
    gradient[:, rows, columns] = gradient[:, columns, rows] = table[:, 3:9]
    second = _unpacked(table[:, 9:])
    rot_ne = rot_ne_at(situation.motion.lat_rad, situation.motion.lon_rad)
    rot_be = np.einsum("nij,nik->njk", situation.rot_nb, rot_ne)
    out = np.repeat((table[:, :3] + vector_along(field, scenario, time_s))[:, None, :], len(arms_b), axis=1)
    for s, arm_b in enumerate(arms_b[:-1]):
        arm_e = np.einsum("nji,j->ni", rot_be, arm_b)
        slope = gradient + 0.5 * np.einsum("nijk,nk->nij", second, arm_e)
        out[:, s] += np.einsum("nij,nj->ni", slope, arm_e)
    return in_body(situation, out)


def departure_at(scenario: Scenario, place: LocalFrame, time_s: np.ndarray) -> np.ndarray:
    """Return the departure at a place that does not move, at times from row 0, (n, 3) [nT] Earth-fixed axes."""
    field = departure_of(scenario)
    return field.expanded(place.origin_e[None])[0] + vector_along(field, scenario, time_s)

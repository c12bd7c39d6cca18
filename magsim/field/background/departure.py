"""How the main field departs from its model: what WMM2025's error model describes, as a field that can exist.

The published errors of a global model at the ground are 137, 89 and 141 nT to north, east and down (WMM2025, one
standard deviation). They are drawn as the sum of two fields without sources in the air: waves of 5 to 500 km, and a
vector that changes over hours and days.

The waves (``waves``) are drawn for a sphere that touches the ellipsoid at the whole degrees of latitude and longitude
next to the start. So all flights that start near such a point meet exactly the same field, and neighbors nearly the
same.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from magsim.arrays import readonly
from magsim.earth import LocalFrame, radii_of_curvature
from magsim.field.background.main_field import knots_along
from magsim.field.background.path import BodyPlaces
from magsim.field.background.waves import SYMMETRIC_3, Waves, derivatives, draw_waves
from magsim.field.kernels import expanded_in_body
from magsim.field.situation import Passage
from magsim.scenario import Scenario
from magsim.streams import stream

ERROR_NT = (137.0, 89.0, 141.0)
"""Errors of the model to north, east, down, standard deviations [nT] (WMM2025 Technical Report, error model)."""

WAVES_DOWN_NT = 120.0
"""Share of the waves in the last of them; ``1 / sqrt(2)`` of it in each of the others.

Estimate: the published errors come without shares. More than 126 nT would exceed the whole error to the east.
"""

PERIODS_S = (3.0 * 3600.0, 27.0 * 86400.0)
"""Periods of the vector: from what ``field.variation`` leaves to a rotation of the Sun."""

PERIODS = 24
"""Waves in time; their power grows as the period, a density of ``f^-2`` (usual for the disturbed field; estimate)."""


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
    first, last = map(math.log, PERIODS_S)
    edges = np.linspace(first, last, PERIODS + 1)
    period = np.exp(edges[:-1] + random.random(PERIODS) * np.diff(edges))
    power = np.diff(np.exp(edges))
    amplitude = np.sqrt(2.0 * power / power.sum())[:, None] * rms
    return Disturbance(2.0 * math.pi / period, amplitude, 2.0 * math.pi * random.random((PERIODS, 3)))


@dataclass(frozen=True)
class DepartureField:
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


def departure_of(scenario: Scenario) -> DepartureField:
    """Return the departure of a scenario's main field from its model."""
    settings, start = scenario.field.earth.departure, scenario.start
    lat, lon = math.radians(round(start.lat_deg)), math.radians(round(start.lon_deg))
    meridian, normal = radii_of_curvature(lat)
    return DepartureField(
        LocalFrame(lat, lon, 0.0),
        math.sqrt(float(meridian * normal)),
        draw_waves(stream(settings.seed, "departure/waves"), WAVES_DOWN_NT),
        draw_disturbance(stream(settings.seed, "departure/disturbance")),
        settings.scale,
    )


def vector_along(departure: DepartureField, scenario: Scenario, time_s: np.ndarray) -> np.ndarray:
    """Return the slow vector at times from row 0, (n, 3) [nT] Earth-fixed axes: knots a minute apart are exact."""
    knots = np.linspace(time_s[0], time_s[-1], max(8, math.ceil((time_s[-1] - time_s[0]) / 60.0) + 1))
    return CubicSpline(knots, departure.vector_e(scenario.start.time_utc.timestamp() + knots))(time_s)


def departure(passage: Passage) -> Callable[[BodyPlaces], np.ndarray]:
    """Return the departure in body axes, by its derivatives at each place, (p, n, 3) [nT].

    To second order: at the end of an arm of 11 m the third leaves 2e-5 nT of a wave of 5 km and 45 nT.
    """
    scenario, time_s = passage.scenario, passage.time_s
    field, knots = departure_of(scenario), knots_along(time_s)
    value, gradient, second = field.expanded(passage.path.motion_e_at(knots)[0])
    rows, columns = np.triu_indices(3)
    triples = np.array(SYMMETRIC_3).T
    value = value + vector_along(field, scenario, knots)
    packed = np.column_stack([value, gradient[:, rows, columns], second[:, triples[0], triples[1], triples[2]]])
    curve = CubicSpline(knots, packed).c
    return lambda places: expanded_in_body(curve, knots, time_s, passage.rot_be, places.arms_b)


def departure_at(scenario: Scenario, place: LocalFrame, time_s: np.ndarray) -> np.ndarray:
    """Return the departure at a place that does not move, at times from row 0, (n, 3) [nT] Earth-fixed axes."""
    field = departure_of(scenario)
    return field.expanded(place.origin_e[None])[0] + vector_along(field, scenario, time_s)

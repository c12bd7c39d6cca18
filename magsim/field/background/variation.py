"""The field that changes with time: daily variation, pulsations, drift; the same vector at every place of a survey.

It is given along north, east and down at the start point. The classes of pulsations are those of Jacobs et al. (1964,
Journal of Geophysical Research 69, 180); sizes are quiet values at middle latitudes (estimates).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC

import numpy as np
from scipy.interpolate import CubicSpline

from magsim.earth import rot_ne_at
from magsim.field.background.path import BodyPlaces
from magsim.field.kernels import rotated
from magsim.field.situation import Passage
from magsim.scenario import Scenario, Variation
from magsim.signals import gauss_markov
from magsim.streams import stream

KNOT_HZ = 4.0
"""Rate at which daily variation and pulsations are evaluated; their shortest period is 10 s."""

HARMONICS = (1.0, 0.6, 0.3, 0.1)
"""Sizes of the daily variation's waves of 24, 12, 8 and 6 h (estimate)."""

BEFORE_S = 7200.0
"""Packets are drawn from so long before row 0: those that begin earlier have died out."""

SHARES = (1.0, 0.7, 0.3)
"""Size of a pulsation to north, east, down (estimate: they lie near the horizontal)."""


@dataclass(frozen=True)
class PulsationClass:
    """One class of continuous pulsations.

    Attributes
    ----------
    name : str
    shortest_s, longest_s : float [s]
        Periods.
    every_s : float [s]
        Mean time from one packet to the next (estimate).
    """

    name: str
    shortest_s: float
    longest_s: float
    every_s: float


CLASSES = (
    PulsationClass("pc3", 10.0, 45.0, 120.0),
    PulsationClass("pc4", 45.0, 150.0, 400.0),
    PulsationClass("pc5", 150.0, 600.0, 1500.0),
)


def daily(range_nt: tuple[float, float, float], hour: np.ndarray) -> np.ndarray:
    """Return the daily variation.

    Four waves about local noon: north and down are lowest at noon, east is high in the morning and low in the
    afternoon, as at middle northern latitudes.

    Parameters
    ----------
    range_nt : (3,) [nT]
        Peak to peak over a day, north, east, down; a negative number turns a component over.
    hour : (n,) [h]
        Local solar time.

    Returns
    -------
    (n, 3) [nT]
    """

    def waves(angle: np.ndarray) -> np.ndarray:
        order = np.arange(1, len(HARMONICS) + 1)
        sums = [np.einsum("nk,k->n", wave(np.outer(angle, order)), np.array(HARMONICS)) for wave in (np.cos, np.sin)]
        return -np.column_stack([sums[0], sums[1], sums[0]])

    whole = waves(np.linspace(0.0, 2.0 * np.pi, 2881))
    return waves(2.0 * np.pi * (np.asarray(hour) - 12.0) / 24.0) * (np.array(range_nt) / np.ptp(whole, axis=0))


@dataclass(frozen=True)
class Packet:
    """A Gaussian wave packet.

    Attributes
    ----------
    center_s, width_s : float [s]
        Time of its maximum, counted from row 0, and standard deviation of its envelope.
    frequency_hz : float [Hz]
    size_nt, phase : (3,) [nT], [rad]
        North, east, down.
    """

    center_s: float
    width_s: float
    frequency_hz: float
    size_nt: np.ndarray
    phase: np.ndarray

    def at(self, time_s: np.ndarray) -> np.ndarray:
        """Return the packet, (n, 3) [nT]."""
        since = time_s - self.center_s
        envelope = np.exp(-0.5 * (since / self.width_s) ** 2)
        wave = np.cos(2.0 * np.pi * self.frequency_hz * since[:, None] + self.phase)
        return envelope[:, None] * wave * self.size_nt


def draw_packets(random: np.random.Generator, kind: PulsationClass, largest_nt: float, until_s: float) -> list[Packet]:
    """Return the packets of one class in order of time, at random times, up to well after the last sample.

    A flight that lasts longer has the same packets and more of them.
    """
    packets: list[Packet] = []
    center = -BEFORE_S
    while True:
        center += float(random.exponential(kind.every_s))
        size, span = random.uniform(0.2, 1.0), random.uniform(1.0, 3.0)
        period = kind.shortest_s * (kind.longest_s / kind.shortest_s) ** random.random()
        phase = random.uniform(0.0, 2.0 * np.pi, 3)
        if center - 6.0 * 3.0 * kind.longest_s > until_s:
            return packets
        packets.append(Packet(center, span * period, 1.0 / period, largest_nt * size * np.array(SHARES), phase))


def pulsations(settings: Variation, seed: int, time_s: np.ndarray) -> np.ndarray:
    """Return all packets at some times in order, (n, 3) [nT]."""
    out = np.zeros((len(time_s), 3))
    for kind in CLASSES:
        largest = getattr(settings, f"{kind.name}_nt")
        for packet in draw_packets(stream(seed, f"variation/{kind.name}"), kind, largest, float(time_s[-1])):
            # Beyond six standard deviations there is less than 1e-7 of it.
            rows = slice(*np.searchsorted(time_s, packet.center_s + 6.0 * packet.width_s * np.array([-1.0, 1.0])))
            out[rows] += packet.at(time_s[rows])
    return out


def local_hour(scenario: Scenario, time_s: np.ndarray) -> np.ndarray:
    """Return the mean solar time at the start point's longitude [h], (n,)."""
    start = scenario.start.time_utc.astimezone(UTC)
    utc_h = start.hour + start.minute / 60.0 + (start.second + start.microsecond * 1e-6) / 3600.0
    return utc_h + scenario.start.lon_deg / 15.0 + np.asarray(time_s) / 3600.0


def variation_n(scenario: Scenario, time_s: np.ndarray) -> np.ndarray:
    """Return the variation at evenly spaced times, (n, 3) [nT] along axes of the start point; zero where it is off.

    The drift is an exact Gauss-Markov process on these times, begun in its stationary state.
    """
    settings = scenario.field.variation
    if settings is None or not settings.enabled:
        return np.zeros((len(time_s), 3))
    count = max(8, math.ceil((time_s[-1] - time_s[0]) * KNOT_HZ) + 1)
    knots = np.linspace(time_s[0], time_s[-1], count)
    slow = daily(settings.sq_nt, local_hour(scenario, knots)) + pulsations(settings, scenario.seed, knots)
    rate = (len(time_s) - 1) / (time_s[-1] - time_s[0])
    random = stream(scenario.seed, "variation/drift")
    drift = gauss_markov(random, (len(time_s), 3), settings.drift_nt, settings.drift_s, rate)
    return CubicSpline(knots, slow)(time_s) + drift


def variation_e(scenario: Scenario, time_s: np.ndarray) -> np.ndarray:
    """Return ``variation_n`` along Earth-fixed axes, (n, 3) [nT]: the same vector at every place."""
    start = scenario.start
    rot_ne = rot_ne_at(np.radians(start.lat_deg), np.radians(start.lon_deg))
    return np.einsum("ij,ni->nj", rot_ne, variation_n(scenario, time_s))


def variation(passage: Passage) -> Callable[[BodyPlaces], np.ndarray]:
    """Return the variation in body axes, the same vector at every place, (p, n, 3) [nT]."""
    field_b = rotated(passage.rot_be, variation_e(passage.scenario, passage.time_s))
    return lambda places: np.broadcast_to(field_b, (len(places.arms_b), *field_b.shape))

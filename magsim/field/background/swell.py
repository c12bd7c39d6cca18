"""The field of ocean waves: salt water that moves through the main field carries currents (Weaver 1965).

J. T. Weaver, Magnetic variations associated with ocean waves and swell, Journal of Geophysical Research 70 (1965) 1921.
In deep water a wave of amplitude ``a``, wavenumber ``k = omega^2 / g`` and direction ``s`` moves the water in circles,
``u = -i omega a (i s + z) exp(k z) exp(i psi)`` with ``psi = k s.x - omega t``. The vector potential across the wave
obeys a diffusion equation in the water, and Laplace's above it; joined at the mean surface they leave above it

    b = Re a k (B_z + i B_s) (q - k) / (q + k) (z - i s) exp(-k h) exp(i psi),    q^2 = k^2 - i omega mu0 sigma,

where ``B_z`` and ``B_s`` are the main field upward and along the wave. As ``omega mu0 sigma`` is small against ``k^2``,
this is nearly ``a omega mu0 sigma / (4 k)`` times the field, ``T a g mu0 sigma F / (8 pi)`` in Lilley et al. (2004),
Geophysical Journal International 159, 565.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from magsim.arrays import readonly
from magsim.earth import LocalFrame, geodetic_from_ecef
from magsim.earth.sea import LONGEST, SHORTEST, jonswap
from magsim.errors import DataError
from magsim.field.background.main_field import earth_at_start
from magsim.field.background.path import BodyPlaces, Knots, along_path, knots_of
from magsim.field.situation import Passage
from magsim.scenario import Swell
from magsim.streams import stream
from magsim.units import G0, MU0


@dataclass(frozen=True)
class SeaWaves:
    """Plane waves of deep water.

    Attributes
    ----------
    rate : (k,) [rad/s]
    direction : (k, 2)
        Unit vectors, north and east, along which they run.
    amplitude_m : (k,) [m]
    phase : (k,) [rad]
    """

    rate: np.ndarray
    direction: np.ndarray
    amplitude_m: np.ndarray
    phase: np.ndarray

    def __post_init__(self) -> None:
        for name in ("rate", "direction", "amplitude_m", "phase"):
            object.__setattr__(self, name, readonly(getattr(self, name)))

    @property
    def wavenumber(self) -> np.ndarray:
        """Wavenumbers in deep water, (k,) [rad/m]."""
        return self.rate**2 / G0

    def strength_nt(self, main_n: np.ndarray, conductivity_spm: float) -> np.ndarray:
        """Return the complex field of each wave at the mean surface, (k,) [nT]; see the head of this page.

        Parameters
        ----------
        main_n : (3,) [nT]
            North, east, down.
        conductivity_spm : float [S/m]
        """
        k = self.wavenumber
        q = np.sqrt(k**2 - 1j * self.rate * MU0 * conductivity_spm)
        across = -main_n[2] + 1j * np.einsum("ki,i->k", self.direction, main_n[:2])
        return self.amplitude_m * k * across * (q - k) / (q + k)

    def field(
        self, strength_nt: np.ndarray, place_n: np.ndarray, height_m: np.ndarray, time_s: np.ndarray
    ) -> np.ndarray:
        """Return the field of waves of given strengths (k,), (n, 3) [nT] north, east, down.

        Parameters
        ----------
        strength_nt : (k,) complex
        place_n : (n, 3) [m]
            North, east, down of an origin.
        height_m : (n,) [m]
            Above the mean surface.
        time_s : (n,) [s]
        """
        k, (un, ue) = self.wavenumber, self.direction.T
        angle = np.outer(place_n[:, 0], k * un) + np.outer(place_n[:, 1], k * ue) - np.outer(time_s, self.rate)
        angle += self.phase + np.angle(strength_nt)
        size = np.abs(strength_nt) * np.exp(-np.outer(height_m, k))
        level = size * np.sin(angle)
        sums = [
            np.einsum("nk,k->n", level, un),
            np.einsum("nk,k->n", level, ue),
            -np.einsum("nk->n", size * np.cos(angle)),
        ]
        return np.column_stack(sums)


def draw_waves(random: np.random.Generator, settings: Swell) -> SeaWaves:
    """Draw the waves of a sea: one in each of equal bins of frequency, with directions after Mitsuyasu and Goda.

    Directions scatter as ``cos^2s (angle / 2)`` with s largest at the peak (Goda, Random Seas and Design of Maritime
    Structures, 3rd edition, section 2.3): ``(f / f_p)^5`` of it below and ``(f / f_p)^-2.5`` above.
    """
    edges = np.linspace(LONGEST, SHORTEST, settings.waves + 1)
    ratio = edges[:-1] + random.random(settings.waves) * np.diff(edges)
    power = jonswap(ratio, settings.peak)
    amplitude = np.sqrt(power / power.sum() / 8.0) * settings.height_m  # the variance is height^2 / 16
    narrow = settings.spread * np.where(ratio <= 1.0, ratio**5.0, ratio**-2.5)
    # cos^2s (angle / 2): the square of the sine of half the angle has a beta distribution.
    half = np.arcsin(np.sqrt(random.beta(0.5, narrow + 0.5)))
    angle = math.radians(settings.heading_deg) + 2.0 * half * np.where(random.random(settings.waves) < 0.5, -1.0, 1.0)
    return SeaWaves(
        rate=2.0 * math.pi / settings.period_s * ratio,
        direction=np.column_stack([np.cos(angle), np.sin(angle)]),
        amplitude_m=amplitude,
        phase=2.0 * math.pi * random.random(settings.waves),
    )


def swell(passage: Passage) -> Callable[[BodyPlaces], np.ndarray]:
    """Return the field of the swell in body axes, along each place's own path and at its own time, (p, n, 3) [nT].

    Raises
    ------
    DataError
        If the flight crosses land.
    """
    scenario, path = passage.scenario, passage.path
    settings = scenario.field.swell
    assert settings is not None
    seed = scenario.seed if settings.seed is None else settings.seed
    waves = draw_waves(stream(seed, "swell/waves"), settings)
    strength = waves.strength_nt(earth_at_start(scenario), settings.conductivity_spm)
    sea_m = 0.0 if passage.ground is None else passage.ground.geoid_m
    check_over_water(passage)
    frame = LocalFrame(math.radians(scenario.start.lat_deg), math.radians(scenario.start.lon_deg), sea_m)

    @cache
    def knots(reach_m: float) -> np.ndarray:
        def bounds(knots: Knots) -> tuple[np.ndarray, np.ndarray]:
            _, _, alt = geodetic_from_ecef(knots.center_e)
            height = np.maximum(alt - sea_m - reach_m, 0.0)
            size = np.abs(strength) * np.exp(-np.outer(height, waves.wavenumber))
            passed = waves.wavenumber + waves.rate / np.maximum(knots.speed_mps, 1.0)[:, None]
            return np.einsum("nk,k->n", size, waves.wavenumber), np.einsum("nk,nk->n", size, passed**4)

        return knots_of(path, reach_m, passage.time_s, bounds)

    def fields(places: BodyPlaces) -> np.ndarray:
        at_s = knots(places.reach_m)

        def field_e(position_e: np.ndarray) -> np.ndarray:
            _, _, alt = geodetic_from_ecef(position_e)
            return frame.to_earth(waves.field(strength, frame.place(position_e), alt - sea_m, at_s))

        return along_path(passage, places, at_s, field_e)

    return fields


def check_over_water(passage: Passage) -> None:
    """Refuse a swell below which there is land; what start, track and path tell of it was checked before the flight."""
    ground = passage.ground
    if ground is None:
        return
    path = passage.motion
    land = ground.above_sea(ground.height(path.lat_rad, path.lon_rad)) > 0.0
    if land.any():
        at = int(land.argmax())
        msg = (
            f"field.swell: at {passage.time_s[at]:.1f} s the flight is over land, above mean sea level; allowed: "
            "flights over the sea, where [terrain] is 0 m high or left out"
        )
        raise DataError(msg)

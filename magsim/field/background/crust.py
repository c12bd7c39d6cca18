"""The crustal field: a random field that is exactly a potential field above its sources.

It is a sum of plane modes, each a solution of Laplace's equation that dies out with height. With straight axes north,
east, down and the height ``h = -down`` above the plane ``h = 0``,

    potential = sum A/k exp(-k h) cos(Psi),    Psi = k (u_n north + u_e east) + phase,    B = -grad potential

so that ``(B_n, B_e) = sum A exp(-k h) sin(Psi) (u_n, u_e)`` and ``B_d = -sum A exp(-k h) cos(Psi)``. Wavenumbers lie in
bins of equal logarithmic width, one mode in each. The power density of the sources falls as ``k^-exponent`` (about 3
for self-similar magnetization; Maus and Dimri 1995, unchecked) and is seen from ``depth`` above them, which leaves
``exp(-2 k depth)`` of it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from magsim.arrays import readonly
from magsim.earth import LocalFrame
from magsim.errors import DataError
from magsim.field.background.path import BodyPlaces, Knots, along_path, knots_of
from magsim.field.situation import Passage
from magsim.planning import shortest_crust_m
from magsim.scenario import Scenario
from magsim.streams import stream
from magsim.terrain import Ground

CHUNK = 256
"""Points that are worked on together: their modes stay in the processor's cache."""


@dataclass(frozen=True)
class CrustModes:
    """Plane modes of a field above the plane ``h = 0``.

    Attributes
    ----------
    wavenumber : (k,) [rad/m]
    direction : (k, 2)
        Unit vectors along which the modes change, north and east.
    amplitude_nt : (k,) [nT]
        At ``h = 0``.
    phase : (k,) [rad]
    """

    wavenumber: np.ndarray
    direction: np.ndarray
    amplitude_nt: np.ndarray
    phase: np.ndarray

    def __post_init__(self) -> None:
        for name in ("wavenumber", "direction", "amplitude_nt", "phase"):
            object.__setattr__(self, name, readonly(getattr(self, name)))

    def field(self, place_n: np.ndarray) -> np.ndarray:
        """Return the field.

        Parameters
        ----------
        place_n : (n, 3) [m]
            North, east, down of the origin on the plane ``h = 0``.

        Returns
        -------
        (n, 3) [nT]
            Along the same straight axes.
        """
        k, (un, ue) = self.wavenumber, self.direction.T
        by_sine, by_cosine = np.stack([un, ue]), -np.ones_like(k)[None]
        out = np.empty((len(place_n), 3))
        for start in range(0, len(out), CHUNK):
            north, east, down = np.asarray(place_n[start : start + CHUNK], dtype=float).T[:, :, None]
            size = self.amplitude_nt * np.exp(k * down)
            angle = north * (k * un) + east * (k * ue) + self.phase
            # einsum, not a matrix product: the same bits on any number of BLAS threads.
            sums = np.concatenate(
                [
                    np.einsum("nk,ck->cn", size * np.sin(angle), by_sine),
                    np.einsum("nk,ck->cn", size * np.cos(angle), by_cosine),
                ]
            )
            out[start : start + CHUNK] = sums.T
        return out

    def steepest(self, height_m: np.ndarray, order: int) -> np.ndarray:
        """Return a bound of the derivative of some order along any line at some heights, (n,) [nT/m^order]."""
        # The bound falls and is convex, so straight lines between a few heights lie above it.
        grid = np.linspace(np.min(height_m), np.max(height_m), 100)
        size = self.amplitude_nt * self.wavenumber**order
        return np.interp(height_m, grid, np.einsum("nk,k->n", np.exp(-np.outer(grid, self.wavenumber)), size))


def draw_modes(
    random: np.random.Generator,
    *,
    shortest_m: float,
    longest_m: float,
    exponent: float,
    depth_m: float,
    rms_nt: float,
    count: int,
) -> CrustModes:
    """Draw modes with a power-law spectrum.

    Parameters
    ----------
    random : numpy.random.Generator
    shortest_m, longest_m : float [m]
        Wavelengths between which there is power.
    exponent : float
        The isotropic two-dimensional power density of the sources falls as wavenumber to minus it.
    depth_m : float [m]
        Depth of the sources below ``h = 0``.
    rms_nt : float [nT]
        Root mean square of each of the vertical and the whole horizontal component at ``h = 0``.
    count : int
        Number of modes.

    Returns
    -------
    CrustModes
    """
    edges = np.linspace(np.log(2.0 * np.pi / longest_m), np.log(2.0 * np.pi / shortest_m), count + 1)
    k = np.exp(edges[:-1] + random.random(count) * np.diff(edges))
    power = k ** (1.0 - exponent) * np.diff(np.exp(edges)) * np.exp(-2.0 * depth_m * (k - k[0]))
    angle = 2.0 * np.pi * random.random(count)
    return CrustModes(
        wavenumber=k,
        direction=np.column_stack([np.cos(angle), np.sin(angle)]),
        amplitude_nt=np.sqrt(2.0 * power / power.sum()) * rms_nt,
        phase=2.0 * np.pi * random.random(count),
    )


@dataclass(frozen=True)
class CrustField:
    """The crustal field of a scenario.

    Attributes
    ----------
    frame : LocalFrame
        Axes at the start point, origin on the plane ``h = 0``.
    modes : CrustModes
    """

    frame: LocalFrame
    modes: CrustModes

    def field_e(self, position_e: np.ndarray) -> np.ndarray:
        """Return the field at Earth-fixed positions, (n, 3) [nT] along Earth-fixed axes."""
        return self.frame.to_earth(self.modes.field(self.frame.place(position_e)))

    def height(self, position_e: np.ndarray) -> np.ndarray:
        """Return the height [m] of Earth-fixed positions above the plane ``h = 0``, (n,)."""
        return -self.frame.place(position_e)[..., 2]


def crust_of(scenario: Scenario, ground: Ground | None) -> CrustField:
    """Return the crustal field of a scenario.

    The plane ``h = 0`` touches the height ``field.crust.plane_m`` over the start point; without that key the ground
    there, or the ellipsoid where the scenario has no ground.
    """
    settings, start = scenario.field.crust, scenario.start
    assert settings is not None
    lat, lon = np.radians(start.lat_deg), np.radians(start.lon_deg)
    plane_m = settings.plane_m
    if plane_m is None:
        plane_m = 0.0 if ground is None else float(ground.height(np.array(lat), np.array(lon)))
    modes = draw_modes(
        stream(scenario.seed if settings.seed is None else settings.seed, "crust/modes"),
        shortest_m=shortest_crust_m(settings, start, scenario.air),
        longest_m=settings.longest_m,
        exponent=settings.exponent,
        depth_m=settings.depth_m,
        rms_nt=settings.rms_nt,
        count=settings.modes,
    )
    return CrustField(LocalFrame(lat, lon, plane_m), modes)


def crust(passage: Passage) -> Callable[[BodyPlaces], np.ndarray]:
    """Return the crustal field in body axes, evaluated along each place's own path, (p, n, 3) [nT].

    Raises
    ------
    DataError
        If the flight goes below the plane ``h = 0``.
    """
    field = crust_of(passage.scenario, passage.ground)

    @cache
    def knots(reach_m: float) -> np.ndarray:
        def bounds(knots: Knots) -> tuple[np.ndarray, np.ndarray]:
            height = field.height(knots.center_e)
            check_above(height, knots.time_s, field)
            lowest = np.maximum(height - reach_m, 0.0)
            return field.modes.steepest(lowest, 1), field.modes.steepest(lowest, 4)

        return knots_of(passage.path, reach_m, passage.time_s, bounds)

    return lambda places: along_path(passage, places, knots(places.reach_m), field.field_e)


def check_above(height_m: np.ndarray, time_s: np.ndarray, field: CrustField) -> None:
    """Refuse places below the plane, where the modes grow without bound."""
    at = int(np.argmin(height_m))
    if height_m[at] >= 0.0:
        return
    needed = np.floor(field.frame.alt_m + height_m[at])
    msg = (
        f"field.crust: at {time_s[at]:.1f} s the flight is {-height_m[at]:.1f} m below the plane h = 0 of the crust, "
        f"which touches {field.frame.alt_m:.1f} m above the ellipsoid at the start point; allowed: "
        f"plane_m = {needed:g} or lower"
    )
    raise DataError(msg)

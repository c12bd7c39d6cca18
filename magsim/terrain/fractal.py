"""Random ground with the spectrum of real ground: a sum of cosine waves with power-law amplitudes.

The amplitude of a wave falls as its wavelength to the power of the Hurst exponent H, as that of a self-affine surface
does (spectral density of the surface ~ k^-(2 H + 2)). The sum is smooth, has an exact gradient, no edge and no
period within reach, and depends only on the random numbers passed in.
"""

import hashlib

import numpy as np

from magsim.terrain.plane import TangentPlane

WAVES = 192
"""Number of waves; their wavelengths are spaced evenly on a logarithmic scale."""

CHUNK = 4096
"""Places that are evaluated at once: bounds the memory."""

GOLDEN = 2.399963229728653
"""Golden angle [rad]: directions that follow it cover the circle evenly at every scale."""


class Fractal:
    """Seeded self-affine ground.

    Parameters
    ----------
    plane : TangentPlane
        In which the waves run.
    random : numpy.random.Generator
        For directions and phases.
    mean_m : float
        Mean height above mean sea level.
    relief_m : float
        Four standard deviations of the height: about the range between low and high ground.
    longest_m, shortest_m : float
        Wavelengths between which there is power.
    hurst : float
        0 rough, 1 smooth.
    """

    def __init__(
        self,
        plane: TangentPlane,
        random: np.random.Generator,
        *,
        mean_m: float,
        relief_m: float,
        longest_m: float,
        shortest_m: float,
        hurst: float,
    ) -> None:
        self._plane, self.mean_m = plane, mean_m
        self._settings = (mean_m, relief_m, longest_m, shortest_m, hurst)
        part = (np.arange(WAVES) + 0.5) / WAVES
        wavelength = longest_m * (shortest_m / longest_m) ** part
        # Directions are random within their sectors of the circle: every sector of a scale has waves.
        turn = 2.0 * np.pi * random.random() + GOLDEN * np.arange(WAVES) + 0.5 * random.standard_normal(WAVES)
        self._phase = 2.0 * np.pi * random.random(WAVES)
        number = 2.0 * np.pi / wavelength
        self._k_north, self._k_east = number * np.cos(turn), number * np.sin(turn)
        amplitude = (wavelength / longest_m) ** hurst
        # Each wave has a variance of half its amplitude squared.
        self._amplitude = amplitude * (relief_m / 4.0) / np.sqrt(0.5 * np.sum(amplitude**2))

    @property
    def digest(self) -> str:
        """SHA-256 over its settings and its random phases, in hexadecimal."""
        settings = repr((self._settings, self._plane.origin)).encode()
        return hashlib.sha256(settings + self._phase.astype("<f8").tobytes()).hexdigest()

    @property
    def highest_m(self) -> float:
        """A height that the surface does not exceed: all crests at one place [m]."""
        return self.mean_m + float(np.sum(self._amplitude))

    @property
    def waves(self) -> tuple[np.ndarray, np.ndarray]:
        """Wavelength [m] and amplitude [m] of every wave."""
        return 2.0 * np.pi / np.hypot(self._k_north, self._k_east), self._amplitude.copy()

    def height(self, lat_rad: np.ndarray, lon_rad: np.ndarray) -> np.ndarray:
        """Return the height above mean sea level, (...) [m]."""
        return self._sum(lat_rad, lon_rad, 1)[0]

    def slope(self, lat_rad: np.ndarray, lon_rad: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the rise for each meter to the north and to the east, (...) each."""
        _, north, east = self._sum(lat_rad, lon_rad, 3)
        return self._plane.turn(np.asarray(lat_rad), np.asarray(lon_rad), north, east)

    def _sum(self, lat_rad: np.ndarray, lon_rad: np.ndarray, count: int) -> np.ndarray:
        """Return height, and slopes along the plane's axes if ``count`` is 3; (count, ...)."""
        north, east = self._plane.place(lat_rad, lon_rad)
        shape = np.shape(north)
        north, east = np.ravel(north), np.ravel(east)
        out = np.empty((count, len(north)))
        for first in range(0, len(north), CHUNK):
            rows = slice(first, first + CHUNK)
            angle = north[rows, None] * self._k_north + east[rows, None] * self._k_east + self._phase
            out[0, rows] = self.mean_m + np.einsum("nw,w->n", np.cos(angle), self._amplitude)
            if count == 3:
                sine = np.sin(angle)
                out[1, rows] = -np.einsum("nw,w->n", sine, self._amplitude * self._k_north)
                out[2, rows] = -np.einsum("nw,w->n", sine, self._amplitude * self._k_east)
        return out.reshape(count, *shape)

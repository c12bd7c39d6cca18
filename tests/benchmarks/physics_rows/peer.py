"""A plain peer: the equations of an exact-norm compensation with a calibrated background, in numpy, and no more.

1. *Background* in body axes. ``B = S' x``, with ``x`` one, the fluxgate at five neighboring rows, and the currents.
   ``S`` is first solved for by least squares on the model field ``M`` turned by the INS; then Gauss-Newton steps lower
   ``|bp(|B| - |M|)|^2 / 0.3^2 + |B - R' M|^2 / 60^2`` [nT].
2. *Sources*. Interference is ``|B + V p| - |B|``. Vector columns ``V``: one, the field, its first and second
   derivative, its hysteresis, currents and deflections, each signal on all three axes. The most probable ``p`` under
   Gaussian priors of physical size comes from Levenberg-Marquardt steps on the residual in band.

It stays as it is, whatever becomes of the package: the method of the package is measured against it. It takes arrays.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from magsim.signals import band_pass, off_ends

TAPS = (-1, 0, 1, 2, 3)
"""Rows of the fluxgate around each row: they stand for its lag and bandwidth."""

LENGTH_NT, DIRECTION_NT = 0.3, 60.0
"""How far the length of the background, and each axis of it, is believed to lie from the turned model field."""

LENGTH_BAND_HZ = (0.02, 1.0)
LENGTH_EDGE_S = 10.0
LENGTH_STEPS = 8

PLAY_NT = (2500.0, 7500.0, 15000.0)
"""Half widths of the play operators, which are summed."""

PRIORS_NT = {"permanent": 1e3, "induced": 500.0, "eddy": 100.0, "second": 10.0, "memory": 100.0, "other": 10.0}
"""Standard deviation of a coefficient: in nT for columns of a field over its mean length, and their derivatives per
second; for a current in nT/A, for a deflection in nT/rad."""

ROWS_AS_ONE = 10.0
"""Neighboring rows in band count as one: their errors hang together."""

LEAST_NOISE_NT = 0.002

Residual = Callable[..., tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Flight:
    """Rows of one flight without a gap.

    ``model`` is the main field's model at the INS position in north, east, down; ``attitude`` roll, pitch and heading
    [rad]; ``surfaces`` are in rad. ``target`` is None where nothing is to be learned.
    """

    time_s: np.ndarray
    flux: np.ndarray
    model: np.ndarray
    attitude: np.ndarray
    currents: np.ndarray
    surfaces: np.ndarray
    target: np.ndarray | None = None

    @property
    def rate_hz(self) -> float:
        """Rows a second."""
        return (len(self.time_s) - 1) / float(self.time_s[-1] - self.time_s[0])

    @property
    def turned(self) -> np.ndarray:
        """Model field in body axes, (n, 3)."""
        (sr, sp, sh), (cr, cp, ch) = np.sin(self.attitude.T), np.cos(self.attitude.T)
        forward = np.stack([cp * ch, cp * sh, -sp])
        right = np.stack([sr * sp * ch - cr * sh, sr * sp * sh + cr * ch, sr * cp])
        down = np.stack([cr * sp * ch + sr * sh, cr * sp * sh - sr * ch, cr * cp])
        return np.stack([(axis * self.model.T).sum(axis=0) for axis in (forward, right, down)], axis=1)


@dataclass(frozen=True)
class Peer:
    """What was learned: scaling and matrix of the background, its mean length, and the coefficients of the sources."""

    center: np.ndarray
    scale: np.ndarray
    matrix: np.ndarray
    strength_nt: float
    sources: np.ndarray

    def background(self, flight: Flight) -> np.ndarray:
        """Return the background in body axes, (n, 3) [nT]."""
        return _scaled(_readings(flight), self.center, self.scale) @ self.matrix

    def interference(self, flight: Flight) -> np.ndarray:
        """Return the estimate, (n,) [nT]."""
        field = self.background(flight)
        vectors, _ = _columns(flight, field / self.strength_nt)
        return _length(field + vectors @ self.sources) - _length(field)


def fit(flights: Sequence[Flight]) -> Peer:
    """Learn both stages from flights with a target."""
    peer = _fit_background(flights)
    fields = [peer.background(flight) for flight in flights]
    peer = replace(peer, strength_nt=float(np.mean(_length(np.concatenate(fields)))))
    return replace(peer, sources=_fit_sources(flights, fields, peer.strength_nt))


def _length(vectors: np.ndarray) -> np.ndarray:
    return np.sqrt(np.einsum("ni,ni->n", vectors, vectors))


# ---- the background --------------------------------------------------------------------------------------------------


def _readings(flight: Flight) -> np.ndarray:
    """Return one, the fluxgate at its taps, and the currents, (n, q)."""
    count = len(flight.flux)
    rows = [np.clip(np.arange(count) + tap, 0, count - 1) for tap in TAPS]
    return np.hstack([np.ones((count, 1)), *(flight.flux[row] for row in rows), flight.currents])


def _scaled(readings: np.ndarray, center: np.ndarray, scale: np.ndarray) -> np.ndarray:
    return (readings - center) / scale


def _fit_background(flights: Sequence[Flight]) -> Peer:
    readings = np.vstack([_readings(flight) for flight in flights])
    center, scale = readings.mean(axis=0), readings.std(axis=0)
    center[0] = 0.0
    scale[scale < 1e-9] = 1.0  # the constant, and channels that never change
    scaled = [_scaled(_readings(flight), center, scale) for flight in flights]
    whole, turned = np.vstack(scaled), np.vstack([flight.turned for flight in flights])
    width = whole.shape[1]
    normal = whole.T @ whole + 1e-8 * len(whole) * np.eye(width)
    matrix = np.linalg.solve(normal, whole.T @ turned)
    model = [_length(flight.model) for flight in flights]
    for _ in range(LENGTH_STEPS):
        jacobian, missing = [], []
        for flight, part, length in zip(flights, scaled, model, strict=True):
            field = part @ matrix
            now = _length(field)
            unit = field / now[:, None]
            wide = np.hstack([part * unit[:, [0]], part * unit[:, [1]], part * unit[:, [2]], (length - now)[:, None]])
            kept = band_pass(wide, flight.rate_hz, LENGTH_BAND_HZ)[off_ends(flight.time_s, LENGTH_EDGE_S)]
            jacobian.append(kept[:, :-1])
            missing.append(kept[:, -1])
        slope, error = np.vstack(jacobian), np.concatenate(missing)
        curvature = slope.T @ slope / LENGTH_NT**2 + np.kron(np.eye(3), normal) / DIRECTION_NT**2
        pull = slope.T @ error / LENGTH_NT**2 + (whole.T @ (turned - whole @ matrix)).T.ravel() / DIRECTION_NT**2
        matrix = matrix + np.linalg.solve(curvature, pull).reshape(3, width).T
    return Peer(center, scale, matrix, 1.0, np.zeros(0))


# ---- the sources -----------------------------------------------------------------------------------------------------


def _columns(flight: Flight, field: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return vector columns (n, 3, k) and the priors of their coefficients (k,) from a field over its mean length."""
    count = len(field)
    spline = CubicSpline(np.arange(count) / flight.rate_hz, field, axis=0)
    once = spline(np.arange(count) / flight.rate_hz, 1)
    twice = CubicSpline(np.arange(count) / flight.rate_hz, once, axis=0)(np.arange(count) / flight.rate_hz, 1)
    groups = [
        (np.ones((count, 1)), "permanent"),
        (field, "induced"),
        (once, "eddy"),
        (twice, "second"),
        (_play(field, flight), "memory"),
        (np.hstack([flight.currents, flight.surfaces]), "other"),
    ]
    signals = np.hstack([signal for signal, _ in groups])
    priors = np.concatenate([np.full(3 * signal.shape[1], PRIORS_NT[name]) for signal, name in groups])
    vectors = np.zeros((count, 3, signals.shape[1], 3))
    for axis in range(3):
        vectors[:, axis, :, axis] = signals
    return vectors.reshape(count, 3, -1), priors


def _play(field: np.ndarray, flight: Flight) -> np.ndarray:
    """Return the mean of the play operators on each axis, (n, 3), as if the same had been flown before."""
    widths = np.array(PLAY_NT)[:, None] / float(np.mean(_length(flight.model)))
    low, high = field[:, None, :] - widths, field[:, None, :] + widths
    state, out = np.repeat(field[:1], len(PLAY_NT), axis=0), np.empty_like(low)
    for _ in range(2):
        for row in range(len(field)):
            state = np.minimum(np.maximum(state, low[row]), high[row])
            out[row] = state
    return out.mean(axis=1)


def _fit_sources(flights: Sequence[Flight], fields: Sequence[np.ndarray], strength_nt: float) -> np.ndarray:
    """Return the most probable coefficients, (k,)."""
    made = [_columns(flight, field / strength_nt) for flight, field in zip(flights, fields, strict=True)]
    priors = made[0][1]

    def residual(sources: np.ndarray, *, slopes: bool) -> tuple[np.ndarray, np.ndarray]:
        """Return what is left in band (n,), and its slopes (n, k) or nothing in their place."""
        parts = []
        for flight, field, (vectors, _) in zip(flights, fields, made, strict=True):
            total = field + vectors @ sources
            length = _length(total)
            assert flight.target is not None
            left = (flight.target - (length - _length(field)))[:, None]
            if slopes:
                left = np.hstack([left, np.einsum("nik,ni->nk", vectors, total / length[:, None])])
            parts.append(band_pass(left, flight.rate_hz)[off_ends(flight.time_s)])
        table = np.vstack(parts)
        return table[:, 0], table[:, 1:]

    sources = np.zeros(len(priors))
    left, slope = residual(sources, slopes=True)
    start = np.linalg.lstsq(slope * priors, left, rcond=1e-10)[0]
    noise_nt = max(float(np.std(left - slope * priors @ start)), LEAST_NOISE_NT)
    for _ in range(3):
        sources, left = _descend(residual, sources, priors, noise_nt)
        found = max(float(np.std(left)), LEAST_NOISE_NT)
        settled = abs(np.log(found / noise_nt)) < 0.2
        noise_nt = found
        if settled:
            break
    return sources


def _descend(
    residual: Residual, sources: np.ndarray, priors: np.ndarray, noise_nt: float
) -> tuple[np.ndarray, np.ndarray]:
    """Take Levenberg-Marquardt steps at a known noise; return the most probable coefficients and what is left."""
    weight = 1.0 / (ROWS_AS_ONE * noise_nt**2)

    def cost(left: np.ndarray, at: np.ndarray) -> float:
        return float(weight * (left @ left) + np.sum((at / priors) ** 2))

    damping = 1e-3
    left, slope = residual(sources, slopes=True)
    before = cost(left, sources)
    for _ in range(18):
        curvature = weight * (slope.T @ slope) + np.diag(priors**-2.0)
        pull = weight * (slope.T @ left) - sources / priors**2
        size = np.sqrt(np.diag(curvature))
        for _ in range(8):
            damped = curvature / np.outer(size, size) + damping * np.eye(len(size))
            tried = sources + np.linalg.solve(damped, pull / size) / size
            after = cost(residual(tried, slopes=False)[0], tried)
            if after < before:
                break
            damping *= 10.0
        else:
            return sources, left
        sources, damping = tried, max(damping / 10.0, 1e-12)
        left, slope = residual(sources, slopes=True)
        gained, before = before - after, after
        if gained < 1e-4 * max(after, 1.0):
            break
    return sources, left

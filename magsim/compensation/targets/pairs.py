"""Pairs of rows at one place: lines that cross, and paths that are flown again."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from magsim.earth import LocalFrame, ecef_from_geodetic
from magsim.signals import spans

APART_S = 60.0
"""Least time between the two passes of a place."""

APART_DEG = 20.0
"""Least difference of their courses: two passes on one course say nothing about the part that depends on heading."""

SPACING_S = 5.0
"""Pairs whose passes are both closer in time than this are one crossing: the nearest of them counts."""

LINEAR_S = 1800.0
"""A drift gets one power of time more for each half an hour. Estimate: in a quiet hour the daily variation changes by
some nT, mostly evenly; a base station takes it off, and then nothing but a constant is left."""


@dataclass(frozen=True)
class Track:
    """The way of one recording.

    Attributes
    ----------
    lat_deg, lon_deg : (n,) [deg]
    alt_m : (n,) [m]
    time_s : (n,) [s]
    station_nt : (n,) [nT], optional
        Reading of a base station.
    """

    lat_deg: np.ndarray
    lon_deg: np.ndarray
    alt_m: np.ndarray
    time_s: np.ndarray
    station_nt: np.ndarray | None = None


@dataclass(frozen=True)
class Pairs:
    """Pairs of rows between which the clean field differs by a slow drift alone.

    Attributes
    ----------
    recordings : (p, 2) int
        Numbers of the recordings of the earlier and of the later pass.
    rows : (p, 2) int
        Their rows.
    drift : (p, k)
        Orthonormal: what drifts can make of the differences.
    variation : (p,) [nT]
        Change of the time variation from pass to pass, as a base station saw it; 0 without one.
    """

    recordings: np.ndarray
    rows: np.ndarray
    drift: np.ndarray
    variation: np.ndarray

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def free(self) -> int:
        """Number of differences that the drift leaves free."""
        return len(self) - self.drift.shape[1]

    def differences(self, tables: Sequence[np.ndarray]) -> np.ndarray:
        """Return later minus earlier pass, without what a drift explains.

        Parameters
        ----------
        tables : sequence of (n, ...)
            Rows of each recording: values, or columns side by side.

        Returns
        -------
        (p, ...)
        """
        return self._undrifted(self._apart(tables))

    def target(self, values: Sequence[np.ndarray]) -> np.ndarray:
        """Return the differences of the target, without time variation and drift, (p,) [nT]."""
        return self._undrifted(self._apart(values) - self.variation)

    def _apart(self, tables: Sequence[np.ndarray]) -> np.ndarray:
        passes = [
            np.array([tables[i][row] for i, row in zip(numbers, rows, strict=True)])
            for numbers, rows in zip(self.recordings.T, self.rows.T, strict=True)
        ]
        return passes[1] - passes[0]

    def _undrifted(self, apart: np.ndarray) -> np.ndarray:
        shares = np.einsum("pk,p...->k...", self.drift, apart)
        return apart - np.einsum("pk,k...->p...", self.drift, shares)


def find_pairs(tracks: Sequence[Track], distance_m: float, height_m: float) -> Pairs:
    """Find where tracks meet again, on another course.

    Parameters
    ----------
    tracks : sequence of Track
    distance_m : float [m]
        Largest horizontal distance of the two rows.
    height_m : float [m]
        Largest difference of their heights.

    Returns
    -------
    Pairs
        In the order of time.
    """
    number = np.concatenate([np.full(len(track.time_s), i) for i, track in enumerate(tracks)])
    row = np.concatenate([np.arange(len(track.time_s)) for track in tracks])
    time_s = np.concatenate([track.time_s for track in tracks])
    lat, lon, alt = (np.concatenate([getattr(t, key) for t in tracks]) for key in ("lat_deg", "lon_deg", "alt_m"))
    # Straight axes at the middle of what was flown: both rows of a pair are bent by the same.
    frame = LocalFrame(float(np.radians(lat.mean())), float(np.radians(_middle_deg(lon))), 0.0)
    place = frame.place(ecef_from_geodetic(np.radians(lat), np.radians(lon), np.zeros(len(lat))))[:, :2]
    course = np.concatenate([_course(place[number == i], track.time_s) for i, track in enumerate(tracks)])
    met = cKDTree(place).query_pairs(distance_m, output_type="ndarray")
    a, b = met.T if len(met) else np.empty((2, 0), dtype=int)
    turned = np.abs((course[a] - course[b] + np.pi) % (2.0 * np.pi) - np.pi)
    good = np.abs(alt[a] - alt[b]) <= height_m
    good &= (number[a] != number[b]) | (np.abs(time_s[a] - time_s[b]) >= APART_S)
    good &= turned >= np.radians(APART_DEG)
    a, b = a[good], b[good]
    nearest = np.argsort(np.hypot(*(place[a] - place[b]).T), kind="stable")
    chosen = _one_each(a[nearest], b[nearest], number, time_s)
    seen = np.concatenate([np.zeros(len(t.time_s)) if t.station_nt is None else t.station_nt for t in tracks])[chosen]
    drift = _drift(tracks, number[chosen], time_s[chosen])
    return Pairs(number[chosen], row[chosen], drift, seen[:, 1] - seen[:, 0])


def _middle_deg(lon_deg: np.ndarray) -> float:
    angle = np.radians(lon_deg)
    return float(np.degrees(np.arctan2(np.sin(angle).mean(), np.cos(angle).mean())))


def _course(place: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """Return the direction of motion, (n,) [rad] from north to east; NaN for a row that stands alone."""
    out = np.full(len(place), np.nan)
    for span in spans(time_s):
        if span.stop - span.start >= 2:
            north, east = np.gradient(place[span], axis=0).T
            out[span] = np.arctan2(east, north)
    return out


def _one_each(a: np.ndarray, b: np.ndarray, number: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """Keep of pairs, the nearest first, those that are none of a crossing that is kept already, (p, 2), by time."""
    kept = np.empty((0, 2), dtype=int)
    for i, j in zip(a.tolist(), b.tolist(), strict=True):
        pair = np.array([min(i, j), max(i, j)])
        same = (number[kept] == number[pair]) & (np.abs(time_s[kept] - time_s[pair]) < SPACING_S)
        if not same.all(axis=1).any():
            kept = np.vstack([kept, pair])
    return kept[np.lexsort(kept.T[::-1])]


def _drift(tracks: Sequence[Track], number: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """Return orthonormal columns of what drifts can make of differences, (p, k)."""
    made = []
    for i, track in enumerate(tracks):
        length = max(float(track.time_s[-1] - track.time_s[0]), 1.0)
        order = 0 if track.station_nt is not None else 1 + int(length / LINEAR_S)
        scaled = (time_s - track.time_s[0]) / length
        for power in range(order + 1):
            of_pass = np.where(number == i, scaled**power, 0.0)
            made.append(of_pass[:, 1] - of_pass[:, 0])
    matrix = np.column_stack(made)
    left, singular, _ = np.linalg.svd(matrix, full_matrices=False)
    # a constant within one recording drops out of its differences
    return left[:, singular > 1e-9 * max(float(singular[0]), 1.0)] if len(matrix) else left

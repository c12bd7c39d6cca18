"""A towed bird that swings through a field that is exactly a polynomial of the position."""

from dataclasses import replace
from functools import cache

import numpy as np

from magsim.compensation.columns import TollesLawsonColumns
from magsim.recording import Recording
from magsim.signals import in_band
from tests.support.worlds import EXACT, FIELD_NT, calibration

COEFFICIENTS = np.concatenate(
    [
        [-60.0, 45.0, 90.0],
        [9e-3, -2e-3, 4e-3, 3e-3, -5e-3],
        [1.2e-3, 0.3e-3, -0.5e-3, 0.6e-3, -0.4e-3, 1.5e-3, -0.7e-3, 0.2e-3],
    ]
)
"""Of the 16 Tolles-Lawson terms."""

VERTICAL_NT_M = 0.02

PAIRS = {0: 0, 1: 2, 2: 5, 3: 9, 4: 14}
"""Columns of latitude and longitude, by order."""


def terms(recording: Recording) -> np.ndarray:
    """Tolles-Lawson columns of the bird, (n, 16)."""
    return TollesLawsonColumns(16, "cabin", strength_nt=FIELD_NT)(recording).matrix


def swing(recording: Recording) -> Recording:
    """The flight with a swing of 10 m in its position, inside of the band, without a whole period."""
    t = recording.time_s
    lat = recording["ins_lat_deg"] + 1e-4 * np.sin(0.8 * t + 0.3 * np.sin(0.05 * t))
    lon = recording["ins_lon_deg"] + 1e-4 * np.sin(0.9 * t + 0.5 * np.sin(0.04 * t) + 1.0)
    return replace(recording, data={**recording.data, "ins_lat_deg": lat, "ins_lon_deg": lon})


@cache
def bird(order: int, seed: int = 0, vertical: float = VERTICAL_NT_M) -> Recording:
    """A reading of Tolles-Lawson terms and a polynomial of latitude and longitude from the first row on, eq. 11.

    Each term of the polynomial comes to some 30 nT at the other end of the flight. Without a split: all rows are
    for training.
    """
    r = swing(calibration(EXACT, seed, f"bird{seed}"))
    lat, lon = r["ins_lat_deg"], r["ins_lon_deg"]
    north, east = (lat - lat[0]) / np.ptp(lat), (lon - lon[0]) / np.ptp(lon)
    rng = np.random.default_rng(seed)
    field = vertical * (r["ins_alt_m"] - r["ins_alt_m"][0])
    for n in range(1, order + 1):
        for k in range(n + 1):
            field = field + 30.0 * rng.normal() * north ** (n - k) * east**k
    own = terms(r) @ COEFFICIENTS
    clean = FIELD_NT + field
    changed = {"mag_cabin_nt": clean + own, "clean_cabin_nt": clean, "interference_cabin_nt": own}
    return replace(r, data={name: values for name, values in {**r.data, **changed}.items() if name != "split"})


def moved(recording: Recording, lat_deg: float = 0.0, lon_deg: float = 0.0, turn: float = 0.0) -> Recording:
    """The same flight elsewhere; longitudes in [-180, 180), or in [turn - 180, turn + 180)."""
    lon = (recording["ins_lon_deg"] + lon_deg + 180.0 - turn) % 360.0 - 180.0 + turn
    return replace(
        recording,
        data={**recording.data, "ins_lat_deg": recording["ins_lat_deg"] + lat_deg, "ins_lon_deg": lon},
    )


def off_nt(coefficients: np.ndarray, recording: Recording) -> float:
    """Largest in-band RMS that the error of one coefficient makes."""
    size = np.sqrt(np.mean(in_band(terms(recording), recording.time_s) ** 2, axis=0))
    return float(np.abs((coefficients - COEFFICIENTS) * size).max())

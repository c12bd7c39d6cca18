"""A survey over a known field: the model of the main field, and anomalies that are exact at every height."""

from dataclasses import replace
from datetime import datetime
from functools import cache

import numpy as np

from magsim.earth import decimal_years, igrf, radii_of_curvature
from magsim.recording import Recording
from tests.support.birds import COEFFICIENTS, terms
from tests.support.worlds import ALTITUDE_M, EXACT, LAT_DEG, LON_DEG, calibration

WAVES = ((25.0, 4_000.0, 30.0), (15.0, 2_500.0, 130.0), (8.0, 1_800.0, 75.0))
"""Amplitude at the reference height [nT], wavelength [m], direction of change [deg from north] of plane waves, each of
which falls with height as exp(-k h), as a potential field must."""

MAP_HEIGHT_M = ALTITUDE_M - 200.0

METERS = [float(r) for r in radii_of_curvature(np.array(np.radians(LAT_DEG)))]
NORTH_M = np.radians(1.0) * METERS[0]
EAST_M = np.radians(1.0) * METERS[1] * np.cos(np.radians(LAT_DEG))
"""Meters in a degree at the middle of the survey."""


def anomaly(lat_deg: np.ndarray, lon_deg: np.ndarray, height_m: np.ndarray | float) -> np.ndarray:
    """The waves [nT] at heights above the ellipsoid."""
    north, east = (lat_deg - LAT_DEG) * NORTH_M, (lon_deg - LON_DEG) * EAST_M
    out = np.zeros(np.broadcast_shapes(np.shape(lat_deg), np.shape(lon_deg)))
    for size, length, direction in WAVES:
        k, angle = 2.0 * np.pi / length, np.radians(direction)
        phase = k * (np.cos(angle) * north + np.sin(angle) * east)
        out = out + size * np.exp(-k * (height_m - MAP_HEIGHT_M)) * np.cos(phase)
    return out


def grid_text(step_deg: float, height_m: float = MAP_HEIGHT_M, margin_deg: float = 0.15) -> str:
    """An ESRI grid of the anomalies around the flights, at a height."""
    count = 2 * round(margin_deg / step_deg) + 1
    lat = LAT_DEG + margin_deg * np.linspace(-1.0, 1.0, count)
    lon = LON_DEG + margin_deg * np.linspace(-1.0, 1.0, count)
    values = anomaly(lat[:, None], lon[None, :], height_m)[::-1]
    head = f"ncols {count}\nnrows {count}\nxllcenter {float(lon[0])!r}\nyllcenter {float(lat[0])!r}\n"
    rows = "\n".join(" ".join(f"{v:.6f}" for v in row) for row in values)
    return f"{head}cellsize {float(lat[-1] - lat[0]) / (count - 1)!r}\nnodata_value -1e32\n{rows}\n"


def model(recording: Recording) -> np.ndarray:
    """Length of IGRF-14 at the places and times of a recording [nT]."""
    lat, lon, alt = (recording[f"ins_{name}"] for name in ("lat_deg", "lon_deg", "alt_m"))
    years = decimal_years(datetime.fromisoformat(str(recording.meta["start_utc"])), recording.time_s)
    return np.linalg.norm(igrf(np.radians(lat), np.radians(lon), alt, years), axis=1)


@cache
def survey(*, geology: bool = True, seed: int = 0) -> Recording:
    """A flight whose reading is Tolles-Lawson terms on the known field, to the last bit; all rows are for training."""
    r = calibration(EXACT, seed, f"survey{seed}")
    lat, lon, alt = (r[f"ins_{name}"] for name in ("lat_deg", "lon_deg", "alt_m"))
    clean = model(r)
    if geology:
        clean = clean + anomaly(lat, lon, alt)
    own = terms(r) @ COEFFICIENTS
    changed = {"mag_cabin_nt": clean + own, "clean_cabin_nt": clean, "interference_cabin_nt": own}
    return replace(r, data={name: values for name, values in {**r.data, **changed}.items() if name != "split"})

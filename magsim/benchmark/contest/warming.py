"""What the server does once so that no method's process needs to: compile, build models of settings, open libraries.

The flight is made up.
"""

from tempfile import TemporaryDirectory

import numpy as np

from magsim.compensation import create, load
from magsim.dataset import training_rows
from magsim.earth import decimal_years, igrf
from magsim.frames import rot_nb_from_attitude, rotate_back
from magsim.recording import Recording
from magsim.threads import one_blas_thread

METHODS = (
    "tl16",
    "tl16_recursive",
    "vector_tl",
    "exact_norm",
    "exact_norm_whole",
    "exact_norm_causal",
    "exact_norm_adaptive",
)
"""One of each kind that is fitted in less time than it takes to get ready."""

START = "2025-01-01T00:00:00+00:00"
ROWS = 6000


def warm() -> None:
    """Fit the methods to a flight that is made up, and have them estimate, as they are and as they come from files."""
    flight = _flight()
    with one_blas_thread(), TemporaryDirectory() as folder:
        for name in METHODS:
            create(name).fit_rows(training_rows([flight])).save(folder)
            load(folder).interference(flight.blind())


def _flight() -> Recording:
    """Return a flight along four headings with waves of roll, pitch and yaw, in the main field."""
    time_s = np.arange(ROWS) / 10.0
    rng = np.random.default_rng(0)
    heading = 90.0 * np.floor(4.0 * time_s / time_s[-1])
    waves = [np.sin(2.0 * np.pi * time_s / period) for period in (6.1, 7.3, 8.9)]
    attitude = np.stack([10.0 * waves[0], 5.0 * waves[1], heading + 5.0 * waves[2]], axis=1)
    lat, lon, alt = 45.0 + 1e-4 * time_s, 10.0 + 1e-4 * time_s, 1000.0 + waves[0]
    years = decimal_years(np.datetime64(START[:19]).astype(object), time_s)
    field_n = igrf(np.radians(lat), np.radians(lon), alt, years)
    earth = rotate_back(rot_nb_from_attitude(np.radians(attitude)), field_n)
    platform = np.array([50.0, -30.0, 80.0]) + earth @ np.diag([3e-3, 2e-3, 1e-3])
    clean, total = np.linalg.norm(earth, axis=1), np.linalg.norm(earth + platform, axis=1)
    flux = earth + platform + rng.standard_normal((ROWS, 3))
    data = {"mag_a_nt": total + 0.01 * rng.standard_normal(ROWS), "interference_a_nt": total - clean}
    data |= {f"flux_a_{axis}_nt": flux[:, i] for i, axis in enumerate("xyz")}
    data |= {f"ins_{angle}_deg": attitude[:, i] for i, angle in enumerate(("roll", "pitch", "heading"))}
    data |= {"ins_lat_deg": lat, "ins_lon_deg": lon, "ins_alt_m": alt}
    return Recording("made_up", time_s, data, {"start_utc": START, "rate_hz": 10.0})

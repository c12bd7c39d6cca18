"""A recording with something in every role, and metadata of every type."""

import numpy as np

from magsim import columns
from magsim.recording import Recording

N = 200
META = {
    "start_utc": "2025-03-13T02:00:00+00:00",
    "seed": 2**63 - 1,
    "rate_hz": 10,
    "simulation_rate_hz": 120.0,
    "digest": "00ff",
    "scenario_text": "# Grüße\nschema = 1\n",
    "overrides": ["seed=3"],
    "maneuvers": [{"axis": "pitch", "asked_deg": 5.0, "off_axis_deg": [0.1, 0.2]}],
    "notes": {"integrator": "AB5", "gains": {"pitch": 1.25}, "exact": True, "none": None},
    "title": "",
}


def make(name: str = "box", meta: dict | None = None) -> Recording:
    time_s = np.arange(N) * 0.1
    rng = np.random.default_rng(4)
    data = {
        "circuit": np.ones(N),
        "split": np.repeat([0.0, 1.0, 2.0, 2.0], N // 4),
        "mag_cabin_nt": 45_000.0 + rng.normal(size=N),
        **{f"flux_flux_{axis}_nt": rng.normal(size=N) * 1e4 for axis in "xyz"},
        "ins_roll_deg": rng.normal(size=N),
        "interference_cabin_nt": rng.normal(size=N),
        **{
            columns.PART.name(component=component, sensor="cabin", axis=axis): rng.normal(size=N)
            for component in columns.COMPONENTS
            for axis in "xyz"
        },
    }
    return Recording(name, time_s, data, META if meta is None else meta)

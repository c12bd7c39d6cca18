"""A flight and a field made by hand, and the scenario that records them."""

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np

from magsim.aircraft import load_aircraft
from magsim.loading import LoadedScenario
from magsim.scenario import Scenario
from magsim.trajectory import Flight, ManeuverFlown, Segment, Trajectory
from magsim.truth import FieldTruth

SCALARS = [{"name": "cabin", "mount": "cabin_center"}, {"name": "tail", "mount": "stinger"}]
FLUX = [{"name": "flux", "mount": "cabin_rear", "offset_nt": (10.0, 0.0, 0.0)}]
INS = {"attitude_drift_deg": 0.01, "attitude_noise_deg": 0.001, "position_drift_m": 1.0}


def loaded(scalars=SCALARS, seed=5, sensors=None, **recording):
    table = {
        "schema": 1,
        "seed": seed,
        "aircraft": "toy",
        "start": {"lat_deg": 16.7, "lon_deg": 112.7, "alt_m": 3000.0, "speed_mps": 75.0},
        "pattern": {"kind": "box"},
        "sensors": {"scalar": scalars, "fluxgate": FLUX, "ins": INS} | (sensors or {}),
        "recording": {"valid_legs": (2,)} | recording,
    }
    table["start"]["time_utc"] = datetime(2025, 3, 13, 2, tzinfo=UTC)
    toy = replace(load_aircraft("uav"), name="toy")
    return LoadedScenario("toy_box", Scenario.model_validate(table), toy, "schema = 1\n", ("seed=5",))


def flight(duration_s=40.0):
    t = np.arange(-90, round(duration_s * 30) + 91) / 30.0
    zero = np.zeros(len(t))
    attitude = np.stack([0.1 * np.sin(t), 0.05 * np.sin(0.7 * t), -0.2 + 0.01 * t], axis=1)
    velocity = np.stack([75.0 + zero, zero, zero], axis=1)
    carrier = Trajectory(t, 0.29 + 1e-5 * t, 1.96 + zero, 3000.0 + zero, velocity, attitude, 0.01 * attitude)
    segments = (
        Segment(1, 1, False, 0.0, 0.0, 8.0, 600.0),
        Segment(1, 1, True, 0.0, 8.0, 10.0, 150.0),
        Segment(1, 2, False, 90.0, 10.0, 20.0, 750.0),
        Segment(2, 1, False, 180.0, 20.0, 40.0, 1500.0),
    )
    flown = (ManeuverFlown("roll", 1, 1, 2.0, 6.0, 2.0, 2, 5.0, 4.9, 0.1, (0.0, 0.2)),)
    controls = {"elevator": 0.02 * np.sin(t), "rudder": 0.01 + zero}
    return Flight(carrier, duration_s, 120.0, controls, segments, flown, {"integrator": "rk4"})


def truth(duration_s=40.0):
    t = np.arange(-360, round(duration_s * 120) + 361) / 120.0
    mounts = ("stinger", "cabin_center", "cabin_rear")
    wave = np.sin(t)[:, None, None] * np.ones((1, 3, 3))
    return FieldTruth(
        t,
        mounts,
        {
            "earth": np.array([30e3, 5e3, 30e3]) + 1e3 * wave,
            "permanent": np.arange(9.0).reshape(1, 3, 3) + 0.0 * wave,
            "hinged": 0.1 * wave,
            "induced": 2.0 * wave,
            "eddy": 0.3 * np.cos(t)[:, None, None] + 0.0 * wave,
        },
    )

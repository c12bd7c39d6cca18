"""A synthetic aircraft in the real main field, with an INS and a fluxgate that is far from perfect; plain numpy.

The motion is that of ``tests.support.worlds``. The field is IGRF-14 at the aircraft plus an offset, the fluxgate sees a
matrix and an offset of it, late, with a current and a deflection on top.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.interpolate import CubicSpline

from magsim.earth import decimal_years, igrf
from magsim.frames import rot_nb_from_attitude, rotate_back
from magsim.recording import Recording
from magsim.streams import stream
from tests.support.worlds import calibration

START = "2025-03-13T00:00:00+00:00"
MATRIX = np.array([[1.012, 0.021, -0.013], [-0.017, 0.991, 0.024], [0.011, -0.019, 1.006]])
HARD_NT = np.array([310.0, -220.0, 140.0])
PER_AMPERE_NT = np.array([1.5, -2.0, 0.8])
PER_DEGREE_NT = np.array([0.4, 0.1, -0.3])
PERMANENT_NT = np.array([-360.0, 245.0, 490.0])
INDUCED = np.array([[9.0, -1.5, 2.5], [-0.8, -6.0, 1.2], [1.9, 0.9, 5.0]]) * 1e-3
EDDY_S = np.array([[1.2, -0.4, 0.6], [0.3, 1.9, -0.5], [-0.5, 0.4, 1.5]]) * 1e-3
CURRENT_NT = np.array([0.6, -0.4, 1.1])
SURFACE_NT = np.array([0.05, 0.02, -0.04])


@dataclass(frozen=True)
class Inertial:
    """What of the instruments is imperfect."""

    flux_noise_nt: float = 0.1
    mag_noise_nt: float = 0.01
    attitude_noise_deg: float = 0.002
    lag_s: float = 0.15
    offset_n: tuple[float, float, float] = (0.0, 0.0, 0.0)
    heading_error_deg: float = 0.0


@cache
def flown(world: Inertial = Inertial(), seed: int = 0, name: str = "inertial") -> Recording:
    """Two square circuits; truth under ``earth_cabin_*``, ``clean_cabin_nt`` and the label."""
    base = calibration(seed=seed)
    time_s = base.time_s
    angles = base.stack(["ins_roll_deg", "ins_pitch_deg", "ins_heading_deg"])
    rot = rot_nb_from_attitude(np.radians(angles))
    lat, lon, alt = base["ins_lat_deg"], base["ins_lon_deg"], base["ins_alt_m"]
    years = decimal_years(np.datetime64(START[:19]).astype(object), time_s)
    field_n = igrf(np.radians(lat), np.radians(lon), alt, years) + np.array(world.offset_n)
    earth = rotate_back(rot, field_n)
    rng = stream(seed, "inertial")
    # a load that is switched every half minute, and a surface that moves with the roll rate
    current = np.where(np.floor(time_s / 31.0) % 2 == 1, 6.0, 0.0)
    surface = 4.0 * np.gradient(angles[:, 0], time_s) / 10.0
    rate = CubicSpline(time_s, earth)(time_s, 1)
    platform = PERMANENT_NT + earth @ INDUCED.T + rate @ EDDY_S.T
    platform = platform + current[:, None] * CURRENT_NT + surface[:, None] * SURFACE_NT
    clean, total = np.linalg.norm(earth, axis=1), np.linalg.norm(earth + platform, axis=1)
    seen = earth @ MATRIX.T + HARD_NT + current[:, None] * PER_AMPERE_NT + surface[:, None] * PER_DEGREE_NT
    late = CubicSpline(time_s, seen)(time_s - world.lag_s)
    late = late + world.flux_noise_nt * rng.standard_normal(late.shape)
    noise = world.attitude_noise_deg * rng.standard_normal(angles.shape)
    ins = angles + noise + np.array([0.0, 0.0, world.heading_error_deg])
    data = {"mag_cabin_nt": total + world.mag_noise_nt * rng.standard_normal(len(time_s))}
    data |= {f"flux_nose_{axis}_nt": late[:, i] for i, axis in enumerate("xyz")}
    data |= {"ins_roll_deg": ins[:, 0], "ins_pitch_deg": ins[:, 1], "ins_heading_deg": ins[:, 2] % 360.0}
    data |= {"ins_lat_deg": lat, "ins_lon_deg": lon, "ins_alt_m": alt}
    data |= {"cur_pump_a": current + 0.004 * rng.standard_normal(len(time_s)), "surface_aileron_deg": surface}
    data |= {"interference_cabin_nt": total - clean, "clean_cabin_nt": clean}
    data |= {f"earth_cabin_{axis}_nt": earth[:, i] for i, axis in enumerate("xyz")}
    data |= {name: base[name] for name in ("circuit", "leg", "turn", "leg_heading_deg", "maneuver", "cycle", "split")}
    return Recording(name, time_s, data, {"start_utc": START, "rate_hz": 10.0})

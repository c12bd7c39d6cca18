"""A small recording with something in every role."""

import numpy as np
import pytest

from magsim.recording import Recording


@pytest.fixture
def recording() -> Recording:
    """One minute over midnight near Ottawa, with two magnetometers, a fluxgate, a base station and currents."""
    n = 600
    time_s = np.arange(n) / 10.0
    rng = np.random.default_rng(5)
    east = 70.0 * time_s
    data = {
        "mag_cabin_nt": 53_600.0 + 30.0 * np.sin(time_s) + rng.normal(size=n),
        "mag_tail_nt": 53_500.0 + rng.normal(size=n),
        "mag_m1_nt": 53_400.0 + rng.normal(size=n),
        "mag_cabin_valid": np.where(time_s % 7.0 < 0.3, 0.0, 1.0),
        "flux_nose_x_nt": 17_000.0 + rng.normal(size=n),
        "flux_nose_y_nt": -1_000.0 + rng.normal(size=n),
        "flux_nose_z_nt": 50_000.0 + rng.normal(size=n),
        "ins_roll_deg": 10.0 * np.sin(time_s),
        "ins_pitch_deg": 2.0 + np.cos(time_s),
        "ins_heading_deg": np.full(n, 90.0),
        "ins_lat_deg": np.full(n, 45.3),
        "ins_lon_deg": -75.5 + np.degrees(east / 4.5e6),
        "ins_vn_mps": rng.normal(size=n),
        "ins_ve_mps": 70.0 + rng.normal(size=n),
        "ins_vd_mps": rng.normal(size=n),
        "ins_alt_m": 400.0 + rng.normal(size=n),
        "ins_acc_x_mps2": 0.3 + 0.1 * rng.normal(size=n),
        "ins_acc_y_mps2": 0.1 * rng.normal(size=n),
        "ins_acc_z_mps2": -9.8 + 0.1 * rng.normal(size=n),
        "ins_rate_x_dps": 10.0 * np.cos(time_s),
        "ins_rate_y_dps": -np.sin(time_s),
        "ins_rate_z_dps": 0.004 + 0.001 * rng.normal(size=n),
        "baro_alt_m": 370.0 + rng.normal(size=n),
        "baro_pa": 96_950.0 + 12.0 * rng.normal(size=n),
        "radar_alt_m": np.where(time_s < 5.0, -1.0, 300.0),
        "base_hut_nt": 53_000.0 + np.cos(time_s / 20.0),
        "cur_strobe_a": np.where(time_s % 1.0 < 0.1, 4.0, 0.0),
        "surface_rudder_deg": rng.normal(size=n),
        "interference_m1_nt": 20.0 * np.sin(time_s),
        "clean_m1_nt": 53_380.0 + rng.normal(size=n),
        "fluxerror_nose_x_nt": 30.0 + rng.normal(size=n),
        "true_inertial_rate_x_dps": 10.0 * np.cos(time_s),
        "true_acc_z_mps2": np.full(n, -9.80665),
        "true_pressure_pa": np.full(n, 96_948.25),
        "true_cabin_c": 25.0 - 5.0 * np.exp(-time_s / 20.0),
        "true_lat_deg": np.full(n, 45.30001),
        "true_lon_deg": -75.50001 + np.degrees(east / 4.5e6),
        "true_alt_m": np.full(n, 401.0),
        "circuit": np.where(time_s < 30.0, 1.0, 2.0),
        "leg": 1.0 + np.floor(time_s / 20.0),
        "split": np.where(time_s < 30.0, 0.0, 2.0),
    }
    return Recording("two boxes", time_s, data, {"start_utc": "2025-03-13T23:59:30+00:00", "rate_hz": 10})

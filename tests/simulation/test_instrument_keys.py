"""Every key of every instrument does something, and to its own columns alone.

A key that is added to a table of ``[sensors]`` has to be added here too.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from magsim import scenario
from magsim.simulation import record
from magsim.terrain import Flat, Ground
from tests.support.measured import flight, loaded, truth

SCALAR = {
    "name": "cabin",
    "mount": "cabin_center",
    "noise_nt_rthz": 0.01,
    "axis_b": (1.0, 0.1, 0.0),  # 44.72 to 44.77 degrees from the field
    "heading_cos_nt": 0.1,
    "heading_cos2_nt": 0.1,
    "heading_switch_nt": 0.1,
    "gyro_shift": 1.0,
    "lag_s": 0.1,
    "counter_s": 0.1,
    "step_nt": 0.01,
    "dead_polar_deg": 44.75,
    "dead_equator_deg": 10.0,
    "relock_s": 0.5,
    "range_nt": (20e3, 44e3),
}
FLUXGATE = {
    "name": "flux",
    "mount": "cabin_rear",
    "noise_nt_rthz": 0.02,
    "offset_drift_nt_c": (1.0, 1.0, 1.0),
    "bandwidth_hz": 20.0,
    "range_nt": 60e3,
    "step_nt": 0.05,
}
INS = {
    "heading_coupling": (0.001, 0.0, 0.0),
    "attitude_drift_deg": 0.1,
    "attitude_noise_deg": 0.01,
    "acc_drift_mps2": 0.01,
    "rate_drift_dps": 0.01,
}
TABLES = {
    "ins": INS,
    "cabin": {"start_c": 10.0, "settled_c": 30.0, "wander_c": 0.5},
    "barometer": {"drift_pa": 20.0},
    "radar": {"max_range_m": 4000.0},
    "base": {},
    "electrical": {},
    "surfaces": {},
}

DURATION_S = 16.0
"""Two and a half periods of the field's wave."""

CLOCK = {"skew_s": 0.05, "jitter_s": 0.01, "drift_ppm": 150.0}
SCALAR_CHANGES = CLOCK | {
    "noise_nt_rthz": 0.02,
    "axis_b": (1.0, 0.2, 0.0),
    "heading_cos_nt": 0.3,
    "heading_cos2_nt": 0.3,
    "heading_switch_nt": 0.3,
    "gyro_shift": -1.0,
    "lag_s": 0.2,
    "flicker_nt_rthz": 0.01,
    "tones": ({"frequency_hz": 398.0, "amplitude_nt": 50.0},),
    "counter_s": 0.2,
    "counter_tag": "end",
    "step_nt": 0.1,
    "dead_polar_deg": 44.74,
    "dead_equator_deg": 44.6,
    "relock_s": 1.5,
    "range_nt": (42.5e3, 44e3),
}
BESIDE = {"dead_equator_deg": {"axis_b": (1.0, 0.0, 0.0)}}
"""What else a key needs: here, the field 45.27 to 45.53 degrees from the axis."""

FLUXGATE_CHANGES = CLOCK | {
    "noise_nt_rthz": 0.05,
    "flicker_nt_rthz": 0.02,
    "flexure_deg_g": (0.0, 0.2, 0.0),
    "offset_nt": (1.0, 0.0, 0.0),
    "scale_error": (0.001, 0.0, 0.0),
    "nonorthogonality_deg": (0.0, 0.1, 0.0),
    "misalignment_deg": (0.1, 0.0, 0.0),
    "cross_field_nt": (5.0, 0.0, 0.0),
    "offset_drift_nt_c": (2.0, 0.0, 0.0),
    "scale_drift_ppm_c": (10.0, 0.0, 0.0),
    "reference_c": 25.0,
    "bandwidth_hz": 2.0,
    "range_nt": 30e3,
    "step_nt": 1.0,
}
ACC, RATE, MOVED = ("ins_acc_",), ("ins_rate_",), ("ins_",)
INS_CHANGES = {
    **dict.fromkeys(CLOCK, MOVED),
    "attitude_bias_deg": ("ins_roll", "ins_pitch", "ins_heading"),
    "attitude_drift_deg": ("ins_roll", "ins_pitch", "ins_heading"),
    "attitude_noise_deg": ("ins_roll", "ins_pitch", "ins_heading"),
    "heading_factor": ("ins_heading",),
    "heading_coupling": ("ins_heading",),
    "heading_recovery_s": ("ins_heading",),
    "position_m": ("ins_",),
    # its local axes too, by 1e-8 rad: those of the place where it takes itself to be
    "lever_error_m": ("ins_lat", "ins_lon", "ins_alt", "ins_v", "ins_roll", "ins_pitch", "ins_heading"),
    "position_drift_m": ("ins_lat", "ins_lon", "ins_alt"),
    "position_noise_m": ("ins_lat", "ins_lon", "ins_alt"),
    "velocity_drift_mps": ("ins_v",),
    "velocity_noise_mps": ("ins_v",),
    "correlation_s": ("ins_roll", "ins_pitch", "ins_heading"),
} | {
    f"{kind}_{key}": columns
    for kind, columns, unit in (("acc", ACC, "mps2"), ("rate", RATE, "dps"))
    for key in (
        f"bias_{unit}", "scale_error", f"drift_{unit}", "correlation_s", f"noise_{unit}_rthz", f"step_{unit}"
    )
}  # fmt: skip
VALUES = CLOCK | {"attitude_bias_deg": (0.1, 0.1, 0.1), "heading_factor": 3.0, "correlation_s": 20.0}
VALUES |= {"acc_bias_mps2": (0.1, 0.0, 0.0), "rate_bias_dps": (0.1, 0.0, 0.0), "qnh_pa": 102e3, "setting_pa": 102e3}
VALUES |= {"acc_scale_error": (0.01, 0.0, 0.0), "rate_scale_error": (0.01, 0.0, 0.0), "acc_correlation_s": 20.0}
VALUES |= {"rate_correlation_s": 20.0, "start_c": 15.0, "settled_c": 40.0, "warmup_s": 100.0, "wander_s": 30.0}
VALUES |= {"position_m": (1.0, 2.0, 3.0), "lever_error_m": (0.3, 0.2, 0.1), "heading_coupling": (0.0, 0.0, 0.002)}
VALUES |= {"max_range_m": 1000.0, "max_tilt_deg": 3.0, "noise_m": 2.0, "rate_hz": 2.0, "enabled": False}
VALUES |= {"current_step_a": 1.0, "voltage_step_v": 1.0, "height_m": 900.0}
VALUES |= {"electrical.without": ("pump",), "surfaces.without": ("elevator",), "surfaces.offset_deg": 1.0}
"""What a key is set to, with its table where it means another thing in each; 0.3 where it is not named."""

BARO = ("baro_",)
CHANGES = {
    "ins": INS_CHANGES,
    "cabin": dict.fromkeys(("start_c", "settled_c", "warmup_s", "wander_c", "wander_s"), ("true_cabin_c", "flux")),
    "barometer": {
        **dict.fromkeys(CLOCK, BARO),
        "qnh_pa": ("baro_", "true_pressure_pa"),
        "setting_pa": ("baro_alt_m",),
        **dict.fromkeys(("offset_pa", "drift_pa", "correlation_s", "noise_pa_rthz", "lag_s", "step_pa"), BARO),
    },
    "radar": dict.fromkeys((*CLOCK, "noise_m", "noise_relative", "max_range_m", "max_tilt_deg"), ("radar_alt_m",)),
    "base": {
        **dict.fromkeys(("noise_nt_rthz", "rate_hz", "delay_s", "jitter_s", "drift_ppm"), ("base_",)),
        "height_m": ("base_", "true_base_"),
    },
    "electrical": {
        **dict.fromkeys((*CLOCK, "enabled"), ("cur_", "vol_")),
        "without": ("cur_pump_a",),
        **dict.fromkeys(("current_noise_a_rthz", "current_offset_a", "current_step_a"), ("cur_",)),
        **dict.fromkeys(("voltage_noise_v_rthz", "voltage_offset_v", "voltage_step_v"), ("vol_",)),
    },
    "surfaces": {
        **dict.fromkeys((*CLOCK, "enabled"), ("surface_elevator_deg", "surface_rudder_deg")),
        "without": ("surface_elevator_deg",),
        **dict.fromkeys(("noise_deg_rthz", "offset_deg", "scale_error", "step_deg"), ("surface_",)),
        **dict.fromkeys(("backlash_deg", "lag_s"), ("surface_elevator_deg",)),  # the rudder rests
    },
}

MODELS = {
    "scalar": (scenario.ScalarSensor, SCALAR_CHANGES),
    "fluxgate": (scenario.FluxgateSensor, FLUXGATE_CHANGES),
    "ins": (scenario.Ins, INS_CHANGES),
    "cabin": (scenario.Cabin, CHANGES["cabin"]),
    "barometer": (scenario.Barometer, CHANGES["barometer"]),
    "radar": (scenario.Radar, CHANGES["radar"]),
    "base": (scenario.BaseStation, CHANGES["base"]),
    "electrical": (scenario.Electrical, CHANGES["electrical"]),
    "surfaces": (scenario.Surfaces, CHANGES["surfaces"]),
}
NO_ERRORS = {"name", "mount", "body", "preset", "lat_deg", "lon_deg", "north_m", "east_m", "refit"}
"""Keys that bring no error of their own; a refit turns what the population sets, before anything is simulated."""


@cache
def world():
    """Flight, field with a feeder and a bus, and ground."""
    field = truth(DURATION_S)
    t = field.time_s
    electric = {"currents_a": {"pump": 3.0 + np.sin(t)}, "voltages_v": {"main": 28.0 + 0.3 * np.sin(t)}}
    return flight(DURATION_S), replace(field, **electric), Ground(Flat(100.0), 0.0)


def recorded(*, scalar=None, fluxgate=None, **tables):
    sensors = {name: table | tables.get(name, {}) for name, table in TABLES.items()}
    sensors["fluxgate"] = [FLUXGATE | (fluxgate or {})]
    flown, field, ground = world()
    radar = scenario.Radar(**sensors.pop("radar"))
    whole = loaded([SCALAR | (scalar or {}), {"name": "tail", "mount": "stinger"}], sensors=sensors)
    # A scenario with a radar would ask for terrain.
    with_radar = whole.scenario.sensors.model_copy(update={"radar": radar})
    flying = whole.scenario.model_copy(update={"sensors": with_radar})
    return record(replace(whole, ground=ground, scenario=flying), flown, {"carrier": field}).data


@cache
def plain():
    return recorded()


def changed(other, before=None):
    before = plain() if before is None else before
    names = set(before) ^ set(other)
    return names | {n for n in set(before) & set(other) if not np.array_equal(before[n], other[n])}


@pytest.mark.parametrize("kind", MODELS)
def test_all_keys_are_here(kind):
    model, changes = MODELS[kind]
    assert set(changes) == set(model.model_fields) - NO_ERRORS


@pytest.mark.parametrize("key", SCALAR_CHANGES)
def test_of_a_scalar_magnetometer(key):
    beside = BESIDE.get(key, {})
    found = changed(recorded(scalar=beside | {key: SCALAR_CHANGES[key]}), recorded(scalar=beside))
    assert "error_cabin_nt" in found
    # Its counter is the window of its labels and truth too; everything else is the reading's.
    assert all("_cabin_" in name for name in found)
    if key != "counter_s":
        assert found <= {"mag_cabin_nt", "error_cabin_nt", "mag_cabin_valid"}


@pytest.mark.parametrize("key", FLUXGATE_CHANGES)
def test_of_a_fluxgate(key):
    found = changed(recorded(fluxgate={key: FLUXGATE_CHANGES[key]}))
    assert found
    assert all(name.startswith(("flux_flux_", "fluxerror_flux_")) for name in found)
    assert {name.replace("fluxerror", "flux") for name in found if name.startswith("fluxerror")} == {
        name for name in found if name.startswith("flux_")
    }


@pytest.mark.parametrize(("table", "key"), [(table, key) for table, keys in CHANGES.items() for key in keys])
def test_of_the_others(table, key):
    value = VALUES.get(f"{table}.{key}", VALUES.get(key, 0.3))
    found = changed(recorded(**{table: {key: value}}))
    allowed = CHANGES[table][key]
    assert all(name.startswith(allowed) for name in found)
    for prefix in allowed:
        assert any(name.startswith(prefix) for name in found), prefix

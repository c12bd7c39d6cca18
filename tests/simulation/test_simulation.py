"""How flight, field and sensors meet: with a flight and a field made by hand, then with the real ones."""

import json
from dataclasses import replace

import numpy as np
import pytest

import magsim
from magsim import columns
from magsim.errors import DataError
from magsim.loading import load_scenario
from magsim.simulation import record, simulate
from magsim.truth import FieldTruth
from tests.support.measured import FLUX, INS, SCALARS, flight, loaded, truth


@pytest.fixture(scope="module")
def recording():
    return record(loaded(), flight(), {"carrier": truth()})


def test_columns_stand_in_the_order_of_the_table(recording):
    places = [columns.FAMILIES.index(columns.find(name)) for name in recording.data]
    assert places == sorted(places)
    assert len(recording) == 401
    np.testing.assert_array_equal(recording.time_s, np.arange(401) / 10)
    # 2 scalars with 6 columns and 15 parts, a fluxgate with 6 and 15, 15 of the INS, 18 true, 2 surfaces
    # and their truth, 8 segments.
    assert len(recording.data) == 2 * 21 + 21 + 15 + 18 + 2 * 2 + 8
    assert recording.scalars == ("cabin", "tail")
    assert recording.fluxgates == ("flux",)


def test_each_sensor_sits_at_its_mount(recording):
    np.testing.assert_allclose(recording["permanent_tail_x_nt"], 0.0, atol=1e-9)
    np.testing.assert_allclose(recording["permanent_cabin_y_nt"], 4.0)
    np.testing.assert_allclose(recording["permanent_flux_z_nt"], 8.0)


def test_motion_and_surfaces_are_those_of_the_flight(recording):
    t = recording.time_s
    np.testing.assert_allclose(recording["true_roll_deg"], np.degrees(0.1 * np.sin(t)), atol=1e-5)
    np.testing.assert_allclose(recording["true_heading_deg"], np.degrees(-0.2 + 0.01 * t) % 360.0, atol=1e-9)
    np.testing.assert_allclose(recording["true_surface_elevator_deg"], np.degrees(0.02 * np.sin(t)), atol=1e-4)
    assert 0.0 < np.abs(recording["surface_elevator_deg"] - recording["true_surface_elevator_deg"]).max() < 2.0
    assert 0.0 < np.abs(recording["ins_roll_deg"] - recording["true_roll_deg"]).max() < 0.1


def test_the_wind_is_recorded_where_it_is_known(recording):
    assert not any("wind" in name for name in recording.data)
    quiet = flight()
    time = quiet.carrier.time_s
    air = replace(quiet, wind_n=np.stack([3.0 + 0.1 * time, -2.0 + 0.0 * time, 0.5 * np.sin(time)], axis=1))
    blown = record(loaded(), air, {"carrier": truth()})
    np.testing.assert_allclose(blown["true_wind_n_mps"], 3.0 + 0.1 * blown.time_s, atol=1e-12)
    np.testing.assert_allclose(blown["true_wind_e_mps"], -2.0)
    np.testing.assert_allclose(blown["true_wind_d_mps"], 0.5 * np.sin(blown.time_s), atol=1e-12)
    assert {columns.role_of(f"true_wind_{axis}_mps") for axis in "ned"} == {"truth"}
    # Nothing else changes, and a compensator does not see it.
    assert {name for name in blown.data if "wind" not in name} == set(recording.data)
    assert not any("wind" in name for name in blown.labeled().data)
    with pytest.raises(ValueError, match="wind_n has shape"):
        replace(quiet, wind_n=np.zeros((3, 3)))


def test_segments_and_split(recording):
    t = recording.time_s
    # A turn belongs to the leg before it; leg 2 of the training circuit is for validation; circuit 2 is the test.
    wanted = np.select([t < 10.0, t < 20.0], [0.0, 1.0], 2.0)
    np.testing.assert_array_equal(recording["split"], wanted)
    np.testing.assert_array_equal(recording["turn"], (t >= 8.0) & (t < 10.0))
    np.testing.assert_array_equal(recording["maneuver"], np.where((t >= 2.0) & (t < 6.0), 2, 0))
    assert recording["cycle"].max() == 2


def test_the_magnetometer_says_total_plus_error(recording):
    for name in recording.scalars:
        np.testing.assert_allclose(
            recording[f"mag_{name}_nt"], recording[f"total_{name}_nt"] + recording[f"error_{name}_nt"], atol=1e-9
        )
        np.testing.assert_allclose(
            recording[f"interference_{name}_nt"], recording[f"total_{name}_nt"] - recording[f"clean_{name}_nt"]
        )


def test_provenance_is_plain_and_complete(recording):
    meta = recording.meta
    assert json.loads(json.dumps(meta)) == meta
    assert meta["schema"] == 1
    assert meta["version"] == magsim.__version__
    assert meta["scenario"] == recording.name == "toy_box"
    assert meta["scenario_text"] == "schema = 1\n"
    assert meta["overrides"] == ["seed=5"]
    assert meta["digest"] == loaded().digest
    assert meta["start_utc"] == "2025-03-13T02:00:00+00:00"
    assert (meta["seed"], meta["rate_hz"], meta["simulation_rate_hz"]) == (5, 10, 120.0)
    assert "263 taps" in meta["filter"]
    assert meta["maneuvers"][0]["flown_deg"] == 4.9
    assert meta["notes"] == {"integrator": "rk4"}


def test_same_again(recording):
    again = record(loaded(), flight(), {"carrier": truth()})
    for name, column in recording.data.items():
        np.testing.assert_array_equal(again[name], column, err_msg=name)


def test_another_sensor_changes_no_other_column(recording):
    more = record(loaded([{"name": "extra", "mount": "stinger"}, *SCALARS]), flight(), {"carrier": truth()})
    for name, column in recording.data.items():
        np.testing.assert_array_equal(more[name], column, err_msg=name)


def test_an_ins_that_is_late_says_what_was(recording):
    late = record(loaded(sensors={"ins": INS | {"skew_s": 0.1}}), flight(), {"carrier": truth()})
    for name in recording.data:
        if not name.startswith("ins"):
            np.testing.assert_array_equal(late[name], recording[name], err_msg=name)
    for name in ("acc_x_mps2", "rate_y_dps"):
        true = recording[f"true_{name}" if "acc" in name else f"true_inertial_{name}"]
        np.testing.assert_allclose(late[f"ins_{name}"][1:], true[:-1], rtol=0, atol=1e-5)
    # One row late; the errors of the rows are the same as without.
    error = recording["ins_roll_deg"] - recording["true_roll_deg"]
    np.testing.assert_allclose((late["ins_roll_deg"] - error)[1:], recording["true_roll_deg"][:-1], rtol=0, atol=1e-9)


def test_errors_of_one_instrument_change_no_other(recording):
    worn = {"preset": "cs_vapor", "axis_b": (1.0, 0.0, 1.0), "gyro_shift": 1.0, "jitter_s": 0.001}
    warm = {"cabin": {"settled_c": 40.0}, "fluxgate": [FLUX[0] | {"offset_drift_nt_c": (1.0, 0.0, 0.0)}]}
    other = record(loaded([SCALARS[0] | worn, SCALARS[1]], sensors=warm), flight(), {"carrier": truth()})
    changed = {name for name in recording.data if not np.array_equal(recording[name], other[name])}
    cabin = {name for name in recording.data if "_cabin_" in name}
    assert "mag_cabin_nt" in changed
    assert changed <= cabin | {"flux_flux_x_nt", "fluxerror_flux_x_nt"}
    assert set(other.data) - set(recording.data) == {"mag_cabin_valid", "true_cabin_c"}
    rise = other["flux_flux_x_nt"] - recording["flux_flux_x_nt"]
    np.testing.assert_allclose(rise, other["true_cabin_c"] - 20.0, rtol=0, atol=1e-8)
    assert other.meta["counters"]["cabin"].startswith("mean over 0.1 s")
    assert "counters" not in recording.meta


def test_another_seed_changes_instruments_alone(recording):
    other = record(loaded(seed=6), flight(), {"carrier": truth()})
    changed = {name for name in recording.data if not np.array_equal(recording[name], other[name])}
    still = ("ins_v", "ins_acc", "ins_rate")
    assert changed == {n for n in recording.names("input") if not n.startswith(still)} | {
        "error_cabin_nt",
        "error_tail_nt",
        *(f"fluxerror_flux_{axis}_nt" for axis in "xyz"),
    }


@pytest.mark.parametrize("rate", [5, 20])
def test_other_rates(rate):
    other = record(loaded(rate_hz=rate), flight(30.0), {"carrier": truth(30.0)})
    assert len(other) == 30 * rate + 1
    assert other.rate_hz == pytest.approx(rate)


def test_a_value_that_is_not_finite_is_reported():
    broken = truth()
    induced = np.array(broken.parts_b["induced"])
    induced[360 + 1200 :, 1, 2] = np.nan
    bad = FieldTruth(broken.time_s, broken.mounts, {**broken.parts_b, "induced": induced})
    with pytest.raises(DataError, match=r"toy_box: column mag_cabin_nt is not finite, first at 9 s"):
        record(loaded(), flight(), {"carrier": bad})


# The real thing: a short box, every joint of it.

SHORT = ("pattern.circuits=1", "pattern.leg_m=2000.0", "pattern.lead_s=5.0", "pattern.maneuvers=[]", "seed=3")
SETTINGS = {"pattern.circuits": 1, "pattern.leg_m": 2000.0, "pattern.lead_s": 5.0, "pattern.maneuvers": []}


@pytest.fixture(scope="module")
def flown():
    steps = []
    whole = simulate(load_scenario("calibration_c208b", SHORT), progress=lambda *step: steps.append(step))
    return whole, steps


def test_end_to_end(flown):
    whole, steps = flown
    assert all(np.isfinite(column).all() for column in whole.data.values())
    places = [columns.FAMILIES.index(columns.find(name)) for name in whole.data]
    assert places == sorted(places)
    assert list(dict.fromkeys(name for name, _ in steps)) == ["flight", "field", "sensors"]
    assert all(0.0 <= share <= 1.0 for _, share in steps)
    # South China Sea: 43012 nT by the model; the Earth departs from it, and the aircraft adds what it adds.
    model = np.linalg.norm(whole.vector(columns.PART, component="earth", sensor="cabin"), axis=1)
    assert np.abs(model - 43_012.0).max() < 60.0
    assert 10.0 < np.abs(whole["clean_cabin_nt"] - model).max() < 400.0
    assert 1.0 < np.std(whole["interference_cabin_nt"]) < 1000.0
    assert set(whole["leg"]) == {1.0, 2.0, 3.0, 4.0}


def test_end_to_end_label_and_projection_agree_to_second_order(flown):
    whole, _ = flown
    parts = [c for c in columns.components_of(whole.data, "cabin") if c in columns.PLATFORM]
    platform = sum(whole.vector(columns.PART, component=c, sensor="cabin") for c in parts)
    second = np.einsum("ni,ni->n", platform, platform) / (2.0 * whole["clean_cabin_nt"])
    gap = whole["interference_cabin_nt"] - whole["projection_cabin_nt"]
    assert (gap > -1e-3).all()
    assert (gap < second + 1e-2).all()


def test_end_to_end_twice_by_name_with_seed_and_settings(flown):
    """The same bits and the same provenance as with the texts that ``--set`` takes."""
    whole, _ = flown
    again = simulate("calibration_c208b", seed=3, set=SETTINGS)
    assert again.meta == whole.meta
    assert again.meta["overrides"] == list(SHORT)
    assert again.meta["seed"] == 3
    for name, column in whole.data.items():
        np.testing.assert_array_equal(again[name], column, err_msg=name)


def test_a_scenario_says_how_much_truth_is_kept():
    whole = record(loaded(), flight(), {"carrier": truth()})
    assert set(record(loaded(truth="full"), flight(), {"carrier": truth()}).data) == set(whole.data)
    parts = {name for name in whole.data if columns.find(name) is columns.PART}
    assert parts
    assert set(record(loaded(truth="sum"), flight(), {"carrier": truth()}).data) == set(whole.data) - parts
    none = record(loaded(truth="none"), flight(), {"carrier": truth()})
    assert set(none.data) == {*whole.names("input"), *whole.names("segment")}
    assert all(np.array_equal(none[name], whole[name]) for name in none.data)
    with pytest.raises(ValueError, match="truth"):
        loaded(truth="some")

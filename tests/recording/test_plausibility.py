"""What is hardly meant in a recording is told, with what would mend it."""

import numpy as np
import pytest

from magsim import assets
from magsim.field import load_response
from magsim.loading import load_scenario
from magsim.recording import Recording
from magsim.recording.plausibility import LEAST_NT, MOST_NT, warnings_of

N = 400


def recorded(inclination_deg: float, *, valid: np.ndarray | None = None, **meta: object) -> Recording:
    """A turn to all headings in a field of 50 000 nT."""
    heading, dip = np.linspace(0.0, 2.0 * np.pi, N), np.radians(inclination_deg)
    level = 5e4 * np.cos(dip)
    data = {
        "mag_cabin_nt": np.full(N, 5e4),
        "mag_cabin_valid": np.ones(N) if valid is None else valid.astype(float),
        "interference_cabin_nt": np.full(N, 30.0),
        "earth_cabin_x_nt": level * np.cos(heading),
        "earth_cabin_y_nt": -level * np.sin(heading),
        "earth_cabin_z_nt": np.full(N, 5e4 * np.sin(dip)),
    }
    zones = {"axis_b": [0.0, 0.0, 1.0], "polar_deg": 15.0, "equator_deg": 15.0, "range_nt": [20e3, 100e3]}
    return Recording("flight", np.arange(N) / 10.0, data, {"dead_zones": {"cabin": zones}} | meta)


def with_columns(recording: Recording, **columns: np.ndarray) -> Recording:
    return Recording(recording.name, recording.time_s, {**recording.data, **columns}, recording.meta)


def test_a_sound_recording_has_no_warnings():
    assert warnings_of(recorded(45.0)) == ()
    assert warnings_of(Recording("bare", np.arange(9) / 10.0, {"mag_cabin_nt": np.zeros(9)}, {})) == ()


def test_a_magnetometer_in_its_polar_dead_zone_gets_an_axis_that_reads():
    """Field 80 degrees down: 10 degrees from an axis straight down, on every heading."""
    (text,) = warnings_of(recorded(80.0, valid=np.arange(N) >= 0.8 * N))
    assert text.startswith("cabin reads on 20 % of the rows, the first 320 are 0 nT; the field is in its dead zones: ")
    # 30 degrees off, the field is 20 to 40 degrees from the axis on every heading.
    assert "axis_b = [0.50, 0.00, 0.87] would keep it out of them on 100 % of the rows instead of 0 %" in text


def test_an_equatorial_field_has_no_axis_for_all_headings():
    """Level field: straight down it is in the dead zone of the equator on every heading."""
    (text,) = warnings_of(recorded(0.0, valid=np.zeros(N, dtype=bool)))
    assert text.startswith("cabin reads on 0 % of the rows, the first 400 are 0 nT; ")
    share = float(text.split(" on ")[2].split(" %")[0])
    assert 50.0 < share < 90.0


def test_the_axis_that_is_named_reads_on_the_share_that_is_named():
    recording = recorded(80.0, valid=np.arange(N) >= 0.8 * N)
    (text,) = warnings_of(recording)
    axis = np.array([float(v) for v in text.split("axis_b = [")[1].split("]")[0].split(",")])
    field = recording.stack([f"earth_cabin_{a}_nt" for a in "xyz"])
    angle = np.degrees(np.arccos(np.abs(field @ axis) / np.linalg.norm(field, axis=1) / np.linalg.norm(axis)))
    assert np.mean((angle > 15.0) & (angle < 75.0)) == 1.0


@pytest.mark.parametrize(("share", "warns"), [(0.95, False), (0.81, False), (0.79, True), (0.2, True)])
def test_few_valid_rows_are_told(share, warns):
    valid = np.arange(N) < share * N
    assert bool(warnings_of(recorded(45.0, valid=valid))) == warns


def test_rows_before_the_first_reading_are_told():
    (text,) = warnings_of(recorded(45.0, valid=np.arange(N) >= 3))
    assert text.startswith("cabin reads on 99 % of the rows, the first 3 are 0 nT")


def test_a_field_out_of_range_is_told():
    zones = {"axis_b": [0.0, 0.0, 1.0], "polar_deg": 0.0, "equator_deg": 0.0, "range_nt": [20e3, 40e3]}
    (text,) = warnings_of(recorded(45.0, valid=np.zeros(N, dtype=bool), dead_zones={"cabin": zones}))
    assert "the field is 50000 to 50000 nT there, range_nt = [20000, 40000] leaves 100 % of the rows out" in text


def test_the_fluxgate_serves_where_there_is_no_truth():
    whole = recorded(80.0, valid=np.arange(N) >= 0.8 * N)
    flux = {f"flux_f_{a}_nt": whole[f"earth_cabin_{a}_nt"] for a in "xyz"}
    kept = {name: column for name, column in whole.data.items() if not name.startswith("earth_")}
    (text,) = warnings_of(Recording("flight", whole.time_s, kept | flux, whole.meta))
    assert "axis_b = [0.50, 0.00, 0.87]" in text
    (bare,) = warnings_of(Recording("flight", whole.time_s, kept, whole.meta))
    assert bare == "cabin reads on 20 % of the rows, the first 320 are 0 nT"
    (foreign,) = warnings_of(Recording("flight", whole.time_s, kept | flux, {"dead_zones": {"cabin": {"axis_b": "x"}}}))
    assert foreign == bare


@pytest.mark.parametrize(("level", "warns"), [(9e3, False), (1.1e4, True), (0.02, False), (0.005, True), (0.0, False)])
def test_levels_of_no_survey_aircraft_are_told(level, warns):
    recording = with_columns(recorded(45.0), interference_cabin_nt=-level * np.linspace(0.0, 1.0, N))
    texts = warnings_of(recording)
    assert bool(texts) == warns
    for text in texts:
        assert "at cabin" in text
        assert "lengths in meters" in text


def test_loads_that_are_seldom_on_are_told():
    (text,) = warnings_of(recorded(45.0, times_on={"strobe": 300, "com_1": 1, "fuel_pump": 3}))
    assert text.startswith("load com_1 is on once in training rows")
    assert "field.electronics.least_times_on = 3" in text


# ---- what is shipped --------------------------------------------------------------------------------------------


def test_shipped_flights_do_not_warn(calibration: Recording, paper_world: Recording) -> None:
    assert warnings_of(calibration) == ()
    assert warnings_of(paper_world) == ()


def test_levels_at_the_mounts_of_all_shipped_scenarios_are_plausible() -> None:
    """Permanent and induced field in 50 000 nT: what a flight shows follows from them, and is far from both limits."""
    found = {}
    for name in assets.list_scenarios():
        loaded = load_scenario(name)
        for sensor in loaded.scenario.sensors.scalar:
            vehicle = loaded.bird if sensor.body == "bird" else loaded.aircraft
            assert vehicle is not None
            response = load_response(vehicle)
            row = response.rows((sensor.mount,))[0]
            level = np.linalg.norm(response.permanent_nt[row]) + 5e4 * np.linalg.norm(response.induced[row], 2)
            found[vehicle.name, sensor.mount] = level
    assert {name for name, _ in found} >= {"c208b", "uav", "bird"}
    assert all(30.0 * LEAST_NT < level < MOST_NT / 2.0 for level in found.values()), found

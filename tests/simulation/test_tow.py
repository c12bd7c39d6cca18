"""A tow from the scenario to files: columns, bodies, labels, round trips, the same bytes, pictures, scores."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from magsim import assets, cli, columns, exchange
from magsim.aircraft import load_aircraft, load_bird
from magsim.errors import RequestError
from magsim.loading import load_scenario
from magsim.recording import Recording
from magsim.simulation import simulate
from tests.support import worlds
from tests.support.paths import ROOT
from tests.support.towed import TEXT

SCALARS = ("above", "below", "boom")
OWN = ("permanent", "hinged", "propeller", "induced", "memory", "eddy", "electronics")
"""Parts of a helicopter; a bird has nothing that turns, and its carrier's field."""


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("s.toml").write_text(TEXT)
    return tmp_path


@pytest.fixture(scope="module")
def tow(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    path = tmp_path_factory.mktemp("tow") / "tow.toml"
    path.write_text(TEXT)
    return simulate(load_scenario(path))


# ---- columns ---------------------------------------------------------------------------------------------------


def expected_columns() -> dict[str, str]:
    """Every column that the scenario has instruments for, by its role."""
    motion = [*(f"{angle}_deg" for angle in columns.INS_ANGLES), "vn_mps", "ve_mps", "vd_mps", "alt_m"]
    rates = [f"rate_{axis}_dps" for axis in "xyz"]
    carrier, bird = load_aircraft("helicopter").magnetics, load_bird("bird").magnetics
    feeders = [feeder.name for feeder in (*carrier.feeders, *bird.feeders)]
    out = dict.fromkeys([f"mag_{name}_nt" for name in SCALARS], "input")
    out |= dict.fromkeys([f"flux_{name}_{axis}_nt" for name in ("flux", "cabin") for axis in "xyz"], "input")
    out |= dict.fromkeys([f"{unit}_{name}" for unit in ("ins", "carrier") for name in motion], "input")
    out |= dict.fromkeys([f"cur_{name}_a" for name in feeders], "input")
    out |= dict.fromkeys([f"vol_{bus.name}_v" for bus in (*carrier.buses, *bird.buses)], "input")
    out |= dict.fromkeys([f"true_{name}" for name in out if name.startswith(("cur_", "vol_"))], "truth")
    out |= {"radar_alt_m": "input"}
    for axis in "xyz":
        out |= {f"ins_acc_{axis}_mps2": "input", f"ins_rate_{axis}_dps": "input"}
        out |= {f"true_acc_{axis}_mps2": "truth", f"true_inertial_rate_{axis}_dps": "truth"}
        out |= dict.fromkeys([f"fluxerror_{name}_{axis}_nt" for name in ("flux", "cabin")], "truth")
    out |= dict.fromkeys([f"{kind}_{name}_nt" for kind in ("interference", "projection") for name in SCALARS], "label")
    out |= dict.fromkeys([f"{kind}_{name}_nt" for kind in ("clean", "total", "error") for name in SCALARS], "truth")
    out |= dict.fromkeys(["swing_below_nt", "swing_boom_nt"], "truth")
    for name in (*SCALARS, "flux", "cabin"):
        above = name in {"above", "cabin"}
        own = OWN if above else (*(part for part in OWN if part != "propeller"), "carrier")
        parts = ["earth", "departure", *own]
        out |= dict.fromkeys([f"{part}_{name}_{axis}_nt" for part in parts for axis in "xyz"], "truth")
    out |= dict.fromkeys([f"true_{body}{name}" for body in ("", "carrier_") for name in [*motion, *rates]], "truth")
    out |= dict.fromkeys(["true_rope_trail_deg", "true_rope_side_deg", "true_rope_tension_n"], "truth")
    out |= dict.fromkeys(["true_msl_m", "true_agl_m", "true_ground_m"], "truth")
    out |= dict.fromkeys([f"true_wind_{axis}_mps" for axis in "ned"], "truth")
    labels = ("circuit", "leg", "turn", "transit", "leg_heading_deg", "maneuver", "cycle", "split")
    return out | dict.fromkeys(labels, "segment")


def test_columns_are_complete_with_roles_and_units(tow: Recording) -> None:
    expected = expected_columns()
    assert set(tow.data) == set(expected)
    assert {name: columns.role_of(name) for name in tow.data} == expected
    units = {"nt": "nT", "deg": "deg", "mps": "m/s", "m": "m", "dps": "deg/s", "a": "A", "v": "V", "n": "N"}
    units["mps2"] = "m/s^2"
    for name in tow.data:
        if expected[name] != "segment":
            assert columns.find(name).unit == units[name.rpartition("_")[2]], name
    places = [columns.FAMILIES.index(columns.find(name)) for name in tow.data]
    assert places == sorted(places)
    assert tow.meta["bird"] == "bird"
    assert tow.meta["notes"]["tow"]["rope_m"] == 30.0
    assert "no flight model" in tow.meta["notes"]["carrier"]


def test_what_a_compensator_sees_and_what_not(tow: Recording) -> None:
    blind = tow.blind()
    assert set(blind.data) == {name for name, role in expected_columns().items() if role == "input"}
    hidden = (
        "true_",
        "swing_",
        "clean_",
        "total_",
        "interference_",
        "projection_",
        "error_",
        "earth_",
        "carrier_below",
    )
    assert not any(name.startswith(hidden) for name in blind.data)
    assert "carrier_roll_deg" in blind.data
    assert not any(columns.role_of(name) == "truth" for name in tow.labeled().data)
    assert not {"notes", "seed", "digest", "scenario_text"} & set(blind.meta)


# ---- bodies ----------------------------------------------------------------------------------------------------


def test_the_ins_is_in_the_bird_and_the_other_one_in_the_carrier(tow: Recording) -> None:
    for angle in ("roll", "pitch", "heading"):
        for unit, truth in (("ins", "true"), ("carrier", "true_carrier")):
            off = (tow[f"{unit}_{angle}_deg"] - tow[f"{truth}_{angle}_deg"] + 180.0) % 360.0 - 180.0
            assert 0.005 < np.std(off) < (0.015 if unit == "ins" else 0.8)
    # The bird hangs 30 m under the hook, 1.1 m under the carrier, a little less for its trail.
    below = tow["true_carrier_alt_m"] - tow["true_alt_m"]
    assert 29.0 < below.mean() < 31.5
    assert np.abs(tow["ins_alt_m"] - tow["true_alt_m"]).max() < 0.2
    assert np.abs(tow["carrier_alt_m"] - tow["true_carrier_alt_m"]).max() < 0.1
    assert np.std(tow["true_roll_deg"]) > np.std(tow["true_carrier_roll_deg"])
    # Rope angles and positions agree: the line from hook to bridle.
    north = 111_194.0 * (tow["true_lat_deg"] - tow["true_carrier_lat_deg"])
    trail = np.degrees(np.arctan2(-north, below - 1.1))
    assert np.abs(trail - tow["true_rope_trail_deg"]).mean() < 0.7
    assert 700.0 < tow["true_rope_tension_n"].mean() < 900.0


def test_ground_and_radar_are_under_the_bird(tow: Recording) -> None:
    np.testing.assert_allclose(tow["true_agl_m"], tow["true_alt_m"] - 330.0, rtol=0, atol=1e-6)
    assert 0.05 < np.std(tow["radar_alt_m"] - tow["true_agl_m"]) < 0.15


def test_a_carriers_clock_is_late_by_itself(tow: Recording) -> None:
    """Its INS reads the motion of 0.05 s ago; that of the bird has no such skew."""
    late = np.interp(tow.time_s - 0.05, tow.time_s, tow["true_carrier_roll_deg"])
    rows = slice(5, None)
    assert np.std((tow["carrier_roll_deg"] - late)[rows]) < 0.6 * np.std(
        (tow["carrier_roll_deg"] - tow["true_carrier_roll_deg"])[rows]
    )


def test_labels_are_of_the_body_that_carries_the_sensor(tow: Recording) -> None:
    for name in SCALARS:
        interference = tow[f"total_{name}_nt"] - tow[f"clean_{name}_nt"]
        np.testing.assert_allclose(tow[f"interference_{name}_nt"], interference, rtol=0, atol=1e-9)
        np.testing.assert_allclose(tow[f"mag_{name}_nt"] - tow[f"error_{name}_nt"], tow[f"total_{name}_nt"], atol=1e-9)
        parts = columns.components_of(tow.data, name)
        whole = sum(tow.vector(columns.PART, component=part, sensor=name) for part in parts)
        own = sum(tow.vector(columns.PART, component=part, sensor=name) for part in parts if part in columns.PLATFORM)
        clean = np.linalg.norm(whole - own, axis=1)
        # Parts are filtered before their sum has a length, labels after: a swinging bird makes some tenths of that.
        assert np.abs(clean - tow[f"clean_{name}_nt"]).max() < 5.0
        assert np.abs(tow[f"interference_{name}_nt"] - tow[f"projection_{name}_nt"]).max() < 1.0
    assert 1.0 < np.abs(tow["interference_below_nt"]).max() < 10.0
    assert np.abs(tow["interference_above_nt"]).max() > 3.0
    assert 0.01 < np.linalg.norm(tow.vector(columns.PART, component="carrier", sensor="below"), axis=1).max() < 1.0


def test_the_swing_is_a_small_part_of_the_background(tow: Recording) -> None:
    for name in ("below", "boom"):
        swing = tow[f"swing_{name}_nt"]
        assert 1e-3 < np.std(swing) < 1.0
        assert abs(swing.mean()) < np.std(swing)
    # Without swing, the background would be smooth: what its third difference has is the swing's.
    rough = [
        np.std(np.diff(values, 3)) for values in (tow["clean_below_nt"] - tow["swing_below_nt"], tow["swing_below_nt"])
    ]
    assert rough[0] < 0.2 * rough[1]


def test_a_carrier_that_is_logged_otherwise_makes_the_same_rows(tow: Recording, here: Path) -> None:
    other = simulate(load_scenario("s.toml", ["flight.log_hz=20"]))
    assert len(other) == len(tow)
    for name in ("interference_below_nt", "clean_below_nt", "swing_below_nt", "true_roll_deg"):
        assert np.abs(other[name] - tow[name]).max() < 0.05


# ---- files -----------------------------------------------------------------------------------------------------


def test_a_recording_comes_back(tow: Recording, here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tow.write("tow.h5")
    back = Recording.read("tow.h5")
    assert back.meta == tow.meta
    assert list(back.data) == list(tow.data)
    for name, values in tow.data.items():
        np.testing.assert_array_equal(back[name], values, err_msg=name)
    assert cli.main(["verify", "tow.h5"]) == 0
    counted = f"{len(tow)} rows, {len(tow.data)} columns"
    assert re.match(rf"tow\.h5: sound; 1 flights?, {counted}, ", capsys.readouterr().out)
    assert cli.main(["info", "tow.h5"]) == 0
    output = capsys.readouterr().out
    for words in ("above, below, boom", "swing_{sensor}_nt", "true_rope_tension_n", "carrier_{angle}_deg"):
        assert words in output


@pytest.mark.parametrize("kind", exchange.FORMATS)
def test_every_format_takes_it_and_gives_it_back(
    tow: Recording, here: Path, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    tow.write("tow.h5")
    folder = here / "out"
    folder.mkdir()
    assert cli.main(["export", "tow.h5", "--format", kind, "-o", str(folder)]) == 0
    files = sorted(folder.iterdir())
    assert all(path.stat().st_size > 0 for path in files)
    if kind in {"csv", "parquet"}:
        table = pd.read_csv(files[0]) if kind == "csv" else pd.read_parquet(files[0])
        assert list(table) == ["time_s", *tow.data]
        for name in tow.data:
            np.testing.assert_array_equal(table[name].to_numpy(), tow[name], err_msg=name)
    elif kind == "mit":
        import h5py

        with h5py.File(files[0]) as file:
            np.testing.assert_array_equal(file["truth/swing_below_nt"][()], tow["swing_below_nt"])
            np.testing.assert_array_equal(file["input/carrier_roll_deg"][()], tow["carrier_roll_deg"])
            np.testing.assert_array_equal(file["ins_roll"][()], tow["ins_roll_deg"])
            np.testing.assert_array_equal(file["lat"][()], tow["true_lat_deg"])
            sensors = {name: file["sensors"][name][()].decode() for name in file["sensors"]}
        assert {sensors[name] for name in sensors if name.startswith("mag")} == set(SCALARS)
    else:
        # Text of XYZ, SGL and GDF2: the reading of the bird and what the rope does stand in the columns.
        rows = [line for line in files[0].read_text().splitlines() if re.match(r"\s*-?\d", line)]
        assert len(rows) == len(tow)
        numbers = np.array([[float(cell) for cell in line.replace("*", "nan").split()] for line in rows])
        wanted = ["mag_below_nt", "ins_roll_deg"] + (
            [] if kind == "sgl-xyz" else ["true_rope_tension_n", "swing_boom_nt"]
        )
        for name in wanted:
            off = np.abs(numbers - tow[name][:, None]).max(axis=0)
            assert np.nanmin(off) < 1e-4, name


def test_the_same_scenario_gives_the_same_bytes_on_one_thread_and_two(here: Path, tow: Recording) -> None:
    """Another process, folder, number of threads and time zone."""
    tow.write("one.h5")
    folder = here / "two"
    folder.mkdir()
    (folder / "tow.toml").write_text(TEXT)
    env = os.environ | {
        "OMP_NUM_THREADS": "2",
        "OPENBLAS_NUM_THREADS": "2",
        "TZ": "Pacific/Auckland",
        "PYTHONHASHSEED": "5",
        "PYTHONPATH": str(ROOT),
    }
    command = [sys.executable, "-m", "magsim", "generate", "tow.toml", "-q"]
    run = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, env=env)
    assert (run.returncode, run.stderr) == (0, "")
    assert (folder / "tow.h5").read_bytes() == Path("one.h5").read_bytes()


# ---- a bird of one's own ---------------------------------------------------------------------------------------


def test_a_bird_of_ones_own_lies_where_the_scenario_does(
    here: Path, monkeypatch: pytest.MonkeyPatch, tow: Recording
) -> None:
    shutil.copytree(assets.bird_dir("bird"), here / "mine")
    Path("s.toml").write_text(TEXT.replace('bird = "bird"\nsettle', 'bird = "./mine"\nsettle'))
    same = load_scenario("s.toml")
    assert (same.bird.name, same.scenario.tow.bird) == ("mine", "mine")
    assert same.bird.digest == load_bird("bird").digest
    monkeypatch.chdir(here / "mine")
    assert load_scenario("../s.toml").digest == same.digest
    # typed at the command line, a path begins in the working folder
    assert load_scenario("../s.toml", ["tow.bird=../mine"]).bird.name == "mine"
    monkeypatch.chdir(here)
    body = here / "mine" / "body.toml"
    body.write_text(body.read_text().replace("mass = { value = 80.0", "mass = { value = 160.0"))
    heavy = load_scenario("s.toml")
    assert heavy.digest != same.digest
    recording = simulate(heavy)
    assert recording.meta["bird"] == "mine"
    assert recording.meta["notes"]["tow"]["mass_kg"] == 160.0
    # 80 kg more pull with 785 N more.
    more = recording["true_rope_tension_n"].mean() - tow["true_rope_tension_n"].mean()
    assert more == pytest.approx(80.0 * 9.8, rel=0.1)
    body.write_text(body.read_text().replace("mass = { value = 160.0", "mass = { value = -1.0"))
    with pytest.raises(
        RequestError, match=r"^s\.toml:20: tow\.bird: mine/body\.toml:19: body\.mass: -1 kg; allowed: ab"
    ):
        load_scenario("s.toml")
    (here / "mine" / "body.toml").unlink()
    with pytest.raises(RequestError, match=r"^s\.toml:20: tow\.bird: mine: has no body\.toml; allowed: a folder with "):
        load_scenario("s.toml")


def test_feeders_of_carrier_and_bird_are_distinguished(here: Path) -> None:
    shutil.copytree(assets.bird_dir("bird"), here / "mine")
    magnetics = here / "mine" / "magnetics.toml"
    magnetics.write_text(magnetics.read_text().replace('"acquisition"', '"survey_rack"'))
    with pytest.raises(
        RequestError,
        match=r"^--set tow\.bird: helicopter has feeders of the same name: survey_rack; allowed: names of its own$",
    ):
        load_scenario("s.toml", ["tow.bird=./mine"])
    magnetics.write_text(magnetics.read_text().replace('name = "sensor_supply"', 'name = "survey_bus"'))
    with pytest.raises(RequestError, match=r"helicopter has buses of the same name: survey_bus"):
        load_scenario("s.toml", ["tow.bird=./mine"])


def test_feeders_of_either_can_be_set(here: Path, tow: Recording) -> None:
    quiet = [
        "field.electronics.feeders.sensor_heater.enabled=false",
        "field.electronics.feeders.charging.enabled=false",
    ]
    recording = simulate(load_scenario("s.toml", quiet))
    for name in ("sensor_heater", "charging"):
        assert np.abs(recording[f"cur_{name}_a"]).max() < 0.2 < np.abs(tow[f"cur_{name}_a"]).max()
    assert np.abs(recording["electronics_below_x_nt"] - tow["electronics_below_x_nt"]).max() > 0.01
    with pytest.raises(
        RequestError, match=r"feeders\.heater: neither helicopter nor bird has such a feeder; allowed: instruments, "
    ):
        load_scenario("s.toml", ["field.electronics.feeders.heater.enabled=false"])


# ---- pictures and scores ---------------------------------------------------------------------------------------

PNG = b"\x89PNG\r\n\x1a\n"


@pytest.mark.parametrize("kind", ["tow", "spectrum", "flight"])
def test_every_picture_of_a_tow_is_drawn(
    tow: Recording, here: Path, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    tow.write("tow.h5")
    assert cli.main(["plot", kind, "tow.h5", "--sensor", "below"]) == 0
    assert Path(f"tow_{kind}.png").read_bytes().startswith(PNG)
    assert Path(f"tow_{kind}.png").stat().st_size > 20_000


def test_the_picture_of_a_tow_needs_a_rope(tow: Recording, here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    worlds.calibration().write("cal.h5")
    tow.blind().write("blind.h5")
    for name, title in (("cal", "world"), ("blind", tow.name)):
        assert cli.main(["plot", "tow", f"{name}.h5"]) == 2
        output = capsys.readouterr().err
        assert output == f"recording {title!r} has no rope; this figure needs a simulated tow with its truth\n"
    assert sorted(path.name for path in here.iterdir()) == ["blind.h5", "cal.h5", "s.toml"]


def test_the_flights_of_paper_002_are_scored(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Shortened: learned on the diamond, judged on the square."""
    short = ["--set", "pattern.leg_m=500", "--set", "tow.settle_s=30", "-q"]
    for name in ("diamond", "square"):
        assert cli.main(["generate", f"papers/002_{name}", *short]) == 0
    methods = "none,tl16_measured,tl16_gradient:order=1"
    command = ["benchmark", "002_diamond.h5", "002_square.h5", "--methods", methods, "-q"]
    assert cli.main([*command, "--scores", "ir_003,ir"]) == 0
    output = capsys.readouterr().out
    for words in ("002_square, sensor bird", "tl16_gradient:order=1", "heading 90", "heading 180", "above 0.03 Hz"):
        assert words in output
    assert cli.main([*command, "-o", "report"]) == 0
    table = pd.read_csv("report/table.csv")
    rows = (table["recording"] == "002_square") & (table["segment"] == "test") & (table["metric"] == "std_nt")
    scores = table[rows].set_index("method")["value"]
    raw = scores["none"]
    assert 0.05 < raw < 1.0
    for method in methods.split(",")[1:]:
        assert scores[method] < 0.5 * raw

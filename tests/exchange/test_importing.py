"""Files of other programs become recordings without truth; an error about a file is one clear line."""

import os
from pathlib import Path

import h5py
import numpy as np
import pytest

from magsim import exchange
from magsim.benchmark import evaluate
from magsim.cli import main
from magsim.compensation import create, load
from magsim.errors import DataError, RequestError
from magsim.exchange import textfile
from magsim.recording import Recording
from magsim.storage import hdf5

OURS = ("mag_m1_nt", "ins_roll_deg", "ins_pitch_deg", "ins_vn_mps", "ins_ve_mps", "ins_vd_mps", "ins_alt_m")
OURS += ("ins_rate_x_dps", "ins_rate_y_dps", "ins_rate_z_dps", "baro_alt_m")


def export(recording: Recording, kind: str, folder: Path) -> Path:
    return exchange.export([(1, recording)], kind, folder)[0]


def survey(path: Path, *, rows: int = 50, checksum: bool = True, **changes) -> Path:
    """A file in MagNav's layout, written with h5py; the checksum spares the test a child process."""
    fields = {
        "tt": 46_000.0 + np.arange(rows) / 10.0,
        "flight": np.full(rows, 1002.0),
        "line": np.where(np.arange(rows) < rows // 2, 1002.02, 1002.1),
        "year": np.full(rows, 2020.0),
        "doy": np.full(rows, 172.0),
        "lat": np.full(rows, 45.0),
        "lon": np.full(rows, -75.0),
        "utm_z": np.full(rows, 400.0),
        "mag_1_uc": 53_000.0 + np.arange(rows),
        "mag_1_c": np.full(rows, 53_000.0),
        **changes,
    }
    with h5py.File(path, "w") as f:
        for name, value in fields.items():
            if value is not None:
                f[name] = value
    if checksum:
        hdf5.add_checksum(path)
    return path


def test_magnav_hdf5_comes_back_bit_by_bit(recording, tmp_path):
    made = exchange.import_flight(export(recording, "mit", tmp_path))
    back = made.recording
    np.testing.assert_array_equal(back.time_s, recording.time_s)
    for name in (*OURS, "ins_heading_deg", "radar_alt_m", "cur_strobe_a", "circuit"):
        np.testing.assert_array_equal(back[name], recording[name], err_msg=name)
    np.testing.assert_array_equal(back["mag_m2_nt"], recording["mag_cabin_nt"])
    np.testing.assert_array_equal(back["flux_a_y_nt"], recording["flux_nose_y_nt"])
    for name in ("ins_lat_deg", "ins_lon_deg", "baro_pa"):  # by way of radians and kilopascals
        np.testing.assert_allclose(back[name], recording[name], rtol=3e-16)
    assert "ins_acc_x_mps2" not in back  # the platform's are not the body's
    assert back.meta["start_utc"] == recording.meta["start_utc"]
    assert back.meta["rate_hz"] == 10.0
    assert not back.names("truth")
    assert not back.names("label")
    assert made.notes == ()


@pytest.mark.parametrize("kind", ["sgl-xyz", "xyz", "csv"])
def test_text_comes_back_to_half_a_digit(recording, tmp_path, kind):
    path = export(recording, kind, tmp_path)
    back = exchange.import_flight(path, kind).recording
    np.testing.assert_allclose(back.time_s, recording.time_s, rtol=0.0, atol=1e-9)
    for name in OURS:
        half = 0.0 if kind == "csv" else 0.50001 * (1e-4 if name.endswith(("_nt", "_m")) else 1e-6)
        np.testing.assert_allclose(back[name], recording[name], rtol=0.0, atol=half + 1e-11, err_msg=name)
    assert not back.names("truth")
    assert "interference_m1_nt" not in back
    if kind != "sgl-xyz":
        np.testing.assert_array_equal(back["mag_cabin_valid"], recording["mag_cabin_valid"])
        np.testing.assert_array_equal(back.reads("cabin"), recording["mag_cabin_valid"] == 1.0)
        np.testing.assert_allclose(back["ins_acc_z_mps2"], recording["ins_acc_z_mps2"], rtol=0, atol=5.1e-7)
    if kind == "csv":
        np.testing.assert_array_equal(back["split"], recording["split"])


def test_windows_are_lines_or_spans_of_time(tmp_path):
    path = survey(tmp_path / "f.h5")
    windows = {"train": ["1002.02"], "test": ["46002.6:46003.5", "46004:46004.5"]}
    back = exchange.import_flight(path, windows=windows).recording
    assert back.name == "flight_1002"
    assert back.meta["start_utc"] == "2020-06-20T12:46:40+00:00"
    np.testing.assert_array_equal(back["split"], [0.0] * 25 + [2.0] * 16)
    np.testing.assert_array_equal(back["circuit"], [1.0] * 25 + [2.0] * 16)
    np.testing.assert_allclose(back["mag_m1_nt"][[0, 25, 40]], [53_000.0, 53_026.0, 53_045.0])
    assert [len(piece) for piece in back.pieces()] == [25, 10, 6]
    later = exchange.import_flight(path, windows={"train": ["1002.10"]}).recording  # the same number as 1002.1
    assert later.meta["start_utc"] == "2020-06-20T12:46:42.500000+00:00"
    for text, message in [
        ("1002.02", "in another window already"),
        ("1002.03", "has 0 such rows; it has lines 1002.02, 1002.10"),
        ("1:2", "has 0 such rows; it has times from 46000 to 46004.9"),
        ("a", "is no window"),
        ("1:2:3", "is no window"),
        ("nan:nan", "is no window"),
    ]:
        with pytest.raises(RequestError, match=message):
            exchange.import_flight(path, windows={"train": ["1002.02"], "test": [text]})


def test_one_of_several_flights(tmp_path):
    numbers = np.where(np.arange(50) < 20, 1003.0, 1004.0)
    tt = np.where(numbers == 1003.0, 50_000.0, 40_000.0) + np.arange(50) / 10.0  # the second begins earlier in its day
    path = survey(tmp_path / "f.h5", flight=numbers, tt=tt)
    with pytest.raises(RequestError, match=r"holds the flights 1003, 1004; pick one"):
        exchange.import_flight(path)
    with pytest.raises(RequestError, match=r"there is no flight 7; allowed: 1003, 1004"):
        exchange.import_flight(path, flight=7.0)
    assert len(exchange.import_flight(path, flight=1004.0).recording) == 30


def test_a_map_names_and_scales(tmp_path):
    path = tmp_path / "survey.csv"
    path.write_text(
        "t,B_tail,roll_rad,fx,fy,fz,ln,note_1\n"
        + "".join(f"{100 + i / 10},{50_000 + i},0.1,1,2,3,{i // 5},9\n" for i in range(10)),
        encoding="utf-8-sig",
    )
    column_map = tmp_path / "map.toml"
    column_map.write_text(
        'name = "Calibration north"\nstart_utc = 2024-05-01T00:00:00Z\ntime = "t"\nline = "ln"\n[columns]\n'
        'mag_tail_nt = "B_tail"\nins_roll_deg = { column = "roll_rad", scale = 57.29577951308232, offset = 1.0 }\n'
        'flux_nose_x_nt = "fx"\nflux_nose_y_nt = "fy"\nflux_nose_z_nt = "fz"\n'
    )
    made = exchange.import_flight(path, column_map=column_map)
    back = made.recording
    assert back.name == "Calibration north"
    assert back.meta["start_utc"] == "2024-05-01T00:01:40+00:00"
    np.testing.assert_allclose(back["ins_roll_deg"], np.degrees(0.1) + 1.0)
    np.testing.assert_array_equal(back["mag_tail_nt"], 50_000.0 + np.arange(10))
    np.testing.assert_array_equal(back["circuit"], [1.0] * 5 + [2.0] * 5)
    assert made.notes == ("left out, being no input or segment of a recording: note_1",)
    for text, message in [
        ('time = "t"\n[columns]\nmag_a_nt = "B"', r"there is no column 'B', which columns.mag_a_nt of the map names"),
        ('time = "x"', "there is no column 'x', which time of the map names"),
        ('time = "t"\n[columns]\nclean_a_nt = "B_tail"', "is truth, which no foreign file may have"),
        ('time = "t"\n[columns]\nmagnet = "B_tail"', "is no column; allowed: inputs and segments"),
        ('time = "t"\n[columns]\nmag_a_nt = 3', r"map.toml:3: columns.mag_a_nt"),
        ('tine = "t"', r"map.toml:1: tine: unknown key \(did you mean 'time'"),
        ('time = "t"\n[columns]\nmag_a_nt = {column = "B_tail", scale = inf}', "scale"),
        ('time = "t"\n[columns]\nmag_a_nt = {column = "B_tail", scale = 100}', r"mag_a_nt = 5e\+06 .*up to 1e\+06"),
        (
            'time = "t"\n[columns]\nmag_a_nt = "B_tail"\nmag_a_valid = "note_1"',
            "mag_a_valid = 9; allowed: 0 no reading, 1 reading",
        ),
        (
            'time = "t"\n[columns]\nmag_a_nt = "B_tail"\nsplit = "note_1"',
            "split = 9; allowed: 0 train, 1 valid, 2 test",
        ),
        ('time = "t"', "no reading of a scalar magnetometer"),
        ("", r"has no time \(time_s or tt\)"),
    ]:
        column_map.write_text(text + "\n")
        with pytest.raises((RequestError, DataError), match=message) as error:
            exchange.import_flight(path, column_map=column_map)
        assert "\n" not in str(error.value)


def test_missing_values_leave_a_column_out(tmp_path):
    holes = np.where(np.arange(50) == 7, np.nan, 1.0)
    path = survey(tmp_path / "f.h5", mag_2_uc=holes, radar=holes, flux_a_x=np.full(50, np.nan))
    made = exchange.import_flight(path)
    assert made.recording["radar_alt_m"][7] == -1.0
    assert made.recording.scalars == ("m1",)
    assert made.notes == (
        "mag_2_uc is missing in 1 of 50 rows: no column mag_m2_nt",
        "flux_a_x is missing in 50 of 50 rows: no column flux_a_x_nt",
    )
    with pytest.raises(DataError, match=r"no reading of a scalar magnetometer.*mag_1_uc is missing in 1 of 50"):
        exchange.import_flight(survey(tmp_path / "g.h5", mag_1_uc=holes))


ROWS = np.arange(50)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"tt": None}, "there is no tt"),
        (
            {"tt": np.where(ROWS == 9, 46_000.8, 46_000.0 + ROWS / 10)},
            "tt does not increase strictly: 46000.8 in row 10",
        ),
        ({"tt": np.where(ROWS == 9, np.nan, 46_000.0 + ROWS / 10)}, "tt is missing in row 10"),
        ({"tt": (46_000.0 + ROWS / 10)[:, None]}, "tt is 2-dimensional"),
        ({"tt": ROWS}, "tt is 1-dimensional of type int64"),
        ({"mag_1_uc": np.arange(49.0)}, "mag_1_uc has 49 values and tt has 50"),
        ({"mag_1_uc": np.full(50, "a", dtype="S1")}, "mag_1_uc is 1-dimensional of type"),
        ({"mag_1_uc": np.where(ROWS == 3, np.inf, 1.0)}, "mag_1_uc is infinite in row 4"),
        ({"mag_1_uc": np.where(ROWS == 3, 1e7, 1.0)}, r"mag_m1_nt = 1e\+07 in row 4; allowed: up to 1e\+06"),
        ({"ins_lat": np.full(50, 45.0)}, r"ins_lat gives ins_lat_deg = 2578.31 in row 1; allowed: up to 90"),
        ({"doy": np.full(50, 400.0)}, "year 2020 and day 400 in its first row are no date"),
        ({"Bad Name": np.arange(50.0)}, "is not allowed"),
    ],
)
def test_bad_hdf5(tmp_path, changes, message):
    with pytest.raises(DataError, match=message) as error:
        exchange.import_flight(survey(tmp_path / "f.h5", **changes))
    assert "\n" not in str(error.value)


def test_magnavs_own_names_are_allowed(tmp_path):
    matrices = np.zeros((50, 3, 3))
    path = survey(tmp_path / "f.h5", N=50.0, Cnb=matrices, ins_Cnb=matrices, ins_P=np.zeros((50, 1, 1)), dt=0.1)
    assert len(exchange.import_flight(path).recording) == 50


def test_hdf5_that_reaches_elsewhere_or_claims_too_much(tmp_path):
    secret = tmp_path / "secret"
    secret.write_bytes(np.full(50, 7.0).tobytes())

    def external(f: h5py.File) -> None:
        f.create_dataset("mag_2_uc", (50,), "f8", external=[(str(secret), 0, 400)])

    def linked(f: h5py.File) -> None:
        f["mag_2_uc"] = h5py.ExternalLink(str(tmp_path / "f.h5"), "tt")

    def virtual(f: h5py.File) -> None:
        layout = h5py.VirtualLayout((50,), "f8")
        layout[:] = h5py.VirtualSource(str(tmp_path / "f.h5"), "tt", shape=(50,))
        f.create_virtual_dataset("mag_2_uc", layout)

    def huge(f: h5py.File) -> None:
        f.create_dataset("mag_2_uc", (10**12,), "f8", chunks=(1000,), compression="gzip")

    for spoil, message in ((external, "another file"), (linked, "link"), (virtual, "another file"), (huge, "claims")):
        path = survey(tmp_path / "bad.h5", checksum=False)
        with h5py.File(path, "a") as f:
            spoil(f)
        with pytest.raises(DataError, match=message):
            exchange.import_flight(path)
        path.unlink()
    path = survey(tmp_path / "cut.h5", rows=5000, checksum=False)
    os.truncate(path, path.stat().st_size // 2)
    with pytest.raises(DataError, match="truncated"):
        exchange.import_flight(path)


CSV = "time_s,mag_a_nt\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no line with the names|there is no line"),
        (CSV, "has 0 rows"),
        (CSV + "0,1\n", "has 1 rows"),
        (CSV + "0,1\n1\n", r":3: there are 1 values; expected 2"),
        (CSV + "0,1\n1,2,3\n", r":3: there are 3 values; expected 2"),
        (CSV + "0,1\n1,x\n", r":3: mag_a_nt is 'x', which is not a number"),
        (CSV + "0,1\n1,inf\n", "'inf', which is not a number"),
        (CSV + "0,1\n1,1_0\n", "'1_0', which is not a number"),
        (CSV + "0,1\n1,0x1F\n", "which is not a number"),
        (CSV + "0,1\n1,\u0661\n", "which is not a number"),
        (CSV + "0,1\n1,1e400\n", "magnitudes up to"),
        (CSV + "0,1\n1," + "9" * 90 + "\n", "which is not a number"),
        (CSV + "0,1\n0,2\n", "time_s does not increase strictly: 0 in row 2 follows 0"),
        (CSV + "1,1\n0,2\n", "time_s does not increase strictly: 0 in row 2 follows 1"),
        (CSV + "0,1\n,2\n", "time_s is missing in row 2"),
        (CSV + "0,1\n1,nan\n", "no reading of a scalar magnetometer.*missing in 1 of 2"),
        ("time_s,mag_a_nt,mag_a_nt\n0,1,1\n", r":1: column 'mag_a_nt' exists twice"),
        ("time_s," + ",".join(f"c{i}" for i in range(2001)) + "\n", "there are 2002 columns; allowed: up to 2000"),
        (CSV + "0," + " " * 70_000 + "1\n", r":2: the line is longer than 65536 bytes"),
        (CSV + "0,\0\n", r":2: holds a zero byte"),
        ("time_s;mag_a_nt\n0;1\n", "has no time"),
    ],
)
def test_bad_csv(tmp_path, text, message):
    path = tmp_path / "f.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises((DataError, RequestError), match=message) as error:
        exchange.import_flight(path)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 400


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "has no row of numbers"),
        ("/ a\n/ b\n", "has no row of numbers"),
        ("/ TIME UNCOMPMAG1\n1 2 3\n", r":2: no comment before this row names its 3 columns"),
        ("/ TIME UNCOMPMAG1\n1 2\n2\n", r":3: there are 1 values; expected 2"),
        ("/ TIME UNCOMPMAG1\n1 2\n2 *\n", "missing in 1 of 2 rows"),
        ("/ TIME TIME\n1 2\n", r":1: column 'TIME' exists twice"),
        ("/ TIME UNCOMPMAG1\nLINE 1 2\n1 2\n", r":2: 'LINE 1 2' is no line record"),
        ("/ TIME UNCOMPMAG1\nLINE 1\n1 2\n2 3\nLINE x\n3 4\n", None),
    ],
)
def test_bad_xyz(tmp_path, text, message):
    path = tmp_path / "f.xyz"
    path.write_text(text)
    if message is None:  # nothing asks for a line number that is none
        assert len(exchange.import_flight(path).recording) == 3
        return
    with pytest.raises(DataError, match=message):
        exchange.import_flight(path)


def test_text_has_limits_before_it_is_read(tmp_path, monkeypatch):
    path = tmp_path / "f.csv"
    path.write_text(CSV + "".join(f"{i},1\n" for i in range(100)))
    monkeypatch.setattr(textfile, "MAX_CELLS", 150)
    with pytest.raises(DataError, match=r":77: the table has more than 150 values"):
        exchange.import_flight(path)
    monkeypatch.setattr(textfile, "MAX_BYTES", 100)
    with pytest.raises(RequestError, match="allowed: up to 100"):
        exchange.import_flight(path)
    path.write_bytes(b"time_s,mag_a_nt\n0,\xff\n")
    with pytest.raises(DataError, match=r":2: is no text in UTF-8"):
        exchange.import_flight(path)
    for bad, message in ((tmp_path / "no.csv", "no such file"), (tmp_path, "--format"), (Path("x.txt"), "--format")):
        with pytest.raises(RequestError, match=message):
            exchange.import_flight(bad)
    os.mkfifo(tmp_path / "pipe.csv")
    with pytest.raises(RequestError, match="not a regular file"):
        exchange.import_flight(tmp_path / "pipe.csv")


def test_a_survey_file_is_compensated_and_scored_without_truth(calibration, tmp_path, capsys):
    """From the MIT layout without truth: the learned method is that of the recording itself."""
    whole = exchange.export([(1, calibration)], "mit", tmp_path, roles=["input", "segment"])[0]
    target = tmp_path / "real.h5"
    windows = ["--train", "1.01", "--test", "1.02"]
    assert main(["import", str(whole), "-o", str(target), *windows]) == 0
    assert main(["import", str(whole), "-o", str(target), *windows]) == 2
    assert "exists already; --force" in capsys.readouterr().err
    run = tmp_path / "run"
    assert main(["train", "tl16_measured", str(target), "-o", str(run), "-q"]) == 0
    capsys.readouterr()
    own = create("tl16_measured").fit([calibration.where(circuit=1).labeled()], sensor="cabin")
    np.testing.assert_allclose(load(run).coefficients_, own.coefficients_, rtol=1e-9)
    loaded = Recording.read(target)
    report = evaluate([loaded], ["none", ("run", load(run)), "tl18_measured"])
    assert report.value("none", "ir_paper") == 1.0
    assert report.value("run", "ir_paper") > 10.0
    assert report.value("tl18_measured", "gain") == pytest.approx(1.0)
    assert not {"std_nt", "ir", "rmse_nt"} & {row.metric for row in report.rows}
    assert main(["benchmark", str(target), "--methods", f"none,{run}", "-q"]) == 0
    assert "has no truth: only the papers' scores" in capsys.readouterr().out
    assert main(["info", str(target)]) == 0
    capsys.readouterr()
    assert main(["train", "tl16", str(target), "-o", str(tmp_path / "no"), "-q"]) == 2
    assert "without truth a method is fitted to target 'measured', 'model', 'map'" in capsys.readouterr().err
    bare = tmp_path / "bare.h5"
    assert main(["import", str(whole), "-o", str(bare)]) == 0
    capsys.readouterr()
    assert main(["benchmark", str(bare)]) == 2
    assert "magsim import makes it with --train and --test" in capsys.readouterr().err
    # without a split all rows are for training
    assert main(["train", "tl16_measured", str(bare), "-o", str(tmp_path / "all")]) == 0
    assert f"tl16_measured for m1, {len(calibration)} rows" in capsys.readouterr().out


def test_the_command_does_not_write_over_its_source(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = survey(Path("flight_1002.h5"))
    before = path.read_bytes()
    assert main(["import", str(path), "--force"]) == 2
    assert "is the file that is read" in capsys.readouterr().err
    assert path.read_bytes() == before

"""Exports are read by other programs as recorded: to half a printed digit in text, to the bit in HDF5."""

import io
import re
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import ppigrf
import pytest
from scipy.spatial.transform import Rotation

from magsim import exchange
from magsim.cli import main
from magsim.errors import DataError, RequestError
from magsim.exchange import sgl, tables
from magsim.recording import Recording, file

HALF = 0.5 * (1.0 + 1e-6)


def export(recording: Recording, kind: str, folder: Path, **options) -> list[Path]:
    return exchange.export([(1, recording)], kind, folder, **options)


def magnav(path: Path) -> dict[str, np.ndarray]:
    """The rules of MagNav.jl's get_XYZ20, written anew from its description (src/get_XYZ.jl)."""
    with h5py.File(path) as f:
        root = {name: f[name][()] if isinstance(f[name], h5py.Dataset) else f[name] for name in f}
        n = 1
        for value in root.values():  # the longest of all members: values, characters, or entries of a group
            n = max(n, len(value) if np.ndim(value) or isinstance(value, h5py.Group | bytes) else 1)
        fields = {name: value for name, value in root.items() if isinstance(value, np.ndarray) and value.ndim}
        order = np.argsort(fields["tt"], kind="stable")
        xyz = {name: np.asarray(value)[order] if len(value) == n else None for name, value in fields.items()}
    missing = np.full(n, np.nan)
    tt = xyz["tt"]
    out = {name: xyz.get(name, missing) for name in sgl.BY_NAME}
    out["N"], out["dt"] = n, round(tt[1] - tt[0], 9)
    out["igrf"] = out["mag_1_dc"] - out["mag_1_igrf"]
    out["ve"] = np.gradient(out["utm_x"]) / out["dt"]
    out["vn"] = np.gradient(out["utm_y"]) / out["dt"]
    out["ins_ve"], out["ins_vd"] = -out["ins_vw"], -out["ins_vu"]
    return out


def test_magnav_reads_the_recording(recording, tmp_path):
    (path,) = export(recording, "mit", tmp_path)
    xyz = magnav(path)
    assert xyz["N"] == len(recording)
    assert xyz["dt"] == 0.1
    np.testing.assert_allclose(xyz["tt"], 86_370.0 + recording.time_s, atol=1e-9)
    assert set(xyz["year"]) == {2025.0}
    assert set(xyz["doy"]) == {72.0}
    assert set(xyz["line"]) == {1.01, 1.02}
    exact = {
        "mag_1_uc": "mag_m1_nt",  # it asks for that place by its name
        "mag_2_uc": "mag_cabin_nt",
        "mag_3_uc": "mag_tail_nt",
        "flux_a_x": "flux_nose_x_nt",
        "flux_a_y": "flux_nose_y_nt",
        "flux_a_z": "flux_nose_z_nt",
        "ins_roll": "ins_roll_deg",
        "ins_pitch": "ins_pitch_deg",
        "ins_yaw": "ins_heading_deg",
        "ins_vn": "ins_vn_mps",
        "ins_ve": "ins_ve_mps",
        "ins_vd": "ins_vd_mps",
        "ins_alt": "ins_alt_m",
        "cur_strb": "cur_strobe_a",
        "baro": "baro_alt_m",
        "roll_rate": "ins_rate_x_dps",
        "pitch_rate": "ins_rate_y_dps",
        "yaw_rate": "ins_rate_z_dps",
        "lat": "true_lat_deg",
        "lon": "true_lon_deg",
        "utm_z": "true_alt_m",
    }
    for theirs, ours in exact.items():
        np.testing.assert_array_equal(xyz[theirs], recording[ours], err_msg=theirs)
    np.testing.assert_allclose(xyz["ins_lat"], np.deg2rad(recording["ins_lat_deg"]), rtol=1e-15)
    np.testing.assert_allclose(xyz["ins_lon"], np.deg2rad(recording["ins_lon_deg"]), rtol=1e-15)
    flux = np.linalg.norm([xyz["flux_a_x"], xyz["flux_a_y"], xyz["flux_a_z"]], axis=0)
    np.testing.assert_allclose(xyz["flux_a_t"], flux, rtol=1e-15)
    np.testing.assert_array_equal(np.isnan(xyz["radar"]), recording["radar_alt_m"] < 0.0)
    np.testing.assert_allclose(xyz["static_p"], recording["baro_pa"] / 1000.0, rtol=1e-15)
    assert np.isnan(xyz["mag_4_uc"]).all()


def test_accelerations_are_those_of_a_level_platform(recording, tmp_path):
    """North, west and up by scipy's rotations; gravity is in the third."""
    (path,) = export(recording, "mit", tmp_path)
    xyz = magnav(path)
    angles = np.stack([xyz["ins_yaw"], xyz["ins_pitch"], xyz["ins_roll"]], axis=1)
    body = np.stack([recording[f"ins_acc_{axis}_mps2"] for axis in "xyz"], axis=1)
    north, east, down = Rotation.from_euler("ZYX", angles, degrees=True).apply(body).T
    for name, wanted in (("ins_acc_x", north), ("ins_acc_y", -east), ("ins_acc_z", -down), ("ins_wander", 0.0 * north)):
        np.testing.assert_allclose(xyz[name], wanted, rtol=0, atol=1e-13)
    assert abs(xyz["ins_acc_z"].mean() - 9.8) < 0.2


def test_the_stages_of_mag_1_agree_with_an_independent_igrf(recording, tmp_path):
    (path,) = export(recording, "mit", tmp_path)
    xyz = magnav(path)
    np.testing.assert_allclose(xyz["mag_1_uc"] - xyz["mag_1_c"], recording["interference_m1_nt"], atol=1e-9)
    np.testing.assert_allclose(xyz["mag_1_lag"] - xyz["diurnal"], xyz["mag_1_dc"], atol=1e-9)
    assert abs(xyz["diurnal"].mean()) < 1e-9
    np.testing.assert_allclose(np.diff(xyz["diurnal"]), np.diff(recording["base_hut_nt"]), atol=1e-9)
    rows = slice(None, None, 50)
    day = pd.Timestamp(year=2025, month=1, day=1) + pd.Timedelta(days=72 - 1)
    # MagNav.jl takes the day alone, and stops where the difference is above 1 nT
    for date, most in ((day + pd.Timedelta(seconds=xyz["tt"][300]), 0.05), (day, 1.0)):
        east, north, up = ppigrf.igrf(xyz["lon"][rows], xyz["lat"][rows], xyz["utm_z"][rows] / 1e3, date)
        theirs = np.sqrt(east**2 + north**2 + up**2).ravel()
        assert np.sqrt(np.mean((xyz["igrf"][rows] - theirs) ** 2)) < most


def test_velocities_from_utm_are_those_flown(recording, tmp_path):
    (path,) = export(recording, "mit", tmp_path)
    xyz = magnav(path)
    # 70 m/s on a sphere of 4.5e6 m across the meridian, on the ellipsoid's own parallel
    flat = (
        6378137.0 / np.sqrt(1.0 - 0.00669437999014 * np.sin(np.radians(45.30001)) ** 2) * np.cos(np.radians(45.30001))
    )
    speed = np.hypot(xyz["vn"], xyz["ve"])
    np.testing.assert_allclose(speed, 70.0 / 4.5e6 * flat, rtol=5e-4)  # the scale of the projection: 0.9996


def test_the_rest_is_in_groups_bit_by_bit(recording, tmp_path):
    (path,) = export(recording, "mit", tmp_path)
    with h5py.File(path) as f:
        for name in f:
            if isinstance(f[name], h5py.Dataset) and name != "info":
                assert name in sgl.BY_NAME
                assert f[name].shape == (len(recording),)
                assert f[name].dtype == np.float64
        for role in ("label", "truth", "segment"):
            assert set(f[role]) == set(recording.names(role))
            for name in f[role]:
                np.testing.assert_array_equal(f[role][name][()], recording[name])
        body = {f"ins_acc_{axis}_mps2" for axis in "xyz"}
        assert set(f["input"]) == {"base_hut_nt", "surface_rudder_deg", "mag_cabin_valid"} | body
        for name in f["input"]:
            np.testing.assert_array_equal(f["input"][name][()], recording[name])
        assert {name: f["sensors"][name][()].decode() for name in f["sensors"]} == {
            "mag_1": "m1",
            "mag_2": "cabin",
            "mag_3": "tail",
            "flux_a": "nose",
        }


def test_inputs_alone_tell_no_truth(recording, tmp_path):
    (path,) = export(recording, "mit", tmp_path, roles=["input"])
    with h5py.File(path) as f:
        assert set(f) & {"truth", "label", "segment", "mag_1_c"} == set()
        np.testing.assert_array_equal(f["lat"][()], recording["ins_lat_deg"])
        np.testing.assert_array_equal(f["mag_1_lag"][()], recording["mag_m1_nt"])


def test_seven_magnetometers_leave_the_last_to_a_group(recording, tmp_path):
    extra = {f"mag_s{k}_nt": recording["mag_tail_nt"] + k for k in range(4)}
    (path,) = export(replace(recording, data={**recording.data, **extra}), "mit", tmp_path)
    with h5py.File(path) as f:
        np.testing.assert_array_equal(f["input/mag_s3_nt"][()], extra["mag_s3_nt"])
        assert "mag_s2_nt" not in f["input"]
        np.testing.assert_array_equal(f["mag_6_uc"][()], extra["mag_s2_nt"])


def half_digits(text: str, values: np.ndarray, printed: np.ndarray) -> None:
    """Printed values equal the numbers to half of the last printed digit."""
    digits = len(text.partition(".")[2])
    assert np.abs(printed - values).max() <= HALF * 10.0**-digits + 1e-15 * np.abs(values).max()


def test_standard_xyz(recording, tmp_path):
    (path,) = export(recording, "xyz", tmp_path)
    lines = path.read_text(encoding="ascii").splitlines()
    head = [line for line in lines if line.startswith("/ ")][-1].split()[1:]
    assert "//Flight 1" in lines
    assert "//Date 2025/03/13" in lines
    assert [line for line in lines if line.startswith("LINE")] == ["LINE 101", "LINE 102", "LINE 202", "LINE 203"]
    rows = [line for line in lines if not line.startswith(("/", "LINE"))]
    table = pd.read_csv(io.StringIO("\n".join(rows)), sep=r"\s+", names=head, na_values="*")
    assert table.shape == (len(recording), len(recording.data) + 1)
    for name, text in zip(head, rows[0].split(), strict=True):
        half_digits(text, recording[name], table[name].to_numpy())


def test_sgl_xyz(recording, tmp_path):
    (path,) = export(recording, "sgl-xyz", tmp_path)
    lines = path.read_text(encoding="ascii").splitlines()
    head = lines[2].removeprefix("/").split()
    assert [field.head for field in sgl.FIELDS if field.head in head] == head
    assert [line for line in lines if line.startswith("/")] == lines[:3]
    table = pd.read_csv(path, comment="/", sep=r"\s+", na_values="*", names=head)  # as the SGL sample is read
    fields = sgl.fields_of(recording, 1)
    assert table.shape == (len(recording), len(fields))
    assert lines[3].split()[0] == "1.01"
    texts = dict(zip(head, lines[-1].split(), strict=True))
    for name, values in fields.items():
        printed = table[sgl.BY_NAME[name].head].to_numpy()
        there = ~np.isnan(values)
        np.testing.assert_array_equal(np.isnan(printed), ~there)
        half_digits(texts[sgl.BY_NAME[name].head], values[there], printed[there])


def test_gdf2_by_its_definitions(recording, tmp_path):
    """The rules of ASEG-GDF2 revision 4: numbered definitions, fixed widths, complete records, an end."""
    dat, dfn = export(recording, "gdf2", tmp_path)
    assert (dat.name, dfn.name) == ("two_boxes.dat", "two_boxes.dfn")
    definitions = dfn.read_text(encoding="ascii").splitlines()
    assert definitions[-1] == f"DEFN {len(definitions)} ST=RECD,RT=;END DEFN"
    names, widths, digits, nulls = [], [], [], {}
    for number, line in enumerate(definitions[:-1], start=1):
        found = re.fullmatch(r"DEFN (\d+) ST=RECD,RT=;(\w+):([IF])(\d+)(?:\.(\d+))?:([^:;]*)", line)
        assert found is not None, line
        assert int(found[1]) == number
        details = dict(part.split("=") for part in found[6].split(","))
        names.append(found[2])
        widths.append(int(found[4]))
        digits.append(int(found[5] or 0))
        if "NULL" in details:
            nulls[found[2]] = float(details["NULL"])
    assert names == ["line", "time_s", *recording.data]
    assert nulls == {"radar_alt_m": -1.0}
    text = dat.read_text(encoding="ascii")
    assert text.endswith("\n")
    assert {len(line) for line in text.splitlines()} == {sum(widths)}
    table = pd.read_fwf(dat, widths=widths, names=names)
    assert len(table) == len(recording)
    for name, places in zip(names[1:], digits[1:], strict=True):
        assert np.abs(table[name].to_numpy() - recording[name]).max() <= HALF * 10.0**-places + 1e-11
    assert set(table["line"]) == {101, 102, 202, 203}
    assert all(line[sum(widths[:i])] == " " for line in text.splitlines()[:3] for i in range(len(widths)))


def test_csv_keeps_every_bit(recording, tmp_path):
    (path,) = export(recording, "csv", tmp_path)
    table = pd.read_csv(path)
    assert list(table) == ["time_s", *recording.data]
    for name in table:
        np.testing.assert_array_equal(table[name].to_numpy(), recording[name])


def test_parquet_keeps_every_bit_and_the_units(recording, tmp_path):
    from pyarrow import parquet

    (path,) = export(recording, "parquet", tmp_path)
    table = pd.read_parquet(path)
    assert list(table) == ["time_s", *recording.data]
    for name in table:
        np.testing.assert_array_equal(table[name].to_numpy(), recording[name])
    schema = parquet.read_schema(path)
    units = {"mag_cabin_nt": "nT", "mag_cabin_valid": "1", "ins_acc_x_mps2": "m/s^2", "ins_rate_x_dps": "deg/s"}
    for name, unit in (units | {"baro_pa": "Pa", "true_cabin_c": "degC", "fluxerror_nose_x_nt": "nT"}).items():
        assert schema.field(name).metadata[b"unit"].decode() == unit
    assert schema.metadata[b"start_utc"] == b"2025-03-13T23:59:30+00:00"


def test_parquet_without_pyarrow_is_an_error(recording, tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pyarrow", None)
    with pytest.raises(RequestError, match=r"magsim\[parquet\]"):
        export(recording, "parquet", tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("kind", exchange.FORMATS)
def test_the_same_recording_gives_the_same_bytes(recording, tmp_path, kind):
    folders = [tmp_path / "a", tmp_path / "b"]
    for folder in folders:
        folder.mkdir()
        export(recording, kind, folder)
    files = [sorted(folder.iterdir()) for folder in folders]
    assert [path.name for path in files[0]] == [path.name for path in files[1]]
    assert [path.read_bytes() for path in files[0]] == [path.read_bytes() for path in files[1]]


@pytest.mark.parametrize("kind", exchange.FORMATS)
def test_existing_files_are_refused(recording, tmp_path, kind):
    written = export(recording, kind, tmp_path)
    written[-1].write_text("mine")
    for path in written[:-1]:
        path.unlink()
    with pytest.raises(RequestError, match="exists already; --force"):
        export(recording, kind, tmp_path)
    assert list(tmp_path.iterdir()) == [written[-1]]
    assert written[-1].read_text() == "mine"
    assert export(recording, kind, tmp_path, force=True) == written


def test_the_command_writes_one_flight_or_all(recording, tmp_path, capsys):
    source = tmp_path / "two.h5"
    file.write(source, [recording, replace(recording, name="two boxes"), replace(recording, name="third")])
    assert main(["export", str(source), "--format", "csv", "-o", str(tmp_path / "x.csv")]) == 2
    assert "there are 3 flights (1 two boxes, 2 two boxes, 3 third)" in capsys.readouterr().err
    assert main(["export", str(source), "--format", "csv", "--flight", "two boxes"]) == 2
    assert "give a number" in capsys.readouterr().err
    assert main(["export", str(source), "--format", "csv", "--flight", "fourth"]) == 2
    assert "there is no flight 'fourth'" in capsys.readouterr().err
    folder = tmp_path / "all"
    folder.mkdir()
    assert main(["export", str(source), "--format", "csv", "-o", str(folder), "--roles", "input"]) == 0
    assert sorted(p.name for p in folder.iterdir()) == ["third.csv", "two_boxes_1.csv", "two_boxes_2.csv"]
    assert not any(name.startswith("true") for name in pd.read_csv(folder / "third.csv"))
    assert main(["export", str(source), "--format", "csv", "--flight", "third", "-o", str(source), "--force"]) == 2
    assert "is the recording itself" in capsys.readouterr().err
    assert main(["export", str(source), "--format", "csv", "--flight", "3", "--roles", "inputs"]) == 2
    assert "allowed: input, label, truth, segment" in capsys.readouterr().err


def test_what_a_format_cannot_tell_is_refused(recording, tmp_path):
    def without(*names: str, **changes) -> Recording:
        return replace(recording, data={k: v for k, v in recording.data.items() if k not in names}, **changes)

    cases = [
        ("mit", without(meta={}), "no start_utc"),
        ("sgl-xyz", without(meta={}), "no start_utc"),
        ("mit", without("true_lat_deg", "ins_lat_deg"), "no position"),
        ("mit", without().take(slice(0, 3)), "fewer than"),
        ("mit", without(meta={"start_utc": "2031-03-13T00:00:00+00:00"}), "2030"),
        ("mit", without(time_s=np.r_[0.0, 0.3 + np.arange(599) / 10.0]), "begins with a step of 0.3 s"),
        ("gdf2", without(), r"ends in \.dat"),
    ]
    for kind, bad, message in cases:
        with pytest.raises(RequestError, match=message):
            exchange.export([(1, bad)], kind, tmp_path / "x.bin")
    polar = {**recording.data, "true_lat_deg": np.full(600, 86.0)}
    with pytest.raises(RequestError, match="latitude 86"):
        export(replace(recording, data=polar), "mit", tmp_path)
    broken = {**recording.data, "mag_m1_nt": np.full(600, np.nan)}
    with pytest.raises(DataError, match="mag_m1_nt is not finite"):
        export(replace(recording, data=broken), "csv", tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_lines_without_circuits_or_legs(recording):
    bare = replace(recording, data={"mag_m1_nt": recording["mag_m1_nt"]})
    assert set(tables.line_numbers(bare)) == {1.0}
    many = replace(recording, data={"circuit": np.ones(600), "leg": np.arange(600) + 1.0})
    assert len(set(tables.line_numbers(many))) == 600
    assert set(sgl.lines_of(bare, 7)) == {7.01}

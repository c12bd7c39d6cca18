"""Logged tracks: the motion between the rows against formulas, and files that are wrong."""

import re
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from magsim import assets
from magsim.aircraft import Aircraft
from magsim.errors import RequestError
from magsim.flight import fly
from magsim.loading import LoadedScenario, load_scenario
from magsim.simulation import simulate
from magsim.terrain import TangentPlane
from magsim.trajectory import Flight
from tests.support import tracks

HEAD = "t,lat,lon,alt,roll,pitch,heading"
SCENARIO = """\
schema = 1
seed = 1
aircraft = "c208b"

[pattern]
kind = "track"
file = "t.csv"

[pattern.columns]
time = "t"
lat = "lat"
lon = "lon"
alt = "alt"
roll = "roll"
pitch = "pitch"
heading = "heading"

[[sensors.scalar]]
name = "cabin"
mount = "cabin_center"
"""


def rows(count: int = 300) -> list[str]:
    return [f"{i / 10:.1f},{-30 + 1e-5 * i:.6f},20.0,500,0,2,{(359.5 + 0.01 * i) % 360:.2f}" for i in range(count)]


@pytest.fixture
def place(tmp_path: Path) -> Callable[..., Path]:
    def put(lines: list[str], text: str = SCENARIO, head: str = HEAD) -> Path:
        (tmp_path / "t.csv").write_text("\n".join([head, *lines]) + "\n", encoding="latin-1")
        (tmp_path / "s.toml").write_text(text)
        return tmp_path / "s.toml"

    return put


def flown(loaded: LoadedScenario) -> Flight:
    return fly(loaded.scenario, loaded.aircraft, ground=loaded.ground, track=loaded.track)


def problems(path: Path, *overrides: str) -> str:
    with pytest.raises(RequestError) as caught:
        load_scenario(path, overrides)
    return str(caught.value)


def test_the_motion_between_the_rows_is_that_of_the_formulas(tmp_path):
    """10 rows a second in local meters and radians; velocity and body rates against derivatives by hand."""
    time = np.arange(0.0, 100.0, 0.1)
    turn = np.radians(2.0)

    def motion(t: np.ndarray) -> dict[str, np.ndarray]:
        return {
            "north": 2.0 * np.sin(turn * t),
            "east": 2.0 * (1.0 - np.cos(turn * t)),
            "alt": 1000.0 + 20.0 * np.sin(t / 6.0),
            "roll": 0.25 + 0.15 * np.sin(1.1 * t),
            "pitch": 0.03 + 0.07 * np.sin(1.3 * t),
            "heading": (turn * t + 0.05 * np.sin(0.9 * t)) % (2.0 * np.pi),
        }

    with h5py.File(tmp_path / "t.h5", "w") as file:
        group = file.create_group("log")
        group["t"] = time * 1000.0
        for name, values in motion(time).items():
            group[name] = values
    text = SCENARIO.split("[pattern.columns]", 1)
    units = {"north": "km", "east": "km", "alt": "m", "roll": "rad", "pitch": "rad", "heading": "rad", "time": "ms"}
    columns = "".join(
        f'{name} = {{ name = "log/{"t" if name == "time" else name}", unit = "{unit}" }}\n'
        for name, unit in units.items()
    )
    start = "[start]\nlat_deg = 46.5\nlon_deg = 8.0\nalt_m = 1000.0\n\n[pattern]"
    head = text[0].replace("t.csv", "t.h5").replace("[pattern]", start)
    (tmp_path / "s.toml").write_text(head + "[pattern.columns]\n" + columns + text[1][text[1].index("\n[[") :])
    flight = flown(load_scenario(tmp_path / "s.toml"))
    carrier = flight.carrier.at(np.arange(0.0, flight.duration_s, 0.0173))
    t = carrier.time_s + 4.0

    truth = motion(t)
    plane = TangentPlane(*np.radians([46.5, 8.0]), 1000.0)
    np.testing.assert_allclose(
        plane.place(carrier.lat_rad, carrier.lon_rad), [1e3 * truth["north"], 1e3 * truth["east"]], atol=2e-3
    )
    np.testing.assert_allclose(carrier.alt_m, truth["alt"], atol=1e-4)
    attitude = np.column_stack([truth["roll"], truth["pitch"], np.unwrap(truth["heading"])])
    assert np.degrees(np.abs(carrier.attitude - attitude)).max() < 1e-4

    north, east = plane.turn(
        carrier.lat_rad, carrier.lon_rad, 2e3 * turn * np.cos(turn * t), 2e3 * turn * np.sin(turn * t)
    )
    velocity = np.column_stack([north, east, -20.0 / 6.0 * np.cos(t / 6.0)])
    np.testing.assert_allclose(carrier.velocity_n, velocity, atol=2e-3)

    roll, pitch, heading = 0.165 * np.cos(1.1 * t), 0.091 * np.cos(1.3 * t), turn + 0.045 * np.cos(0.9 * t)
    p = roll - np.sin(attitude[:, 1]) * heading
    q = np.cos(attitude[:, 0]) * pitch + np.sin(attitude[:, 0]) * np.cos(attitude[:, 1]) * heading
    r = -np.sin(attitude[:, 0]) * pitch + np.cos(attitude[:, 0]) * np.cos(attitude[:, 1]) * heading
    assert np.degrees(np.abs(carrier.rate_b - np.column_stack([p, q, r]))).max() < 2e-3


def test_velocity_and_rates_belong_to_the_motion(place):
    """Rotations between the rows of the attitude alone give the body rates."""
    from magsim.frames import rot_nb_from_attitude

    flight = flown(load_scenario("patterns/track"))
    step = 1e-3
    time = np.arange(1.0, flight.duration_s - 1.0, 0.31)
    before, after = (rot_nb_from_attitude(flight.carrier.at(time + s).attitude) for s in (-step, step))
    turned = np.einsum("nji,njk->nik", before, after)
    rate = np.stack([turned[:, 2, 1], turned[:, 0, 2], turned[:, 1, 0]], axis=-1) / (2.0 * step)
    np.testing.assert_allclose(rate, flight.carrier.at(time).rate_b, atol=2e-5)
    down = (flight.carrier.at(time - step).alt_m - flight.carrier.at(time + step).alt_m) / (2.0 * step)
    np.testing.assert_allclose(down, flight.carrier.at(time).velocity_n[:, 2], atol=3e-3)  # heights of the file to 3 mm


def test_the_shipped_track_is_that_of_its_program(tmp_path):
    tracks.write_csv(tmp_path / "t.csv")
    shipped = np.genfromtxt(assets.ROOT / "scenarios/patterns/track.csv", delimiter=",", skip_header=2)
    made = np.genfromtxt(tmp_path / "t.csv", delimiter=",", skip_header=2)
    np.testing.assert_allclose(made, shipped, atol=2e-2, rtol=0)


def test_the_shipped_track_becomes_a_recording():
    loaded = load_scenario("patterns/track")
    recording = simulate(loaded)
    truth = tracks.track(np.arange(0.0, 200.0 + 1e-9, 0.1))
    inner = slice(40, 40 + len(recording))
    for name in ("roll", "pitch", "heading"):
        wrong = recording[f"true_{name}_deg"] - truth[f"{name}_deg"][inner]
        assert np.abs((wrong + 180.0) % 360.0 - 180.0).max() < 2e-4
    feet = truth["alt_msl_ft"][inner]
    np.testing.assert_allclose(recording["true_msl_m"], feet * 0.3048, atol=0.002)
    np.testing.assert_allclose(recording["true_alt_m"], feet * 0.3048 + 44.0, atol=0.002)
    np.testing.assert_allclose(recording["true_agl_m"], feet * 0.3048 - 55.0, atol=0.002)
    np.testing.assert_array_equal(recording["leg"], truth["line"][inner])
    np.testing.assert_array_equal(recording["turn"], truth["turn"][inner])
    assert set(recording["split"]) == {0.0, 1.0}
    assert not any(name.startswith("surface") for name in recording.data)


def test_part_of_a_log_and_one_leg(place):
    loaded = load_scenario(place(rows()), ["pattern.from_s=5", "pattern.to_s=27"])
    flight = flown(loaded)
    assert flight.duration_s == pytest.approx(14.0)
    assert [(s.circuit, s.leg, s.turn) for s in flight.segments] == [(1, 1, False)]
    assert flight.segments[0].heading_deg == pytest.approx(0.0, abs=1e-6)
    assert loaded.scenario.start.lat_deg == pytest.approx(-30 + 50e-5)
    # the heading of the file jumps from 360 to 0, that of the flight does not
    assert np.abs(np.diff(flight.carrier.attitude[:, 2])).max() < 1e-3


def test_a_track_over_the_date_line(place):
    lines = [f"{i / 10},10,{(179.999 + 1e-5 * i + 180) % 360 - 180:.6f},500,0,2,90" for i in range(300)]
    carrier = flown(load_scenario(place(lines))).carrier
    assert np.abs(np.diff(carrier.lon_rad)).max() < 1e-5
    assert np.abs(carrier.velocity_n[:, 1] - carrier.velocity_n[0, 1]).max() < 0.1


def test_surfaces_of_a_track(place):
    lines = [f"{row},{i / 100:.2f}" for i, row in enumerate(rows())]
    text = SCENARIO.replace('heading = "heading"', 'heading = "heading"\nelevator = "de"')
    flight = flown(load_scenario(place(lines, text, HEAD + ",de")))
    expected = np.radians(10.0 * (flight.carrier.time_s + 4.0) / 100.0)
    np.testing.assert_allclose(flight.controls["elevator"], expected, atol=1e-9)


def test_the_file_belongs_to_the_digest(place):
    first = load_scenario(place(rows())).digest
    assert load_scenario(place(rows())).digest == first
    assert load_scenario(place([*rows(299), rows()[-1].replace(",500,", ",500.5,")])).digest != first


def changed(index: int, old: str, new: str) -> list[str]:
    lines = rows()
    assert old in lines[index]
    lines[index] = lines[index].replace(old, new, 1)
    return lines


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ([], r"t\.csv: has 0 rows"),
        (rows(3), r"t\.csv: has 3 rows"),
        (rows(100), r"t\.csv: is 9\.9 s long; allowed: at least 20"),
        (changed(5, ",500,", ",5o0,"), r"t\.csv:7: column alt: '5o0' is not a finite number"),
        (changed(5, ",500,", ",,"), r"t\.csv:7: column alt: is empty"),
        (changed(5, ",500,", ",nan,"), r"t\.csv:7: column alt: 'nan' is not a finite number"),
        (changed(5, ",500,", ",1e999,"), r"t\.csv:7: column alt: '1e999' is not a finite number"),
        (changed(5, ",500,", ",5,00,"), r"t\.csv:7: has 8 columns, the header has 7"),
        (changed(5, ",500,", ',"500,'), r"t\.csv:7: is not CSV"),
        (changed(5, ",500,", ",\xff,"), r"t\.csv:7: is not UTF-8 text \(byte 0xff\)"),
        (changed(5, "0.5,", "0.4,"), r"t\.csv:7: column t: 0\.4 s is not after the row before"),
        (rows()[:50] + rows()[80:], r"t\.csv:52: column t: 3\.1 s are missing before 8 s; allowed: up to max_gap_s"),
        (changed(5, "-29.999", "-99.999"), r"t\.csv:7: column lat: -99\.9\d+ deg is outside"),
        (changed(5, ",500,", ",5000,"), r"t\.csv:7: column alt: jumps at 45000 m/s"),
        (changed(5, "20.0", "21.0"), r"t\.csv:7: column lon: jumps at"),
        (changed(5, ",0,2,", ",0,89,"), r"t\.csv:7: column pitch: 89 deg is outside"),
        (changed(5, ",0,2,", ",120,2,"), r"t\.csv:7: column roll: jumps at 1200 deg/s"),
        (changed(5, ",500,", ",99999,"), r"t\.csv:7: column alt: 99999 m is outside"),
    ],
)
def test_wrong_rows(place, lines, message):
    text = problems(place(lines))
    assert re.search(r"s\.toml:7: pattern\.file: .*" + message, text), text


def test_every_wrong_row_is_reported_up_to_a_bound(place):
    lines = rows()
    lines[3], lines[9] = lines[3].replace(",500,", ",x,"), lines[9].replace(",500,", ",y,")
    assert [line.split(": ")[2].split(":")[-1] for line in problems(place(lines)).splitlines()] == ["5", "11"]
    many = problems(place([line.replace(",500,", ",z,") for line in rows()])).splitlines()
    assert len(many) == 20
    assert many[-1].endswith("... and more problems")


def test_one_mistake_is_one_line(place):
    assert problems(place([], head="")).endswith(".csv: has no header line; allowed: names of columns, then rows")
    (line,) = problems(place(rows()), "pattern.from_s=50", "pattern.to_s=20").splitlines()
    assert line.endswith("pattern.to_s: 20 is not after from_s = 50; allowed: above that")


def test_wrong_columns(place):
    path = place(rows())
    assert "there is no column Roll for roll (did you mean 'roll'?); the file has: t, lat" in problems(
        path, "pattern.columns.roll=Roll"
    )
    assert "'feet' is no unit of it; allowed: m, km, ft" in problems(
        path, 'pattern.columns.alt={name="alt", unit="feet"}'
    )
    assert "give either lat and lon, or north and east" in problems(path, "pattern.columns.north=t")
    assert "heights above the sea need the geoid" in problems(path, "pattern.heights=sea")
    assert "is not after from_s" in problems(path, "pattern.from_s=9", "pattern.to_s=8")
    text = SCENARIO.replace('heading = "heading"', 'heading = "heading"\nleg = "roll"')
    assert "column roll: 0 is no number of it; allowed: whole numbers from 1" in problems(place(rows(), text))


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("none.csv", "there is no such file"),
        (".", "is not a regular file"),
        ("s.toml", "s.toml:1: there is no column t"),
        ("x" * 300, "cannot be read"),
        ("bad.h5", "is not an HDF5 file"),
        ("short.h5", "the data sets differ in length"),
        ("text.h5", "expected 1 of kind 'f'"),
    ],
)
def test_wrong_files(place, tmp_path, name, message):
    (tmp_path / "bad.h5").write_text("no")
    for file_name, heading in (("short.h5", np.zeros(5)), ("text.h5", np.array([b"a", b"b"]))):
        with h5py.File(tmp_path / file_name, "w") as file:
            for column in HEAD.split(","):
                file[column] = np.arange(6.0)
            del file["heading"]
            file["heading"] = heading
    assert message in problems(place(rows()), f"pattern.file={name}")


def test_a_track_needs_its_file(cessna: Aircraft):
    loaded = load_scenario("patterns/track")
    with pytest.raises(RequestError, match="is read by load_scenario only"):
        fly(loaded.scenario, cessna)

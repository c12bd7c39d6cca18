"""The folder of a sweep: its index whatever varies, and what does not belong into it."""

import json
import shutil
from pathlib import Path

import pandas as pd
import pytest

from magsim import Dataset, assets
from magsim import sweep as room
from magsim.errors import DataError, RequestError
from tests.support.sweeps import LINE, InThisProcess, sweep_file

ODD = """
[sweep]
shard = 4

[[sweep.axes]]
list = [
    { seed = 7, "sensors.scalar[0].name" = "cabin", "start.alt_m" = 1000 },
    { seed = 8, "sensors.scalar[0].name" = "seat", "start.alt_m" = 1000 },
    { seed = 9, "sensors.scalar[0].name" = "seat", "start.alt_m" = 1000000000000000000000000000000 },
]
"""
"""Flights with other seeds, other columns, and a number that no table holds."""


def odd(folder: Path) -> room.SweepPlan:
    """Read that sweep."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "odd.toml").write_text(LINE + ODD, encoding="utf-8")
    return room.read_sweep(folder / "odd.toml")


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """That sweep, flown: folder and digest."""
    folder = tmp_path_factory.mktemp("odd")
    outcome = room.fly(odd(folder), folder / "out", workers=InThisProcess())
    assert outcome is not None
    return folder / "out", outcome.digest


def test_seeds_and_sensors_that_vary_are_in_the_index(flown: tuple) -> None:
    folder, _ = flown
    index = pd.read_parquet(folder / "index.parquet")
    assert index["seed"].tolist() == [7, 8, 9]
    assert index["start.alt_m"].tolist() == ["1000", "1000", str(10**30)]
    assert index["interference_std_nt.cabin"].notna().tolist() == [True, False, False]
    assert index["interference_std_nt.seat"].notna().tolist() == [False, True, False]
    assert list(Dataset(folder, check=True).flights) == ["f00000000", "f00000001"]


def test_the_digest_does_not_depend_on_where_the_sweep_lies(flown: tuple, tmp_path: Path) -> None:
    plan = odd(tmp_path / "elsewhere")
    (folder, digest) = flown
    copy = tmp_path / "out"
    shutil.copytree(folder, copy)
    record = copy / "journal" / "00000000.json"
    table = json.loads(record.read_text(encoding="utf-8"))
    table["failed"][0]["reason"] = f"{tmp_path}/odd.toml:9: another reason"
    record.write_text(json.dumps(table), encoding="utf-8")
    outcome = room.finish(plan, room.open_folder(plan, copy, resume=True))
    assert outcome is not None
    assert outcome.digest == digest


def test_a_record_of_flights_that_are_none_of_its_file_is_named(flown: tuple, tmp_path: Path) -> None:
    folder, _ = flown
    copy = tmp_path / "out"
    shutil.copytree(folder, copy)
    record = copy / "journal" / "00000000.json"
    table = json.loads(record.read_text(encoding="utf-8"))
    table["flown"][0]["number"] = 77
    record.write_text(json.dumps(table), encoding="utf-8")
    plan = odd(tmp_path)
    with pytest.raises(DataError, match=r"journal/00000000.json: is damaged: flight 77 does not belong to this file"):
        room.finish(plan, room.open_folder(plan, copy, resume=True))


def test_what_is_no_folder_of_a_sweep_is_left_alone(tmp_path: Path) -> None:
    plan, folder = odd(tmp_path), tmp_path / "out"
    folder.mkdir()
    (folder / "notes.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(RequestError, match="out holds something else than a sweep; allowed: a new or empty folder"):
        room.open_folder(plan, folder)
    assert [entry.name for entry in folder.iterdir()] == ["notes.txt"]
    (folder / "notes.txt").rename(folder / "journal")
    with pytest.raises(RequestError, match=r"cannot write .*journal: File exists"):
        room.open_folder(plan, folder)
    (folder / "journal").unlink()
    (folder / "sweep.json").write_text("{", encoding="utf-8")
    with pytest.raises(DataError, match=r"sweep.json: is no state of a sweep: Invalid JSON.*; allowed: as magsim"):
        room.open_folder(plan, folder)


def test_a_file_that_an_axis_names_makes_another_sweep_when_it_is_edited(tmp_path: Path) -> None:
    shutil.copytree(assets.aircraft_dir("uav"), tmp_path / "mine")
    axis = '\n[[sweep.axes]]\nkey = "aircraft"\ngrid = ["c208b", "./mine"]\n'
    before = room.read_sweep(sweep_file(tmp_path, axis)).identity
    assert room.read_sweep(sweep_file(tmp_path, axis)).identity == before
    facts = tmp_path / "mine" / "magnetics.toml"
    text = facts.read_text(encoding="utf-8")
    facts.write_text(text + "\n# a comment\n", encoding="utf-8")
    assert room.read_sweep(sweep_file(tmp_path, axis)).identity == before
    facts.write_text("broken", encoding="utf-8")
    assert room.read_sweep(sweep_file(tmp_path, axis)).identity != before


def test_the_ground_that_an_axis_names_lies_beside_the_sweep(tmp_path: Path) -> None:
    (tmp_path / "scenarios").mkdir()
    (tmp_path / "scenarios" / "line.toml").write_text(LINE, encoding="utf-8")
    (tmp_path / "sweep.toml").write_text(
        '[sweep]\nscenario = "scenarios/line.toml"\n[[sweep.axes]]\nkey = "terrain"\n'
        'grid = [{ kind = "grid", file = "a.asc" }, { kind = "grid", file = "b.asc" }]\n',
        encoding="utf-8",
    )
    for name, height_m in (("a", 100), ("b", 200)):
        rows = "\n".join([" ".join([str(height_m)] * 3)] * 3)
        head = "ncols 3\nnrows 3\nxllcorner 112.5\nyllcorner 16.5\ncellsize 0.2\n"
        (tmp_path / f"{name}.asc").write_text(f"{head}{rows}\n", encoding="utf-8")
    plan = room.read_sweep(tmp_path / "sweep.toml")
    before = plan.identity
    loaded = [plan.load(flight) for flight in plan.space.flights(0, 2)]
    assert loaded[0].digest != loaded[1].digest
    (tmp_path / "b.asc").unlink()
    assert room.read_sweep(tmp_path / "sweep.toml").identity != before

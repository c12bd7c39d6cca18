"""The demo writes all its files, and replaces its own files only."""

import json

import pytest

from magsim.cli import main
from magsim.compensation import load
from magsim.experiments import demo
from magsim.recording import Recording
from magsim.simulation import simulate

FLOWN: dict[str, Recording] = {}
"""The flight of the first demo."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """One demo, run from the command line in an empty folder."""
    base = tmp_path_factory.mktemp("home")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(base)
        patch.setattr(demo, "simulate", lambda *args, **more: FLOWN.setdefault("first", simulate(*args, **more)))
        assert main(["demo", "--quiet"]) == 0
    return base / "demo"


def test_recording_networks_scores_and_figures_are_there(folder):
    recording = Recording.read(folder / "calibration_c208b.h5")
    assert recording.scalars == ("cabin",)
    for name in ("bp", "magtcn"):
        assert load(folder / name).interference(recording.blind()).shape == (len(recording),)
    for name in ("flight", "field", "interference", "spectrum", "residuals"):
        assert (folder / f"{name}.png").stat().st_size > 20_000


def test_table_ranks_every_method_between_nothing_and_the_noise(folder):
    rows = json.loads((folder / "report.json").read_text(encoding="utf-8"))["rows"]
    std = {
        row["method"]: row["value"]
        for row in rows
        if row["metric"] == "std_nt" and row["segment"] == rows[0]["segment"]
    }
    assert set(std) == {"none", "tl16", "tl18", "bp", "magtcn", "noise_floor"}
    for name in ("tl16", "tl18", "bp", "magtcn"):
        assert std["noise_floor"] < std[name] < 0.05 * std["none"]
    assert std["magtcn"] < std["tl16"]
    text = (folder / "table.txt").read_text(encoding="utf-8")
    assert all(name in text for name in std)


def test_a_second_demo_replaces_the_first(folder, capsys, monkeypatch):
    """With the flight and the networks of the first: that these are the same again is tested where they are made."""
    networks = {name: load(folder / name) for name in ("bp", "magtcn")}
    monkeypatch.setattr(demo, "simulate", lambda *_, **__: FLOWN["first"])
    monkeypatch.setattr(demo, "_train", lambda name, *_: networks[name])
    (folder / "flight.png").unlink()
    receipt = json.loads((folder / "demo.json").read_text(encoding="utf-8"))
    assert set(receipt["files"]) >= {"calibration_c208b.h5", "report.json", "magtcn/weights.safetensors"}
    assert main(["demo", "--quiet", "-o", str(folder)]) == 0
    assert (folder / "flight.png").exists()
    assert str(folder / "report.json") in capsys.readouterr().out
    assert json.loads((folder / "demo.json").read_text(encoding="utf-8")) == receipt


def test_files_of_others_stay_and_are_named(tmp_path, capsys):
    (tmp_path / "thesis.txt").write_text("mine", encoding="utf-8")
    assert main(["demo", "--quiet", "-o", str(tmp_path)]) == 2
    assert "thesis.txt" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]


def test_a_demo_file_that_was_changed_since_is_not_replaced(tmp_path, capsys):
    (tmp_path / "table.txt").write_text("edited", encoding="utf-8")
    (tmp_path / "demo.json").write_text('{"demo": 1, "files": {"table.txt": "0000"}}', encoding="utf-8")
    assert main(["demo", "--quiet", "-o", str(tmp_path)]) == 2
    assert "table.txt" in capsys.readouterr().err
    assert (tmp_path / "table.txt").read_text(encoding="utf-8") == "edited"


def test_output_that_is_a_file_is_refused(tmp_path, capsys):
    target = tmp_path / "taken"
    target.write_text("x", encoding="utf-8")
    assert main(["demo", "--quiet", "-o", str(target)]) == 2
    assert str(target) in capsys.readouterr().err

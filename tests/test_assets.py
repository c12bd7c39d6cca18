"""What is shipped is found, by name from anywhere, and never written to."""

from pathlib import Path

import pytest

from magsim import assets
from magsim.errors import RequestError


def test_the_shipped_aircraft_and_scenarios_are_listed():
    assert "c208b" in assets.list_aircraft()
    assert {"calibration_c208b", "calibration_c208b_cloverleaf", "papers/000_simulated"} <= set(assets.list_scenarios())


@pytest.mark.parametrize(
    "name",
    ["calibration_c208b", "calibration_c208b.toml", "scenarios/calibration_c208b.toml", Path("calibration_c208b")],
)
def test_a_scenario_is_found_by_name_from_another_folder(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert assets.scenario_path(name).samefile(assets.ROOT / "scenarios" / "calibration_c208b.toml")


def test_nested_names(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert assets.scenario_path("papers/000_simulated").name == "000_simulated.toml"


def test_an_existing_file_takes_precedence(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "calibration_c208b").write_text("")
    (tmp_path / "own.toml").write_text("")
    assert assets.scenario_path("calibration_c208b") == Path("calibration_c208b")
    assert assets.scenario_path(tmp_path / "own.toml") == tmp_path / "own.toml"


def test_a_folder_of_the_same_name_is_no_scenario(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "calibration_c208b").mkdir()
    assert assets.scenario_path("calibration_c208b").is_file()


@pytest.mark.parametrize(
    ("name", "text"),
    [
        (
            "calibration_c208",
            "there is no such file, and no shipped scenario has that name (did you mean 'calibration_c208b'?)",
        ),
        ("../../no/scenario", "../../no/scenario: there is no such file"),
        ("", "'': it is a folder, and no shipped scenario has that name"),
        ("a\0b", r"'a\x00b': there is no such file"),
        ("x" * 5000, "there is no such file"),
    ],
)
def test_scenarios_that_do_not_exist(name, text):
    with pytest.raises(RequestError) as caught:
        assets.scenario_path(name)
    assert text in str(caught.value)
    assert "shipped: calibration_c208b, " in str(caught.value)
    assert len(str(caught.value)) < 900


@pytest.mark.parametrize("path", ["./mine", "mine/", Path("mine"), "../here/mine"])
def test_an_own_aircraft_is_a_path(path, tmp_path, monkeypatch):
    folder = tmp_path / "here" / "mine"
    folder.mkdir(parents=True)
    monkeypatch.chdir(folder.parent)
    for file in assets.AIRCRAFT_FILES:
        (folder / file).write_text("")
    assert assets.aircraft_dir(path).samefile(folder)
    monkeypatch.chdir(tmp_path)
    assert assets.aircraft_dir(path, folder.parent).samefile(folder)


@pytest.mark.parametrize(
    ("path", "text"),
    [
        (
            "./nope",
            "nope: there is no such folder; allowed: a folder with facts.toml and magnetics.toml, or the name of",
        ),
        ("./half", "half: has no magnetics.toml; allowed: "),
        ("./half/facts.toml", "facts.toml: there is no such folder"),
        ("./a\0b", r"'a\x00b': there is no such folder"),
        ("./" + "x" * 5000, "there is no such folder"),
    ],
)
def test_incomplete_own_aircraft(path, text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "half").mkdir()
    (tmp_path / "half" / "facts.toml").write_text("")
    with pytest.raises(RequestError) as caught:
        assets.aircraft_dir(path)
    assert text in str(caught.value)
    assert len(str(caught.value)) < 400


@pytest.mark.parametrize("name", ["c208", "", "."])
def test_aircraft_that_do_not_exist(name):
    with pytest.raises(RequestError, match=r"there is no aircraft '.*'; allowed: .*c208b"):
        assets.aircraft_dir(name)

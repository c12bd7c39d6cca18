"""``magsim benchmark``, from the files to the exit codes."""

import json

import pytest

from magsim.compensation import registry
from magsim.compensation.networks import BPCompensator
from tests.support.commands import run

pytestmark = pytest.mark.usefixtures("own_folder")


def test_benchmark_of_names_and_runs(flight, tmp_path, capsys):
    assert run(capsys, "train", "tl18", flight, "-q", "-o", "runs/mine")[0] == 0
    code, out, err = run(capsys, "benchmark", flight, "--methods", "none,tl18,runs/mine,noise_floor", "-o", "report")
    assert code == 0
    assert "fitting tl18" in err
    lines = {line.split()[0]: line.split() for line in out.splitlines() if line}
    assert lines["mine"][1:9] == lines["tl18"][1:9]
    assert lines["none"][2] == "1.00"
    assert {p.name for p in (tmp_path / "report").iterdir()} == {"report.json", "table.txt", "table.csv"}
    code, _, err = run(capsys, "benchmark", flight, "-q", "-o", "report")
    assert code == 2
    assert "--force replaces it" in err


def test_benchmark_of_methods_with_settings_and_chosen_tables(flight, tmp_path, capsys):
    methods = "none, tl16_gradient:order=0:vertical=false,tl16_gradient:order=1,bp:hidden=[3,2]:steps=2:hold_out=blocks"
    code, out, _ = run(capsys, "benchmark", flight, "-q", "--methods", methods, "--scores", "ir_003,ir", "-o", "report")
    assert code == 0
    assert out.count("\ntl16_gradient:order=0:vertical=false ") == 3
    assert out.count("\nbp:hidden=[3,2]:steps=2:hold_out=blocks ") == 3
    assert "paper 002's ratio of the reading, above 0.03 Hz, by heading" in out
    assert "improvement ratio against truth, in band, by heading" in out
    assert "STD in band" not in out
    header = next(line for line in out.splitlines() if "heading 270" in line)
    assert header.split("  ")[0] == "method"
    text = (tmp_path / "report" / "table.txt").read_text()
    assert "paper 002's ratio of the reading, above 0.03 Hz, by heading" in text
    about = json.loads((tmp_path / "report" / "report.json").read_text())["about"]["methods"]
    assert about["tl16_gradient:order=1"]["params"]["order"] == 1
    assert about["tl16_gradient:order=1"]["params"]["vertical"] is True


def test_benchmark_of_all_methods_quickly(flight, capsys, monkeypatch):
    few = {name: registry._REGISTRY[name] for name in ("none", "tl16", "vector_tl", "tl16_auxiliary")}
    monkeypatch.setattr(registry, "_REGISTRY", few | {"bp": registry.Entry(BPCompensator)})
    monkeypatch.setattr(BPCompensator, "presets", {"quick": {"steps": 2, "hidden": (3,)}})
    code, out, _ = run(capsys, "benchmark", flight, "-q", "--methods", "all", "--quick", "--json")
    assert code == 0
    report = json.loads(out)
    assert report["about"]["methods"]["bp"]["params"]["hidden"] == [3]
    assert {row["method"] for row in report["rows"]} == {"none", "tl16", "vector_tl", "bp", "noise_floor"}
    assert [note for note in report["notes"] if "tl16_auxiliary is left out" in note]


def test_benchmark_prints_json_alone(flight, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(flight.parent)
    code, out, _ = run(capsys, "benchmark", "--json", "-o", tmp_path / "report")
    assert code == 0
    report = json.loads(out)
    assert {row["method"] for row in report["rows"]} == {"none", "tl16", "tl18", "noise_floor"}
    assert (tmp_path / "report" / "report.json").read_text() == out


@pytest.mark.parametrize(
    ("args", "expected"),
    [
        (("--methods", "tl61"), "unknown method 'tl61'"),
        (("--methods", ","), "no method is named"),
        (("--methods", "some/where"), "some/where holds no fitted method"),
        (("--methods", "tl61:order=1"), "unknown method 'tl61'"),
        (
            ("--methods", "none,tl16_gradient:order=5"),
            "method tl16_gradient: order: 5 is not allowed; allowed: a whole",
        ),
        (("--methods", "tl16_gradient:vertical=yes"), "vertical: 'yes' is text; allowed: true or false"),
        (("--methods", "tl16_gradient:vertcal=true"), "vertcal: unknown key (did you mean 'vertical'?)"),
        (("--methods", "tl16_gradient:order=1:order=2"), "order is given twice"),
        (("--methods", "tl16_gradient:target=interference"), "target is 'measured' by its name"),
        (("--methods", "tl16:scale=sample,tl16:scale=sample"), "method tl16:scale=sample is given twice"),
        (("--scores", "ir_03"), "there is no table of 'ir_03' (did you mean 'ir_003'?); allowed: std_nt, ir,"),
        (("--scores", ","), "no score is named; allowed: std_nt"),
        (("--sensor", "wing"), "no scalar magnetometer 'wing'"),
    ],
)
def test_what_cannot_be_benchmarked_is_refused(flight, capsys, args, expected):
    code, out, err = run(capsys, "benchmark", flight, *args)
    assert code == 2
    assert out == ""
    assert expected in err


OWN = """\
import numpy as np

from magsim import Compensator


class Mean(Compensator):
    name = "mean"

    def __init__(self, factor: float = 1.0):
        self.factor = factor

    def learn(self, training, context):
        self.mean_ = float(np.mean([np.mean(r[f"interference_{training.sensor}_nt"]) for r in training.recordings]))

    def estimate(self, recording):
        return np.full(len(recording), self.factor * self.mean_)
"""


def test_a_class_of_ones_own_is_trained_and_compared(flight, tmp_path, capsys):
    (tmp_path / "mine.py").write_text(OWN)
    code, out, _ = run(capsys, "benchmark", flight, "-q", "--methods", "none,mine.py:Mean,mine.py:Mean:factor=0")
    assert code == 0
    lines = {line.split()[0]: line.split() for line in out.splitlines() if line}
    # a constant is nothing in band, and broadband it is
    assert lines["mine.py:Mean:factor=0"][1:9] == lines["none"][1:9]
    assert float(lines["mine.py:Mean"][3]) < float(lines["none"][3])
    assert run(capsys, "train", "mine.py:Mean", flight, "-q")[0] == 0
    assert (tmp_path / "runs" / "Mean" / "compensator.json").is_file()
    code, out, _ = run(capsys, "benchmark", flight, "-q", "--methods", "mine.py:Mean,runs/Mean")
    assert code == 0
    lines = {line.split()[0]: line.split() for line in out.splitlines() if line}
    assert lines["Mean"][1:9] == lines["mine.py:Mean"][1:9]
    code, _, err = run(capsys, "benchmark", flight, "--methods", "mine.py:Men")
    assert code == 2
    assert "mine.py: has no compensator 'Men'" in err


def test_runs_of_one_name_are_told_apart_by_their_folders(flight, capsys):
    for folder in ("a/run", "b/run"):
        assert run(capsys, "train", "tl16", flight, "-q", "-o", folder)[0] == 0
    code, out, _ = run(capsys, "benchmark", flight, "-q", "--methods", "a/run,b/run")
    assert code == 0
    lines = {line.split()[0]: line.split() for line in out.splitlines() if line}
    assert lines["a/run"][1:] == lines["b/run"][1:]
    assert "given as fitted: a/run, b/run" in out

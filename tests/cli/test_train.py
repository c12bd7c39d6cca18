"""``magsim train``, from the files to the exit codes."""

import json
from contextlib import contextmanager

import numpy as np
import pytest

from magsim.cli import progress as module
from magsim.compensation import load
from magsim.recording import read_recordings
from tests.support.commands import run
from tests.support.worlds import World, calibration

pytestmark = pytest.mark.usefixtures("own_folder")

CONFIG = """\
method = "bp"
seed = 3
[params]
optimizer = "adam"
weight_decay = 0.0
steps = 20
every = 10
batch = 2
hidden = [4]
learning_rate = 0.001
"""

NET = """
from torch import nn


def Net(channels, window):
    return nn.Sequential(nn.Flatten(), nn.Linear(channels * window, 1))
"""


def test_closed_form_and_its_report(flight, tmp_path, capsys):
    code, out, _ = run(capsys, "train", "tl16", flight)
    assert code == 0
    assert "B u1 u1" in out
    assert "ridge weight" in out
    folder = tmp_path / "runs" / "tl16"
    assert {p.name for p in folder.iterdir()} == {"run.json", "compensator.json", "arrays.npz"}
    about = json.loads((folder / "run.json").read_text())
    (rows,) = about["rows"]
    assert rows["recording"] == "world"
    assert rows["first_last_rows"] == [[0.0, 639.9, 6400]]
    assert rows["valid_rows"] == 1600
    assert str(tmp_path) not in (folder / "run.json").read_text()


def test_network_from_a_file_with_progress_and_the_same_bytes_twice(flight, tmp_path, capsys):
    (tmp_path / "bp.toml").write_text(CONFIG)
    for name in ("one", "two"):
        code, _, err = run(capsys, "train", "bp.toml", flight.parent, "-o", tmp_path / name)
        assert code == 0
        assert err == ""  # no terminal
    names = {p.name for p in (tmp_path / "one").iterdir()}
    assert names == {"run.json", "compensator.json", "arrays.npz", "weights.safetensors", "log.csv"}
    for name in names - {"log.csv"}:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
    assert json.loads((tmp_path / "one" / "run.json").read_text())["seed"] == 3


def test_existing_runs_are_not_touched(flight, tmp_path, capsys):
    (tmp_path / "bp.toml").write_text(CONFIG)
    args = ("train", "bp.toml", flight, "-o", tmp_path / "run", "-q")
    assert run(capsys, *args)[0] == 0
    before = (tmp_path / "run" / "compensator.json").stat().st_mtime_ns
    code, _, err = run(capsys, *args)
    assert code == 2
    assert "holds a run already: --resume continues a run, --force replaces it" in err
    code, _, err = run(capsys, *args, "--resume")
    assert code == 0
    assert "complete" in err
    code, _, err = run(capsys, *args, "--resume", "--seed", "4")
    assert code == 2
    assert "other settings or recordings" in err
    assert (tmp_path / "run" / "compensator.json").stat().st_mtime_ns == before
    assert run(capsys, *args, "--force")[0] == 0
    code, _, err = run(capsys, "train", "tl16", flight, "-o", tmp_path / "new", "--resume")
    assert code == 2
    assert "no run to resume" in err


def test_a_run_that_was_broken_off_is_resumed(flight, tmp_path, capsys, monkeypatch):
    (tmp_path / "bp.toml").write_text(CONFIG)
    assert run(capsys, "train", "bp.toml", flight, "-o", tmp_path / "whole", "-q")[0] == 0
    shown = module.training

    @contextmanager
    def breaks(*, quiet):
        def report(progress):
            if progress.step == 10:
                raise KeyboardInterrupt

        yield report

    monkeypatch.setattr(module, "training", breaks)
    code, _, _ = run(capsys, "train", "bp.toml", flight, "-o", tmp_path / "run")
    assert code == 130
    assert (tmp_path / "run" / "checkpoint").is_dir()
    monkeypatch.setattr(module, "training", shown)
    begun = (tmp_path / "run" / "log.csv").read_text().splitlines()[1]
    code, _, _ = run(capsys, "train", "bp.toml", flight, "-o", tmp_path / "run", "--resume")
    assert code == 0
    assert begun in (tmp_path / "run" / "log.csv").read_text()  # with its seconds: it was not begun anew
    for path in (tmp_path / "whole").iterdir():
        if path.name != "log.csv":  # it has the time that was spent
            assert (tmp_path / "run" / path.name).read_bytes() == path.read_bytes()
    logs = [(tmp_path / name / "log.csv").read_text().splitlines() for name in ("whole", "run")]
    without_seconds = [[line.split(",")[:2] + line.split(",")[3:] for line in log] for log in logs]
    assert without_seconds[0] == without_seconds[1]
    assert not (tmp_path / "run" / "checkpoint").exists()


def test_a_torch_module_of_ones_own(flight, tmp_path, capsys):
    """Trained, kept, and loaded once its file is named."""
    (tmp_path / "my_net.py").write_text(NET)
    assert run(capsys, "train", "my_net.py:Net:window=4:steps=4:every=2", flight, "-q")[0] == 0
    folder = tmp_path / "runs" / "Net"
    assert {p.name for p in folder.iterdir()} >= {"run.json", "compensator.json", "arrays.npz", "weights.safetensors"}
    assert json.loads((folder / "compensator.json").read_text())["method"] == "my_net.py:Net"
    recording = read_recordings(flight)[0].take(slice(0, 50))
    assert np.isfinite(load(folder).interference(recording)[3:]).all()
    code, _, err = run(capsys, "train", "my_net.py:Net:out=seq", flight, "-o", tmp_path / "other", "-q")
    assert code == 2
    assert "my_net.py:Net returned shape (2, 1) for windows of shape (2, 20, 320); allowed with out 'seq'" in err
    assert not (tmp_path / "other").exists()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('method = "bpp"', "bp.toml:1: method: 'bpp' is not allowed; allowed: 'none'"),
        ('method = "bp"\nsed = 1', "bp.toml:2: sed: unknown key (did you mean 'seed'?)"),
        ('method = "bp"\n[params]\nsteps = 0', "bp.toml:3: params.steps: 0 is not allowed"),
        ('method = "bp"\n[params]\nhiden = [3]', "bp.toml:3: params.hiden: unknown key (did you mean 'hidden'?)"),
        ('method = "bp"\ndevice = "gpu"', "bp.toml:2: device: 'gpu' is not allowed"),
        ('method = "bp"\nseeds = [1, -2]', "bp.toml:2: seeds[1]: -2 is not allowed"),
        ("method = ", "bp.toml:1: is not TOML"),
    ],
)
def test_what_is_wrong_in_the_file_is_reported_with_its_line(flight, tmp_path, capsys, text, expected):
    (tmp_path / "bp.toml").write_text(text)
    code, _, err = run(capsys, "train", "bp.toml", flight)
    assert code == 2
    assert expected in err
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize(
    ("args", "code", "expected"),
    [
        (("tl61",), 2, "unknown method 'tl61' (did you mean 'tl18'?)"),
        (("tl16", "--sensor", "wing"), 2, "no scalar magnetometer 'wing'; it has cabin"),
        (("tl16", "--preset", "quick"), 2, "method tl16 has no preset 'quick'; it has none"),
        (("magtcn", "--preset", "qick"), 2, "no preset 'qick' (did you mean 'quick'?); it has default, quick, paper"),
        (("none.toml",), 2, "none.toml"),
        (("tl16", "--seed", "-1"), 2, "seed"),
        (("tl16:ordr=1",), 2, "method tl16: ordr: unknown key (did you mean 'order'?)"),
        (("tl16:preset=demo",), 2, "method tl16 has no preset 'demo'; it has none"),
        (("tl16", "--device", "auto"), 2, "device: method tl16 is not trained in steps, so that it has no effect"),
        (("bp", "--device", "gpu"), 2, "device 'gpu' is not allowed; allowed: cpu, cuda, cuda:0, cuda:1, ..., auto"),
        (("bp", "--freeze", "a*"), 2, "freeze ('a*',) is not allowed; allowed: beside init"),
        (("bp", "--init", "nothing"), 2, "nothing holds no fitted method"),
        (("bpnn", "--precision", "bf16"), 2, "precision bf16: on a CPU it is slower than float32"),
        (("tl16", "--seeds", "1,2"), 2, "--seeds has no effect: method tl16 is not trained in steps"),
        (("bp", "--seeds", "1,1"), 2, "'1,1' is not allowed; allowed: whole numbers of 0 or more by comma"),
        (("bp", "--seeds", "1", "--seed", "2"), 2, "--seed 2 and --seeds exclude each other"),
        (("bp", "--workers", "2"), 2, "--workers 2 has no effect without --seeds"),
        (("tl16:scale",), 2, "method tl16:scale: 'scale' is not of the form key=value"),
    ],
)
def test_what_is_asked_wrong_is_refused_and_nothing_is_left(flight, tmp_path, capsys, *, args, code, expected):
    got, _, err = run(capsys, "train", args[0], flight, *args[1:])
    assert got == code
    assert expected in err
    assert not (tmp_path / "runs" / "tl16").exists()


def test_files_that_are_no_recordings(tmp_path, capsys):
    assert run(capsys, "train", "tl16", "nix.h5")[0] == 2
    (tmp_path / "bad.h5").write_bytes(b"no recording")
    assert run(capsys, "train", "tl16", "bad.h5")[0] == 3
    (tmp_path / "taken").write_text("a file")
    short = calibration(World(circuits=1)).take(slice(0, 500))
    short.write(tmp_path / "short.h5")
    code, _, err = run(capsys, "train", "tl16", "short.h5", "-o", "new")
    assert code == 3
    assert "needs at least 160 training rows" in err
    assert not (tmp_path / "new").exists()
    code, _, err = run(capsys, "train", "tl16", "short.h5", "-o", "taken")
    assert code == 2


def test_a_method_with_settings_is_trained(flight, tmp_path, capsys):
    code, out, _ = run(capsys, "train", "tl16_gradient:order=1", flight)
    assert code == 0
    assert "gradient of the Earth's field, about latitude and longitude" in out
    assert "tl16_gradient for cabin, 6400 rows" in out
    about = json.loads((tmp_path / "runs" / "tl16_gradient" / "run.json").read_text())
    assert (about["method"], about["params"]["order"], about["params"]["vertical"]) == ("tl16_gradient", 1, True)
    (tmp_path / "g.toml").write_text('method = "tl16_gradient"\n[params]\norder = 1\n')
    assert run(capsys, "train", "g.toml", flight, "-q", "-o", "file")[0] == 0
    for name in ("run.json", "compensator.json", "arrays.npz"):
        assert (tmp_path / "file" / name).read_bytes() == (tmp_path / "runs" / "tl16_gradient" / name).read_bytes()
    code, out, _ = run(capsys, "benchmark", flight, "-q", "--methods", "runs/tl16_gradient,tl16_gradient:order=1")
    lines = {line.split()[0]: line.split() for line in out.splitlines() if line}
    assert lines["tl16_gradient"][1:11] == lines["tl16_gradient:order=1"][1:11]


def test_several_seeds_at_once_have_a_folder_each(flight, tmp_path, capsys):
    (tmp_path / "bp.toml").write_text(CONFIG.replace("seed = 3", "seeds = [3, 5]"))
    code, _, err = run(capsys, "train", "bp.toml", flight, "-o", tmp_path / "runs", "--workers", "2")
    assert code == 0, err
    folders = [tmp_path / "runs" / f"seed_{seed}" for seed in (3, 5)]
    assert [json.loads((folder / "run.json").read_text())["seed"] for folder in folders] == [3, 5]
    for folder, seed in zip(folders, (3, 5), strict=True):
        assert f"seed {seed}: {folder}: bp for cabin" in err
    (tmp_path / "alone.toml").write_text(CONFIG)
    assert run(capsys, "train", "alone.toml", flight, "-o", tmp_path / "alone", "-q")[0] == 0
    alone, same, other = (path / "weights.safetensors" for path in (tmp_path / "alone", *folders))
    assert alone.read_bytes() == same.read_bytes() != other.read_bytes()

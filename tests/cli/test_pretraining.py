"""``magsim train`` on a folder of flights that do not fit into memory together, and the adaptation to one of them."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

from magsim.compensation import load
from magsim.recording import file, write_recordings
from tests.support.commands import run
from tests.support.worlds import World, calibration

pytestmark = pytest.mark.usefixtures("own_folder")

CONFIG = """\
method = "bp"
[params]
optimizer = "adam"
weight_decay = 0.0
stage_for = "flight"
hold_out = "individuals"
folds = 3
hidden = [4]
batch = 4
steps = 160
every = 20
patience = 20
"""


@pytest.fixture
def folder(tmp_path):
    """Three individuals in two shards; the rows of circuit 1 have splits, and all are for training or validation."""
    path = tmp_path / "bank"
    path.mkdir()
    flown = [calibration(World(circuits=1), seed) for seed in (0, 1, 2)]
    told = [
        replace(flight, name=f"f{number}", meta={**flight.meta, "aircraft": "x", "individual": number})
        for number, flight in enumerate(flown)
    ]
    write_recordings(path / "shard_0.h5", told[:2])
    write_recordings(path / "shard_1.h5", told[2:])
    (tmp_path / "many.toml").write_text(CONFIG)
    return path


def test_pretraining_is_killed_and_resumed_and_a_start_for_one_flight(folder, tmp_path, capsys):
    code, out, err = run(capsys, "train", "many.toml", folder, "-o", "whole")
    assert (code, err) == (0, "")
    assert "a start for others: adapt it to a calibration flight with --init" in out
    assert "whole: bp for cabin, 19200 rows" in out
    assert {path.name for path in (tmp_path / "whole").iterdir()} == {
        "run.json", "log.csv", "compensator.json", "arrays.npz", "weights.safetensors"
    }  # fmt: skip
    rows = json.loads((tmp_path / "whole" / "run.json").read_text())["rows"]
    assert [(row["recording"], row["valid_rows"]) for row in rows] == [("f0", 1600), ("f1", 1600), ("f2", 1600)]

    command = [sys.executable, "-m", "magsim", "train", "many.toml", str(folder), "-o", "killed"]
    with subprocess.Popen(command, cwd=tmp_path) as process:
        while not list((tmp_path / "killed").glob("checkpoint/fold_1/step_*[1-9]*.pt")):
            assert process.poll() is None
            time.sleep(0.01)
        os.kill(process.pid, signal.SIGKILL)
    assert process.returncode == -signal.SIGKILL
    assert {path.name for path in (tmp_path / "killed").iterdir()} == {"run.json", "log.csv", "checkpoint"}
    assert run(capsys, "train", "many.toml", folder, "-o", "killed", "--resume")[0] == 0
    for name in ("run.json", "compensator.json", "arrays.npz", "weights.safetensors"):
        assert (tmp_path / "killed" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()
    assert not (tmp_path / "killed" / "checkpoint").exists()

    calibration(World(), 5).write(tmp_path / "new.h5")
    code, _, err = run(capsys, "benchmark", "new.h5", "--methods", "whole")
    assert code == 2
    assert "adapt it to a calibration flight: magsim train bp FLIGHT --init RUN" in err

    short = CONFIG.replace('stage_for = "flight"\nhold_out = "individuals"\n', "").replace("160", "10")
    (tmp_path / "one.toml").write_text(short)
    code, out, _ = run(capsys, "train", "one.toml", "new.h5", "-o", "adapted", "--init", "whole")
    assert code == 0
    assert "a start for others" not in out
    assert np.isfinite(load(tmp_path / "adapted").interference(calibration(World(), 5))).all()


def test_what_is_refused_leaves_nothing(folder, tmp_path, capsys):
    meta = {"aircraft": "x", "individual": 3}
    bad = replace(calibration(World(circuits=1), 3).take(slice(0, 500)), name="short", meta=meta)
    bad.write(folder / "shard_2.h5")
    code, _, err = run(capsys, "train", "many.toml", folder, "-o", "run")
    assert code == 3
    assert err.count("\n") == 1
    assert "recording 'short' is too short" in err
    assert not (tmp_path / "run").exists()


def test_settings_are_refused_before_any_flight_is_read(folder, capsys, monkeypatch):
    def refuse(_path, _number):
        raise AssertionError

    monkeypatch.setattr(file, "read_number", refuse)
    code, _, err = run(capsys, "train", "bpnn:stage_for=flight", folder)
    assert code == 2
    assert err.startswith("hold_out 'blocks' is not allowed with stage_for 'flight'")

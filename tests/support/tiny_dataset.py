"""A data set of three short flights, and what its tests share."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from magsim.cli import main
from magsim.generation import builder as building
from magsim.generation import flying
from magsim.recording import Recording

SCENARIO = """\
schema = 1
seed = 5
aircraft = "c208b"
[start]
lat_deg = 16.7
lon_deg = 112.7
alt_m = 3000.0
speed_mps = 75.0
heading_deg = 60.0
[pattern]
kind = "straight"
leg_m = 3_000.0
lead_s = 0.0
[field.memory]
enabled = false
[[sensors.scalar]]
name = "cabin"
mount = "cabin_center"
[recording]
train_circuits = [1]
valid_legs = []
"""

RECIPE = """\
schema = 1
title = "Tiny"
description = "Three short lines."
date = 2026-01-02
keywords = ["lines"]
uses = ["Tests."]
limits = ["Nothing can be learned from it."]
samples = 30

[[shards]]
name = "one"
note = "both"
flights = [
    { name = "learn", scenario = "line.toml", splits = ["train"] },
    { name = "judge", scenario = "line.toml", set = ["seed=6", "recording.train_circuits=[]"], splits = ["test"] },
]

[[shards]]
name = "two"
set = ["recording.train_circuits=[]"]
flights = [{ name = "more", scenario = "line.toml", set = ["seed=7"], splits = ["test"] }]
"""

FLOWN: dict[str, Recording] = {}
"""The flights of the recipe ``tiny``, by name."""

ELSEWHERE = "1.0 of another machine"


def write_recipe(folder: Path) -> Path:
    folder.mkdir()
    (folder / "line.toml").write_text(SCENARIO)
    (folder / "recipe.toml").write_text(RECIPE)
    return folder


def elsewhere(monkeypatch) -> None:
    """Let the machine that builds be of another kind than that of the manifest."""
    real = building.fingerprint()
    monkeypatch.setattr(building, "fingerprint", lambda: real | {"numpy": ELSEWHERE})


def change(monkeypatch, name: str, column: str, how) -> None:
    """Change one column of one flight."""
    before = flying.fly

    def fly(task) -> Recording:
        recording = before(task)
        if task.name != name:
            return recording
        values = np.array(recording[column])
        how(values)
        return replace(recording, data={**recording.data, column: values})

    monkeypatch.setattr(flying, "fly", fly)


def run(capsys, *args: str) -> tuple[int, str, str]:
    code = main(["dataset", *args])
    out = capsys.readouterr()
    assert "Traceback" not in out.err
    return code, out.out, out.err


def bytes_of(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}

"""What is hardly meant is told on stderr; the command succeeds."""

from pathlib import Path

import numpy as np
import pytest

from magsim import cli
from magsim.recording import Recording


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_info_warns_of_each_flight(capsys: pytest.CaptureFixture[str]) -> None:
    n = 50
    columns = {"mag_cabin_nt": np.zeros(n), "mag_cabin_valid": (np.arange(n) >= 40).astype(float)}
    Recording("odd\x1b[31m", np.arange(n) / 10.0, columns | {"interference_cabin_nt": np.full(n, 3e4)}, {}).write(
        "f.h5"
    )
    assert cli.main(["info", "f.h5"]) == 0
    shown = capsys.readouterr()
    lines = shown.err.splitlines()
    assert lines[0] == "warning: odd\\x1b[31m: cabin reads on 20 % of the rows, the first 40 are 0 nT"
    assert lines[1].startswith(
        "warning: odd\\x1b[31m: interference of 30000 nT at cabin; survey aircraft have 10000 nT"
    )
    assert len(lines) == 2
    assert "warning" not in shown.out


def test_generate_warns_and_writes(capsys: pytest.CaptureFixture[str]) -> None:
    """On lines north and south the field is across an axis to the right, 20 degrees from one straight down."""
    settings = ["sensors.scalar[0].preset=cs_vapor", "sensors.scalar[0].axis_b=[0.0, 1.0, 0.0]"]
    args = [part for text in settings for part in ("--set", text)]
    assert cli.main(["generate", "patterns/track", "-q", "-o", "odd.h5", *args]) == 0
    told = capsys.readouterr().err
    assert told.startswith("warning: track: cabin reads on ")
    assert "axis_b = [" in told
    assert cli.main(["info", "odd.h5"]) == 0
    assert capsys.readouterr().err == told
    axis = told.split("axis_b = ")[1].split("]")[0] + "]"
    better = ["--set", settings[0], "--set", f"sensors.scalar[0].axis_b={axis}"]
    assert cli.main(["generate", "patterns/track", "-q", "-o", "good.h5", *better]) == 0
    assert capsys.readouterr().err == ""


def test_a_shipped_scenario_does_not_warn(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["generate", "patterns/track", "-q", "-o", "f.h5"]) == 0
    assert capsys.readouterr().err == ""

"""What bars show: the stages of a flight, and what is computed for the first time."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from magsim import cli
from magsim.cli import progress as bars
from magsim.training import Progress


@pytest.fixture
def shown(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, float]]:
    """What a terminal would show as bars."""
    seen: list[tuple[str, float]] = []

    @contextmanager
    def stages(*, quiet: bool = False) -> Iterator[Callable[[str, float], None]]:
        del quiet
        yield lambda stage, share: seen.append((stage, share))

    monkeypatch.setattr(bars, "stages", stages)
    return seen


def test_generate_shows_what_the_first_flight_of_a_type_computes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, shown: list[tuple[str, float]]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MAGSIM_CACHE", str(tmp_path / "cache"))
    mounts = ["sensors.scalar[0].mount=nose_boom", "sensors.fluxgate[0].mount=nose_fluxgate"]
    settings = [part for text in ("aircraft=uav", *mounts) for part in ("--set", text)]
    flight = ["generate", "patterns/track", "-q", "--force", *settings]
    assert cli.main(flight) == 0
    computed = [stage for stage, share in shown if share == 1.0 and stage not in {"flight", "field", "sensors"}]
    assert computed[-1] == "response"
    assert {"steel", "response"} <= set(computed)
    assert ("response", 0.0) in shown
    shown.clear()
    assert cli.main(flight) == 0
    assert {stage for stage, _ in shown} == {"flight", "field", "sensors"}


def test_training_is_shown_on_a_terminal_alone(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def show(*, quiet: bool = False) -> str:
        with bars.training(quiet=quiet) as report:
            report(Progress("fold 1", 10, 40, 0.5, 0.25, 0.125, 7.0, 3.0, 1e-3))
        return capsys.readouterr().err

    monkeypatch.setattr(sys.stderr, "isatty", lambda: False)
    assert show() == ""
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "140")
    assert show(quiet=True) == ""
    with bars.training() as report:
        report(Progress("stages", 30, 40, *[float("nan")] * 6))
    text = capsys.readouterr().err
    assert "stages" in text
    assert "30/40" in text
    assert "flights read" in text
    text = show()
    for part in ("fold 1", "10/40", "loss 0.5, in band 0.2500 nT (best 0.1250), ETA 7 s"):
        assert part in text

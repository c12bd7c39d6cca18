"""Compiled functions: kept by all their sources, usable where nothing can be written."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from magsim.flight.path import turns
from magsim.flight.pilot import ticks
from magsim.flight.tow import coupled
from magsim.storage.compiled import KEEP, SourcesLocator, compiled
from magsim.storage.sources import dependencies
from tests.support.paths import ROOT

BEND = (
    "from magsim.flight.path.turns import bend; print(bend(500.0, 2000.0, 300.0, 1000.0, 1.7), bend.stats.cache_path)"
)


def bent(cache: str) -> str:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "MAGSIM_CACHE": cache}
    return subprocess.run(
        [sys.executable, "-c", BEND], env=environment, check=True, capture_output=True, text=True
    ).stdout


def test_compiled_functions_work_without_a_cache_that_can_be_written_to(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("no folder", encoding="ascii")
    assert bent(str(file / "cache")) == "(0.35, 0.001) None\n"


def test_compiled_functions_are_kept_in_magsims_cache(tmp_path: Path) -> None:
    first = bent(str(tmp_path))
    assert first.startswith(f"(0.35, 0.001) {tmp_path}")
    kept = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.nbc")}
    assert kept
    assert bent(str(tmp_path)) == first
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.nbc")} == kept


@pytest.mark.parametrize(
    ("function", "needs"),
    [
        (ticks.tick, ("flight/pilot/steering.py", "flight/path/turns.py", "flight/path/wind.py", "units.py")),
        (turns.bend, ("flight/path/turns.py",)),
        (coupled.advance, ("flight/tow/chain.py", "flight/tow/dynamics.py")),
    ],
)
def test_an_entry_belongs_to_the_sources_of_everything_that_is_called(
    function: Callable[..., object], needs: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MAGSIM_CACHE", str(tmp_path))
    assert set(needs) <= set(dependencies(function.__module__))
    locator = SourcesLocator.from_function(function.py_func, "")
    assert locator is not None
    assert locator.get_source_stamp()[:16] in locator.get_cache_path()


def test_old_entries_are_dropped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MAGSIM_CACHE", str(tmp_path))
    for number in range(KEEP + 5):
        (tmp_path / "compiled" / f"old-{number}").mkdir(parents=True)
    SourcesLocator.from_function(turns.bend.py_func, "")
    assert len([*(tmp_path / "compiled").iterdir()]) == KEEP


def test_a_division_by_zero_gives_infinity() -> None:
    @compiled
    def inverse(x: float) -> float:
        return 1.0 / x

    assert inverse(0.0) == float("inf")

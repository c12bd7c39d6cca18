"""What bars show: the stages of a flight, and what is computed for the first time."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from magsim import cli
from magsim.cli import progress as bars


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

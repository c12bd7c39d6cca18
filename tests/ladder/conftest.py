"""A ladder of one box and one short line, which is flown in a second."""

from dataclasses import replace

import pytest

from magsim.ladder import judged, run
from magsim.ladder.definition import Ladder, SetFlight, read_ladder


def small() -> Ladder:
    """Return the ladder with one training flight, and a short line as the test."""
    whole = read_ladder()
    line = "pattern={{kind='straight', leg_m=14000.0}}"
    test = (line, "recording={{rate_hz=10, split='test'}}", "start.heading_deg={heading_line}")
    flights = {"train_1": whole.flights["train_1"], "line": SetFlight(set=test, test=True)}
    levels = {name: level.model_copy(update={"flights": {}}) for name, level in whole.levels.items()}
    return replace(whole, flights=flights, levels=levels)


@pytest.fixture
def small_ladder(monkeypatch) -> Ladder:
    """Put the small ladder in the place of the shipped one."""
    ladder = small()
    monkeypatch.setattr(judged, "read_ladder", lambda: ladder)
    monkeypatch.setattr(run, "read_ladder", lambda: ladder)
    return ladder

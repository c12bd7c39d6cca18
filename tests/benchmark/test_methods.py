"""Which methods are compared: every one that there is, quickly."""

from typing import ClassVar

import pytest

from magsim.benchmark import evaluate
from magsim.benchmark.methods import named_methods
from magsim.compensation import Compensator, create, names, registry
from magsim.errors import DataError, RequestError
from tests.support.methods import without, zeros
from tests.support.worlds import World, calibration


class Needy(Compensator):
    """A method that cannot be made without being told what."""

    name = "needy"

    def __init__(self, path: str) -> None:
        self.path = path

    def learn(self, training, context):
        """Learn nothing."""

    def estimate(self, recording):
        """Return zeros."""
        return zeros(recording)


class Failing(Compensator):
    """A method that gives up, while fitting or while it is judged."""

    name = "failing"
    presets: ClassVar = {"quick": {"early": True}, "default": {}}

    def __init__(self, early: bool = False) -> None:
        self.early = early

    def learn(self, training, context):
        """Give up early."""
        if self.early:
            msg = "too short for me"
            raise DataError(msg)

    def estimate(self, recording):
        """Give up late."""
        msg = "nothing that I know"
        raise DataError(msg)


@pytest.fixture(scope="module")
def recording():
    return calibration(World())


@pytest.fixture
def few(monkeypatch):
    """A registry of a few methods."""
    kept = ("none", "tl16", "tl16_ins", "tl18")
    entries = {name: registry._REGISTRY[name] for name in kept}
    own = {"needy": registry.Entry(Needy), "failing": registry.Entry(Failing)}
    monkeypatch.setattr(registry, "_REGISTRY", entries | own)
    monkeypatch.setattr(registry, "_plugins", dict)


@pytest.mark.usefixtures("few")
def test_all_leaves_out_what_cannot_work_and_says_why(recording):
    flight = without(recording, "ins_roll_deg", "ins_pitch_deg", "ins_heading_deg")
    report = evaluate(flight, "all")
    assert report.methods == ("none", "tl16", "tl18", "noise_floor")
    assert report.rows == evaluate(flight, ["none", "tl16", "tl18", "noise_floor"]).rows
    notes = [note for note in report.notes if "left out" in note]
    assert len(notes) == 3
    assert notes[0].startswith("method needy is left out: method needy: path: ")
    assert "method tl16_ins is left out: recording 'world' has no column ins_roll_deg" in notes[1]
    assert notes[2] == "method failing is left out of 'world': nothing that I know"
    quick = evaluate(flight, ["all", "tl16:scale=sample"], quick=True)
    assert quick.methods == ("none", "tl16", "tl18", "noise_floor", "tl16:scale=sample")
    assert "method failing is left out: too short for me" in quick.notes


@pytest.mark.usefixtures("few")
def test_what_is_named_beside_all_is_taken_once_and_must_work(recording):
    report = evaluate(recording, ["tl18", "all"])
    assert report.methods == ("tl18", "none", "tl16", "tl16_ins", "noise_floor")
    with pytest.raises(DataError, match="nothing that I know"):
        evaluate(recording, ["failing", "all"])
    with pytest.raises(RequestError, match="method all is given twice"):
        evaluate(recording, ["all", "all"])


def test_quick_takes_the_quick_preset_of_those_that_have_one():
    asked = ["tl16", "bp", "bp:hidden=[3]", "bp:preset=paper", ("mine", create("bp"))]
    (tl16, bp, small, paper, mine), notes = named_methods(asked, quick=True)
    assert notes == []
    quick = create("bp", preset="quick").get_params()
    assert bp.compensator.get_params() == quick
    assert small.compensator.get_params() == quick | {"hidden": (3,)}
    assert paper.compensator.get_params() == create("bp", preset="paper").get_params()
    assert mine.compensator.get_params() == create("bp").get_params()
    assert tl16.compensator.get_params() == create("tl16").get_params()


def test_all_are_all_methods_by_name_with_their_defaults():
    named, notes = named_methods("all")
    left_out = {note.split()[1] for note in notes}
    assert {one.name for one in named} | left_out == {*names(), "noise_floor"}
    assert all(one.optional for one in named)
    bp = next(one for one in named if one.name == "bp")
    assert bp.compensator.get_params() == create("bp").get_params()

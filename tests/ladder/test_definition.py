"""The frozen ladder: what it names exists, its levels have what they begin with, its digest never changes."""

import pytest

from magsim.errors import RequestError
from magsim.ladder.definition import Level, _whole, read_ladder

V1 = "dbbd4f19dc2c62d74df3c203eeb084ee2b11f6d44e057c3fced1795ab75cdfca"
"""SHA-256 of ladder v1: its files never change; what must change makes v2."""


def test_the_ladder_is_frozen():
    assert read_ladder().sha256 == V1


def test_every_level_of_the_benchmark_is_there():
    levels = read_ladder().levels
    assert list(levels) == [
        "L0", "L0c", "L1", "L1c", "L2", "L3", "L3u", "L4", "L5a", "L5b", "L5c", "L5d", "L5e", "L5f", "L5g", "L6", "L6m",
        "L7", "L8", "L9_1", "L9_10", "L9_100", "L10a", "L10b", "L10b2", "L11a", "L11b", "B", "LF", "LX", "S6",
    ]  # fmt: skip
    assert len(read_ladder().quick) == 6
    assert set(read_ladder().networks) < set(read_ladder().quick)
    assert [name for name, level in levels.items() if level.family] == ["S6"]
    for level in levels.values():
        assert not {*level.set} & {"", "="}


def test_a_level_has_what_it_begins_with():
    base = Level(name="A", title="a", set=("x=1",), flights={"line": ("y=1",)}, sensors=("stinger",), widths=True)
    level = _whole(
        Level(name="B", title="b", of="A", groups=("g",), set=("x=3",), flights={"line": ("y=2",)}),
        base,
        {"g": ("x=2",)},
    )
    assert level.set == ("x=1", "x=2", "x=3")
    assert level.flights == {"line": ("y=1", "y=2")}
    assert (level.name, level.sensors, level.widths, level.note) == ("B", ("stinger",), True, "")
    own = _whole(Level(name="C", title="c", of="A", sensors=("cabin",)), base, {})
    assert own.sensors == ("cabin",)


def test_a_level_that_is_not_there_is_refused():
    with pytest.raises(RequestError, match=r"there is no level 'L5'.*allowed: L0, L0c"):
        read_ladder().chosen(("L5",))
    assert [level.name for level in read_ladder().chosen(("L6", "L0"))] == ["L0", "L6"]

"""Parts of a flight by heading and maneuver, against masks by hand."""

import numpy as np

from magsim import columns
from magsim.recording.segments import cells, has_maneuvers, headings_and_maneuvers
from tests.support.worlds import World, calibration

DATA = {
    "leg_heading_deg": np.array([0.0, 0.0, 0.0, 90.0, 90.0, 90.0, 90.0, 180.0]),
    "maneuver": np.array([1.0, 0.0, 2.0, 0.0, 2.0, 2.0, 0.0, 0.0]),
    "turn": np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0]),
}


def table(found):
    return {segment.name: np.flatnonzero(segment.rows).tolist() for segment in found}


def test_straight_legs_by_heading_then_maneuvers():
    assert table(headings_and_maneuvers(DATA)) == {
        "heading 0": [0, 1, 2],
        # not the turn, but a maneuver in a turn counts
        "heading 90": [3, 4],
        "pitch": [0],
        "roll": [2, 4, 5],
    }
    assert list(table(headings_and_maneuvers(DATA))) == ["heading 0", "heading 90", "pitch", "roll"]


def test_without_the_column_of_turns_all_rows_are_straight():
    data = {name: DATA[name] for name in ("leg_heading_deg", "maneuver")}
    found = table(headings_and_maneuvers(data))
    assert found["heading 90"] == [3, 4, 5, 6]
    assert found["heading 180"] == [7]


def test_cells_are_maneuvers_on_headings():
    assert table(cells(DATA)) == {"heading 0 pitch": [0], "heading 0 roll": [2], "heading 90 roll": [4, 5]}


def test_without_headings_or_maneuvers_there_are_no_parts():
    for name in ("leg_heading_deg", "maneuver"):
        data = {key: values for key, values in DATA.items() if key != name}
        assert not has_maneuvers(data)
        assert headings_and_maneuvers(data) == cells(data) == []
    assert has_maneuvers(DATA)


def test_unknown_maneuvers_are_no_parts():
    """A file from elsewhere may hold codes that no word stands for."""
    data = DATA | {"maneuver": np.array([1.0, 99.0, -2.0, 0.5, 2.0, 2.0, 0.0, 0.0])}
    assert table(cells(data)) == {"heading 0 pitch": [0], "heading 90 roll": [4, 5]}
    assert "roll" in table(headings_and_maneuvers(data))


def test_parts_of_a_flight():
    """Each of twelve cells of a square has rows, and no row is in two."""
    data = calibration(World(circuits=1)).data
    found = cells(data)
    assert [segment.name for segment in found] == [
        f"heading {course} {word}" for course in (0, 90, 180, 270) for word in ("pitch", "roll", "yaw")
    ]
    assert sum(segment.rows.astype(int) for segment in found).max() == 1
    words = {word: code for code, word in columns.MANEUVERS.items()}
    for segment in found:
        _, course, word = segment.name.split()
        by_hand = (data["leg_heading_deg"] == float(course)) & (data["maneuver"] == words[word])
        np.testing.assert_array_equal(segment.rows, by_hand)

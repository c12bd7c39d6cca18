import json
import math
from dataclasses import FrozenInstanceError

import pytest

from magsim.benchmark import Report, Row
from magsim.errors import RequestError

ROWS = (
    Row("none", "a", "test", "std_nt", 2.0),
    Row("none", "a", "test", "ir", 1.0),
    Row("none", "a", "roll", "std_nt", 3.0),
    Row("tl16", "a", "test", "std_nt", 0.0),
    Row("tl16", "a", "test", "ir", math.inf),
    Row("tl16", "a", "roll", "std_nt", 0.5),
    Row("none", "b", "test", "std_nt", 4.0),
)


@pytest.fixture
def report():
    return Report("cabin", ROWS, {"seed": 1}, ("a note",), {"tl16": 0.25})


def test_values_and_names(report):
    assert report.methods == ("none", "tl16")
    assert report.recordings == ("a", "b")
    assert report.value("none", "std_nt") == 2.0
    assert report.value("none", "std_nt", recording="b") == 4.0
    assert report.value("tl16", "std_nt", segment="roll") == 0.5
    with pytest.raises(KeyError, match="tl16 / b / test / ir"):
        report.value("tl16", "ir", recording="b")
    with pytest.raises(FrozenInstanceError):
        report.sensor = "wing"


def test_frames(report):
    frame = report.to_frame()
    assert list(frame.columns) == ["method", "recording", "segment", "metric", "value"]
    assert len(frame) == len(ROWS)
    wide = report.summary()
    assert list(wide.columns) == ["std_nt", "ir"]
    assert wide.loc[("a", "none"), "std_nt"] == 2.0
    assert math.isinf(wide.loc[("a", "tl16"), "ir"])


def test_json_is_strict(report):
    whole = json.loads(report.to_json(), parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
    assert whole["sensor"] == "cabin"
    assert whole["rows"][4] == {"method": "tl16", "metric": "ir", "recording": "a", "segment": "test", "value": None}
    assert whole["notes"] == ["a note"]


def test_text(report):
    lines = report.to_text().splitlines()
    assert lines[0] == "a, sensor cabin"
    assert lines[1].split() == ["method", "std_nt", "ir", "fit_s"]
    assert lines[3].split() == ["none", "2.0000", "1.00", "-"]
    assert lines[4].split() == ["tl16", "0.0000", "inf", "0.25"]
    assert ["roll", "3.0000", "0.5000"] in [line.split() for line in lines]
    assert lines[-1] == "note: a note"
    assert "fit_s" not in report.to_text(times=False)


PARTS = ("heading 0", "heading 90")
BIRD = tuple(
    Row(f"tl16_gradient:order={order}:vertical=false", "square", part, metric, value + order)
    for order in range(3)
    for metric, value in (("ir_003", 2.471), ("std_paper_nt", 0.5), ("peak_nt", 40.0))
    for part in ("test", *PARTS)
)


def tables(text):
    """Blocks of a text, each a title and its lines."""
    blocks = [block.splitlines() for block in text.split("\n\n")]
    return {title: [line.split() for line in lines] for title, *lines in blocks}


def test_scores_choose_the_tables_of_parts():
    report = Report("cabin", BIRD)
    found = tables(report.to_text(scores=["ir_003"]))
    assert list(found) == [
        "square, sensor cabin",
        "paper 002's ratio of the reading, above 0.03 Hz, by heading (straight legs) and by maneuver",
    ]
    # names of methods are long here, so they are below each other
    assert found["paper 002's ratio of the reading, above 0.03 Hz, by heading (straight legs) and by maneuver"] == [
        ["method", "heading", "0", "heading", "90"],
        ["-" * 36, "-" * 9, "-" * 10],
        ["tl16_gradient:order=0:vertical=false", "2.47", "2.47"],
        ["tl16_gradient:order=1:vertical=false", "3.47", "3.47"],
        ["tl16_gradient:order=2:vertical=false", "4.47", "4.47"],
    ]
    standard = tables(report.to_text())
    assert [title.partition("[nT]")[0] for title in list(standard)[1:]] == [
        "STD of the compensated reading in band ",
        "maximum minus minimum in band ",
    ]
    assert tables(report.to_text(scores=["std_nt", "peak_nt"])).keys() == standard.keys()


def test_a_table_that_a_recording_does_not_have_is_told():
    text = Report("cabin", BIRD).to_text(scores=["ir", "ir_003", "ir"])
    assert text.count("improvement ratio against truth") == 1
    assert "and by maneuver: none, square has no ir of parts" in text


@pytest.mark.parametrize(
    ("scores", "text"),
    [
        (["ir_03"], r"there is no table of 'ir_03' \(did you mean 'ir_003'\?\); allowed: std_nt, ir, std_paper_nt, "),
        (["gain"], "there is no table of 'gain'; allowed: std_nt"),
        ([], "no score is named; allowed: std_nt"),
    ],
)
def test_scores_without_a_table_are_told(scores, text):
    with pytest.raises(RequestError, match=text):
        Report("cabin", BIRD).to_text(scores=scores)

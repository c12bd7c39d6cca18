import json
import math
from dataclasses import FrozenInstanceError

import pytest

from magsim.benchmark import Report, Row

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
    assert lines[3].split() == ["none", "2.0000", "1.0", "-"]
    assert lines[4].split() == ["tl16", "0.0000", "inf", "0.25"]
    assert ["roll", "3.0000", "0.5000"] in [line.split() for line in lines]
    assert lines[-1] == "note: a note"
    assert "fit_s" not in report.to_text(times=False)

"""The report of a benchmark: values, frames, JSON."""

import json
import math
from dataclasses import FrozenInstanceError

import pandas as pd
import pytest

from magsim.benchmark import Fit, Report, Row, judge, report_of, rows_of
from magsim.compensation import create
from tests.support.worlds import World, calibration


def row(method, recording, segment, metric, value, *, file="a.h5", level=None):
    return Row(recording, file, "cabin", level, 0, method, segment, metric, value)


ROWS = (
    row("none", "a", "test", "std_nt", 2.0),
    row("none", "a", "test", "ir", 1.0),
    row("none", "a", "roll", "std_nt", 3.0),
    row("tl16", "a", "test", "std_nt", 0.0),
    row("tl16", "a", "test", "ir", math.inf),
    row("tl16", "a", "roll", "std_nt", 0.5),
    row("none", "b", "test", "std_nt", 4.0, level=3),
    row("none", "a", "test", "std_nt", 5.0, file="c.h5"),
)
FITS = (Fit("tl16", "one", ("a",), 80, 20, given=False), Fit("none", "", (), 0, 0, given=True))


@pytest.fixture
def report():
    return Report(ROWS, FITS, {"seed": 1, "groups": {"one": ["a", "b"]}}, ("a note",), {("tl16", "one"): 0.25})


def test_values_and_names(report):
    assert report.methods == ("none", "tl16")
    assert report.recordings == ("a", "b")
    assert report.value("none", "std_nt") == 2.0
    assert report.value("none", "std_nt", recording="b") == 4.0
    assert report.value("none", "std_nt", file="c.h5") == 5.0
    assert report.value("tl16", "std_nt", segment="roll") == 0.5
    with pytest.raises(KeyError, match="tl16 / b / test / ir"):
        report.value("tl16", "ir", recording="b")
    with pytest.raises(KeyError, match="none / a / test / ir"):
        report.value("none", "ir", file="c.h5")
    with pytest.raises(KeyError, match="none /  / test / ir"):
        Report(()).value("none", "ir")
    with pytest.raises(FrozenInstanceError):
        report.rows = ()
    assert repr(report) == "<Report: 2 methods on 2 recordings, 8 scores>"


def test_frames(report):
    frame = report.to_frame()
    assert list(frame.columns) == list(Row._fields)
    assert len(frame) == len(ROWS)
    assert frame["level"].tolist() == [pd.NA] * 6 + [3, pd.NA]
    assert frame["value"].tolist() == [one.value for one in ROWS]
    wide = report.summary()
    assert list(wide.columns) == ["std_nt", "ir"]
    assert wide.index.names == ["recording", "file", "method"]
    assert wide.loc[("a", "a.h5", "none"), "std_nt"] == 2.0
    assert wide.loc[("a", "c.h5", "none"), "std_nt"] == 5.0
    assert math.isinf(wide.loc[("a", "a.h5", "tl16"), "ir"])
    assert math.isnan(wide.loc[("b", "a.h5", "none"), "ir"])
    assert report.summary("roll").shape == (2, 1)
    assert len(Report(()).to_frame()) == 0


def test_json_is_strict(report):
    whole = json.loads(report.to_json(), parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
    assert set(whole) == {"about", "fits", "notes", "rows"}
    assert whole["rows"][4] == {**ROWS[4]._asdict(), "value": None}
    assert whole["rows"][6] == ROWS[6]._asdict()
    assert whole["fits"] == [{**fit._asdict(), "recordings": list(fit.recordings)} for fit in FITS]
    assert whole["notes"] == ["a note"]
    # times of fits differ from run to run
    assert "0.25" not in report.to_json()


def test_a_page_shows_the_wide_table_with_its_names_escaped():
    hostile = Report((row("<script>x</script>", "a&b", "test", "std_nt", 2.0),))
    html = hostile._repr_html_()
    assert "<script>" not in html
    assert "&lt;script&gt;" in html
    assert "a&amp;b" in html


def test_kept_residuals_make_a_report():
    recording = calibration(World())
    found = [judge(create(name).fit(recording), recording, level=2) for name in ("none", "tl16")]
    report = report_of(found)
    assert report.rows == tuple(row for one in found for row in rows_of(one))
    assert report.methods == ("none", "tl16")
    assert report.fits == ()
    assert {row.level for row in report.rows} == {2}
    assert report.value("none", "ir") == 1.0

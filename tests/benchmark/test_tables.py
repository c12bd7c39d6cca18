"""Reports as tables of plain text."""

import math

import pytest

from magsim.benchmark import Fit, Report, Row
from magsim.benchmark.tables import aligned, fitted
from magsim.errors import RequestError
from tests.benchmark.test_report import FITS, ROWS, row


@pytest.fixture
def report():
    return Report(ROWS[:6], FITS, {"groups": {"one": ["a", "b"]}}, ("a note",), {("tl16", "one"): 0.25})


def blocks(text):
    """Blocks of a text, each a title and its lines."""
    parts = [block.splitlines() for block in text.rstrip("\n").split("\n\n")]
    return {title: [line.split() for line in lines] for title, *lines in parts}


def test_the_whole_text(report):
    """A table of all test rows, then of parts, then fits and notes."""
    expected = """\
a, sensor cabin
method  std_nt    ir  fit_s
------  ------  ----  -----
none    2.0000  1.00  given
tl16    0.0000   inf   0.25

STD in band [nT] by heading (straight legs) and by maneuver
segment    none    tl16
-------  ------  ------
roll     3.0000  0.5000

fitted on 80 training and 20 validation rows of a: tl16
given as fitted: none
note: a note
"""
    assert report.to_text() == expected
    assert str(report) == expected
    assert "fit_s" not in report.to_text(times=False)


def test_a_title_has_what_tells_recordings_apart():
    rows = (
        row("none", "a", "test", "std_nt", 1.0),
        row("none", "a", "test", "std_nt", 2.0, file="other.h5", level=0),
        row("none", "b", "test", "std_nt", 3.0, file="", level=4),
    )
    lines = Report(rows).to_text().splitlines()
    assert [line for line in lines if "sensor" in line] == [
        "a, sensor cabin",
        "a (other.h5), sensor cabin, level 0",
        "b, sensor cabin, level 4",
    ]


def test_methods_that_were_fitted_on_the_same_rows_share_a_line():
    fits = [Fit(name, "g", ("a", "b"), 100, 0, given=False) for name in ("tl16", "tl18")]
    fits += [Fit("run", "", (), 0, 0, given=True), Fit("tl16", "h", ("c",), 50, 7, given=False)]
    assert fitted(fits) == [
        "fitted on 100 training rows of a, b: tl16, tl18",
        "given as fitted: run",
        "fitted on 50 training and 7 validation rows of c: tl16",
    ]


def test_columns_are_aligned():
    expected = "name    x\n------  --\na        1\nlonger  22"
    assert aligned(["name", "x"], [["a", "1"], ["longer", "22"]]).splitlines() == [
        "name     x",
        *expected.splitlines()[1:],
    ]


PARTS = ("heading 0", "heading 90")
BIRD = tuple(
    row(f"tl16_gradient:order={order}:vertical=false", "square", part, metric, value + order, file="")
    for order in range(3)
    for metric, value in (("ir_003", 2.471), ("std_paper_nt", 0.5), ("peak_nt", 40.0))
    for part in ("test", *PARTS)
)


def test_scores_choose_the_tables_of_parts():
    report = Report(BIRD)
    found = blocks(report.to_text(scores=["ir_003"]))
    title = "paper 002's ratio of the reading, above 0.03 Hz, by heading (straight legs) and by maneuver"
    assert list(found) == ["square, sensor cabin", title]
    # names of methods are long here, so they are below each other
    assert found[title] == [
        ["method", "heading", "0", "heading", "90"],
        ["-" * 36, "-" * 9, "-" * 10],
        ["tl16_gradient:order=0:vertical=false", "2.47", "2.47"],
        ["tl16_gradient:order=1:vertical=false", "3.47", "3.47"],
        ["tl16_gradient:order=2:vertical=false", "4.47", "4.47"],
    ]
    standard = blocks(report.to_text())
    # without truth the STD of the compensated reading stands in for that of the error
    assert [title.partition("[nT]")[0] for title in list(standard)[1:]] == [
        "STD of the compensated reading in band ",
        "maximum minus minimum in band ",
    ]
    assert blocks(report.to_text(scores=["std_nt", "peak_nt"])).keys() == standard.keys()


def test_a_table_that_a_recording_does_not_have_is_noted_if_it_was_asked_for():
    text = Report(BIRD).to_text(scores=["ir", "ir_003", "ir"])
    assert text.count("improvement ratio against truth") == 1
    assert "and by maneuver: none, square has no ir of parts" in text
    assert "none, square" not in Report(BIRD).to_text()


def test_missing_values_are_dashes():
    rows = (*ROWS[:2], row("tl16", "a", "test", "std_nt", math.nan), Row(*ROWS[5]))
    lines = [line.split() for line in Report(rows).to_text(times=False).splitlines()]
    assert ["tl16", "-", "-"] in lines


def test_scores_without_a_table_are_refused():
    with pytest.raises(RequestError, match="there is no table of 'gain'; allowed: std_nt"):
        Report(BIRD).to_text(scores=["gain"])
    with pytest.raises(RequestError, match="no score is named; allowed: std_nt"):
        Report(BIRD).to_text(scores=[])

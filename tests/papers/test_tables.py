"""Tables of papers: intervals against the binomial distribution, and how they are written."""

import csv
import io
import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

from magsim.papers import Cell, Column, Line, PaperTable
from magsim.papers.tables import LEAST_FOR_INTERVAL, as_csv, as_json, counted, markdown, text

TABLE = PaperTable(
    "table_9",
    "Table 9: STD",
    (Column("std", "STD", "nT", 2), Column("ir", "IR", "", 1)),
    (
        Line("T-L", {"std": Cell(0.5, (0.4, 0.6, 0.7)), "ir": Cell(None, (10.0, 12.0, 14.0))}, "another aircraft"),
        Line("not run", {"std": Cell(0.25)}),
        Line("ours", {"std": Cell(None, (0.001, 0.002, 0.003))}, added=True),
    ),
    "3 flights",
    ("A note.",),
)


@pytest.mark.parametrize("count", [6, 8, 12, 25])
def test_intervals_hold_the_median_with_95_percent(count):
    """Order statistics j and n + 1 - j hold it with 1 - 2 P(X < j), X binomial of n and 1/2."""
    values = np.random.default_rng(count).permutation(count).astype(float)
    low, high = Cell(None, tuple(values)).interval
    ranked = np.sort(values)
    rank = max(j for j in range(1, count) if 1.0 - 2.0 * binom.cdf(j - 1, count, 0.5) >= 0.95)
    assert (low, high) == (ranked[rank - 1], ranked[-rank])


def test_few_values_have_a_range_and_one_has_none():
    assert Cell(None, (3.0, 1.0, 2.0)).interval == (1.0, 3.0)
    assert Cell(None, (3.0,)).interval is None
    assert np.isnan(Cell(1.0).median)
    assert 1.0 - 2.0 * 0.5**LEAST_FOR_INTERVAL >= 0.95 > 1.0 - 2.0 * 0.5 ** (LEAST_FOR_INTERVAL - 1)


def test_what_is_reproduced_lies_in_the_range_of_ours():
    assert Cell(2.0, (1.0, 3.0)).reproduced is True
    assert Cell(3.5, (1.0, 3.0)).reproduced is False
    assert Cell(3.5).reproduced is Cell(None, (1.0,)).reproduced is None
    assert TABLE.reproduced == (1, 1)
    assert TABLE.cell("T-L", "std").published == 0.5
    assert TABLE.cell("ours", "ir") == Cell()


def test_text_has_paper_and_ours_side_by_side_and_added_lines_below():
    lines = text(TABLE).splitlines()
    assert lines[0] == "Table 9: STD"
    assert "median over 3 flights" in lines[1]
    head = lines[3]
    assert head.split() == ["STD", "[nT],", "paper", "ours", "IR"]
    assert lines[5].split() == ["T-L", "0.50", "0.60", "[0.40,", "0.70]", "12.0", "[10.0,", "14.0]"]
    assert lines[6].split() == ["not", "run", "0.25", "-", "-"]
    assert set(lines[7]) == {"-"}
    assert lines[8].split() == ["ours", "-", "0.002", "[0.001,", "0.003]", "-"]
    assert lines[-2:] == ["T-L: another aircraft", "A note."]


@pytest.mark.parametrize(
    ("published", "shown"), [(0.4855, "0.4855"), (12.0, "12.00"), (93_392.16, "93392.16"), (651.61 / 427.641, "1.52")]
)
def test_published_figures_keep_their_decimals(published, shown):
    line = Line("T-L", {"std": Cell(published, (1.0,))})
    assert f"| T-L | {shown} | 1.00 |" in markdown(replace(TABLE, columns=TABLE.columns[:1], lines=(line,)))


def test_what_is_one_is_not_many():
    assert counted(1) == "1 flight"
    assert counted(6, "pairs of flights") == "6 pairs of flights"
    assert counted(1, "sets of lines") == "1 set of lines"


def test_markdown_is_a_table():
    rows = [line for line in markdown(TABLE).splitlines() if line.startswith("|")]
    assert len({row.count("|") for row in rows}) == 1
    assert rows[4].startswith("| *ours* | - | 0.002 [0.001, 0.003] |")
    assert "- T-L: another aircraft" in markdown(TABLE)


def test_a_remark_on_several_lines_stands_once():
    first, second, third = (replace(line, remark="why") for line in TABLE.lines)
    table = replace(TABLE, lines=(first, replace(second, remark="else"), third))
    assert text(table).splitlines()[-3:] == ["T-L; ours: why", "not run: else", "A note."]
    assert markdown(table).splitlines()[-3:] == ["- T-L; ours: why", "- not run: else", "- A note."]


def test_csv_and_json_hold_every_value():
    rows = list(csv.DictReader(io.StringIO(as_csv(TABLE))))
    (first,) = (row for row in rows if row["line"] == "T-L" and row["column"] == "STD")
    assert (first["published"], first["median"], first["low"], first["high"]) == ("0.5", "0.6", "0.4", "0.7")
    assert [float(value) for value in first["values"].split(";")] == [0.4, 0.6, 0.7]
    back = json.loads(json.dumps(as_json(TABLE)))
    assert back["lines"][0]["cells"]["std"] == {"published": 0.5, "found": [0.4, 0.6, 0.7], "interval": [0.4, 0.7]}
    assert [line["added"] for line in back["lines"]] == [False, False, True]

"""Paper 002 by its fastest run, and its published figures against the reference."""

import pytest

from magsim.papers import Effort, find_paper, run_paper
from tests.support.papers_page import require_on_page

PUBLISHED = {("figure_6", "N = 3", "gain ir_003"): 6.0, ("figure_7_ir_003", "N = 3", "north"): 2.47,
             ("figure_7_ir_003", "N = 3", "east"): 2.75}  # fmt: skip
"""The text on Figures 6 and 7: 6 % for N = 3, 2.47 to the north, 2.75 to the east."""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return run_paper("002", tmp_path_factory.mktemp("002"), Effort(quick=True, seeds=1))


def test_published_figures_are_those_of_the_paper(run):
    found = {
        (table.key, line.name, column): cell.published
        for table in run.tables
        for line in table.lines
        for column, cell in line.cells.items()
        if cell.published is not None
    }
    assert found == PUBLISHED


def test_the_page_has_them(run):
    require_on_page("002", run)


def test_methods_are_ranked_by_truth(run):
    """No compensation is 1 by definition; nothing beats the instrument; ours stands below the table."""
    six = run.tables[0]
    assert six.cell("no compensation", "ir").found == (1.0,)
    floor = six.cell("noise floor", "ir").median
    for name in ("Tolles-Lawson", *(f"N = {n}" for n in range(5)), "exact_norm (ours)"):
        assert 1.0 < six.cell(name, "ir").median < floor
    gain = six.cell("N = 3", "ir").median / six.cell("Tolles-Lawson", "ir").median
    assert six.cell("N = 3", "gain ir").median == pytest.approx(100.0 * (gain - 1.0))
    assert run.headlines["gain_order3_truth_pct"].median == six.cell("N = 3", "gain ir").median
    assert [line.name for line in six.lines if line.added] == [
        "T-L with auxiliary columns", "exact_norm (ours)", "noise floor",
    ]  # fmt: skip
    assert {path.name for path in run.files} >= {"figure_6.txt", "figure_6.png", "figure_7.png", "tables.json"}


def test_flights_of_a_pair_are_told_apart_by_their_seeds():
    flights = find_paper("002").flights(Effort())
    assert len(flights) == 24
    assert len({flight.settings for flight in flights}) == 24

"""Paper 001 by its fastest run, its published figures against the text, its metrics against closed forms."""

import numpy as np
import pytest

from magsim.papers import Effort, find_paper, run_paper
from magsim.papers.paper_001.work import determination
from tests.support.papers_again import require_same_tables
from tests.support.papers_page import require_on_page

PUBLISHED = {
    ("table_1", "LS"): (2.171, 0.355, 6.115),
    ("table_1", "RR"): (2.171, 0.324, 6.701),
    ("table_2", "BP, flight B"): (2.334, 0.294, 7.939),
    ("table_2", "Res-Bp, flight B"): (2.334, 0.260, 8.977),
    ("table_2", "BP, flight A"): (2.112, 0.285, 7.411),
    ("table_2", "Res-Bp, flight A"): (2.112, 0.266, 7.940),
}
"""Tables 1 and 2 of the paper: STDu, STDc [nT], IR."""

CLAIMED = {
    "RR over LS, flight A": 6.701 / 6.115,
    "Res-Bp over BP, flight B": 8.977 / 7.939,
    "Res-Bp over BP, flight A": 7.940 / 7.411,
    "Res-Bp over LS, flight A": 7.940 / 6.115,
    "Res-Bp over RR, flight A": 7.940 / 6.701,
    "BP over LS, flight A": 7.411 / 6.115,
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("001")


@pytest.fixture(scope="module")
def run(folder):
    return run_paper("001", folder, Effort(quick=True, seeds=1))


def test_published_figures_are_those_of_the_paper(run):
    found = {
        (table.key, line.name): tuple(
            line.cells[column].published for column in ("before_nt", "std_paper_nt", "ir_paper")
        )
        for table in run.tables[:2]
        for line in table.lines
        if not line.added
    }
    assert found == PUBLISHED
    claims = {line.name: line.cells["ratio"].published for line in run.tables[2].lines}
    assert {name: ratio for name, ratio in claims.items() if ratio is not None} == pytest.approx(CLAIMED)
    assert run.headlines["ratio_resbp_over_ls"].published == pytest.approx(7.940 / 6.115)
    others = [
        cell.published for table in run.tables for line in table.lines if line.added for cell in line.cells.values()
    ]
    assert set(others) == {None}


def test_the_page_has_them(run):
    require_on_page("001", run)


def test_work_that_is_done_again_gives_the_same_tables(run, folder):
    require_same_tables("001", folder, every=8)


def test_scores_of_both_tables_hold_together(run):
    """What is left times the ratio is what was there; nothing beats the label; a fit in two tables is one."""
    one, two, claims = run.tables
    for table in (one, two):
        for line in table.lines:
            before, after, ratio = (line.cells[key].median for key in ("before_nt", "std_paper_nt", "ir_paper"))
            assert after * ratio == pytest.approx(before, rel=1e-9)
    assert one.cell("LS", "ir").found == two.cell("LS, flight A", "ir").found
    assert one.cell("noise floor", "r2").found == (1.0,)
    floor = one.cell("noise floor", "ir").median
    for name in ("LS", "RR", "T-L with auxiliary columns", "exact_norm (ours)"):
        assert 5.0 < one.cell(name, "ir").median < floor
    share = two.cell("Res-Bp, flight B", "ir_paper").median / two.cell("BP, flight B", "ir_paper").median
    assert claims.cell("Res-Bp over BP, flight B", "ratio").median == pytest.approx(share)
    assert {path.name for path in run.files} >= {"table_1.csv", "claims.txt", "figure_10_r2.png", "tables_1_2.png"}


def test_determination_is_one_less_the_share_that_is_left():
    true = np.sin(np.arange(1000) * np.pi / 50.0) + 40.0
    assert determination(true, true) == 1.0
    assert determination(true, np.full(1000, true.mean())) == pytest.approx(0.0, abs=1e-12)
    assert determination(true, 40.0 + 0.9 * (true - 40.0)) == pytest.approx(0.99)


def test_each_pair_is_one_drone_on_two_days():
    flights = find_paper("001").flights(Effort())
    assert len(flights) == 24
    assert len({flight.settings for flight in flights}) == 24
    days = [int(setting.partition("=")[2]) for one in flights for setting in one.settings if setting.startswith("day")]
    assert days == [*range(1, 25)]
    tasks = find_paper("001").tasks(Effort())
    assert len({task.key for task in tasks}) == len(tasks)
    assert {task.flights for task in tasks} == {
        pair for k in range(12) for pair in ((f"a_{k:02d}", f"b_{k:02d}"), (f"b_{k:02d}", f"a_{k:02d}"))
    }

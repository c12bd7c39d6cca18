"""Paper 004 by its fastest run, its published figures against Table 6."""

import math

import pytest

from magsim.papers import Effort, find_paper, run_paper
from tests.support.papers_again import require_same_tables
from tests.support.papers_page import require_on_page

TABLE_6 = {
    "UAV2": (17.8126, 1.1256, 0.9324, 0.5004),
    "UAV3": (41.1538, 0.7028, 0.4856, 0.4855),
    "SCSS1": (191.8949, 23.0391, 0.7030, 0.6018),
    "SCSS2": (118.0897, 45.7260, 5.6801, 1.0443),
}
"""Table 6 of the paper: STD of raw data, after LS, after the nets Z3 to Z5, after all nets [nT]."""

NEAR = {"UAV2": 0.05, "UAV3": 0.10, "SCSS1": 0.05, "SCSS2": 0.12}
"""How near the raw level of the flights comes to the paper's, of 1."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("004")


@pytest.fixture(scope="module")
def run(folder):
    return run_paper("004", folder, Effort(quick=True, seeds=1))


def test_published_figures_are_those_of_the_paper(run):
    six, share, claims = run.tables
    for code, (raw, *left) in TABLE_6.items():
        for method, std in zip(("LS", "Z3-Z5", "all"), left, strict=True):
            cells = next(line for line in six.lines if line.name == f"{code}, {method}").cells
            found = {key: cell.published for key, cell in cells.items() if cell.published is not None}
            assert found == {"raw other": raw, "left other": std}
        expected = math.sqrt(left[1] ** 2 - left[2] ** 2)
        assert share.cell(code, "field_found other").published == pytest.approx(expected)
        assert claims.cell(f"{code}: Z3-Z5 over LS", "ratio").published == pytest.approx(left[0] / left[1])
        assert claims.cell(f"{code}: all over Z3-Z5", "ratio").published == pytest.approx(left[1] / left[2])
    product = math.prod(left[0] / left[1] for _, *left in TABLE_6.values())
    assert run.headlines["z345_over_ls"].published == pytest.approx(product**0.25)
    assert {cell.published for line in six.lines if line.added for cell in line.cells.values()} == {None}


def test_the_page_has_them(run):
    require_on_page("004", run)


def test_work_that_is_done_again_gives_the_same_tables(run, folder):
    require_same_tables("004", folder, every=8)


def test_raw_levels_come_near_the_papers(run):
    six = run.tables[0]
    for code, (raw, *_) in TABLE_6.items():
        assert six.cell(f"{code}, LS", "raw other").median == pytest.approx(raw, rel=NEAR[code])


def test_scores_hold_together(run):
    """Without nets of the field nothing but the aircraft is taken off; the label leaves the field and the noise."""
    six, share, _ = run.tables
    for code in TABLE_6:
        for method in ("LS", "Z3-Z5", "exact_norm (ours)"):
            name = f"{code}, {method}"
            assert six.cell(name, "left other").found == six.cell(name, "left_reading other").found
        floor = six.cell(f"{code}, noise floor", "left other").median
        assert floor == pytest.approx(share.cell(code, "field other").median, rel=0.01, abs=0.01)
        assert six.cell(f"{code}, noise floor", "error other").median < 0.02
    assert {path.name for path in run.files} >= {"table_6.csv", "field_share.txt", "claims.txt", "table_6.png"}


def test_flights_of_an_experiment_differ_by_their_seeds():
    flights = find_paper("004").flights(Effort())
    assert len({(flight.scenario, flight.settings) for flight in flights}) == len(flights) == 32
    tasks = find_paper("004").tasks(Effort())
    assert len({task.key for task in tasks}) == len(tasks)

"""The board as pages: numbers, marks, and nothing of a method's name that a page would run."""

import math

import numpy as np
import pytest

from magsim.benchmark.statistics import Interval
from magsim.ladder import pages
from magsim.ladder.board import make_board
from magsim.ladder.definition import read_ladder
from magsim.ladder.results import Entered, Score

BAD = "<script>alert(1)</script>|x"


def board(sets=12):
    rng = np.random.default_rng(2)
    rows, entered = [], []
    world = np.exp(rng.normal(0.0, 0.3, sets))
    sizes = {"none": 10.0, "noise_floor": 0.003, "tl16": 0.05, "good": 0.01, BAD: 0.012, "eats": 0.004}
    for number in range(sets):
        for name, size in sizes.items():
            std = size * world[number] * float(np.exp(rng.normal(0.0, 0.05)))
            gain = 0.5 if name == "eats" else 1.0
            whole = {"std_nt": std, "gain_0.1": gain, "gain_1": 1.0, "gain_20": 1.0, "distortion": 0.0, "slow_nt": 0.1}
            rows += [
                Score("open", "L0", number, "cabin", name, "all", "test", metric, v) for metric, v in whole.items()
            ]
            rows += [Score("open", "L0", number, "cabin", name, "line", "test", "ir", 10.0 * world[number] / std)]
        numbers = (0.1, 0.2, 3.0, 200.0, 5000.0, 18.0)
        entered.append(Entered("open", "L0", number, "cabin", "good", "ok", "", False, True, (), ("ab",), *numbers))
        lost = ("crashed", "its process ended")
        entered.append(Entered("open", "L0", number, "cabin", "gone", *lost, False, False, (), (), *([math.nan] * 6)))
    return make_board({"command": "magsim benchmark --ladder", "magsim": "0"}, read_ladder(), rows, entered)


def test_numbers_have_three_digits():
    shown = [pages.number(value) for value in (1234.5, 12.345, 0.0012345, 0.0, math.inf, math.nan, 2.5e6)]
    assert shown == ["1234", "12.3", "0.00123", "0", "inf", "-", "2.5e+06"]
    assert pages.interval(Interval(2.0, 1.0, 4.0)) == "2.00 (1.00 to 4.00)"
    assert pages.interval(Interval(2.0, math.nan, math.nan)) == "2.00"


def test_a_table_says_who_leads_who_ties_and_who_fails():
    (table,) = board().tables
    lines = {line.method: line for line in pages.lines(table)}
    assert lines["good"].rank == "1"
    assert "pretrained" in lines["good"].note
    assert "12" not in lines["good"].rank
    assert lines["eats"].rank == "-"
    assert "gain 0.500 at 0.1 nT" in lines["eats"].note
    assert lines["tl16"].rank == "3"
    assert lines["tl16"].over_baseline.startswith("1.00")
    assert pages.lost(table) == ["gone: crashed: its process ended"]


def test_pages_escape_what_methods_are_called():
    page, markdown = pages.html(board()), pages.markdown(board())
    assert "<script" not in page
    assert "&lt;script&gt;" in page
    assert "<script" not in markdown
    assert "\\|x" in markdown
    for text in (page, markdown, pages.text(board())):
        assert "has no rank, whatever its IR" in text or "fails: gain" in text
    assert "http" not in page.replace("http-equiv", "")


def test_few_sets_are_said_to_be_few():
    assert "rank nobody for sure" in pages.text(board(3))
    assert "rank nobody for sure" not in pages.text(board(12)).split("\n")[1]


@pytest.mark.parametrize("make", [pages.html, pages.markdown, pages.text])
def test_the_same_scores_make_the_same_bytes(make):
    assert make(board()) == make(board())

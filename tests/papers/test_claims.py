"""Claims of papers: chances by counting all outcomes of coins."""

from itertools import product

import numpy as np
import pytest

from magsim.papers.claims import Claim, claims_table, ratios


@pytest.mark.parametrize(("holds", "fails"), [(6, 0), (5, 1), (3, 3), (1, 4), (10, 2)])
def test_p_value_is_the_share_of_coins_that_are_at_least_as_uneven(holds, fails):
    count = holds + fails
    heads = np.array([sum(coins) for coins in product((0, 1), repeat=count)])
    expected = np.mean(np.abs(heads - count / 2) >= abs(holds - count / 2))
    claim = Claim("better", (2.0,) * holds + (0.5,) * fails)
    assert claim.p_value == pytest.approx(expected, rel=1e-12)
    assert claim.share == holds / count


def test_flights_in_which_both_are_equal_say_nothing():
    assert Claim("better", (2.0,) * 5 + (1.0,) * 3).p_value == pytest.approx(2.0 / 2**5)
    assert Claim("better", (1.0, 1.0)).p_value == 1.0
    assert Claim("better", (1.0, 1.0)).share == 0.0


def test_claims_are_a_table():
    found = [Claim("a over b", ratios((4.0, 9.0), (2.0, 10.0)), 1.5, "why"), Claim("elsewhere", (1.0,), added=True)]
    table = claims_table(found, "2 flights")
    assert [line.added for line in table.lines] == [False, True]
    assert table.cell("a over b", "ratio").found == (2.0, 0.9)
    assert table.cell("a over b", "ratio").published == 1.5
    assert table.cell("a over b", "share").found == (50.0,)
    assert table.lines[0].remark == "why"
    with pytest.raises(ValueError, match="zip"):
        ratios((1.0,), (1.0, 2.0))

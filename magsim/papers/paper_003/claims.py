"""What paper 003 claims, tested over flights: which model is above which, which cell of its grid is best."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.stats import binomtest, kendalltau, rankdata

from magsim.papers.paper import Results, values_of
from magsim.papers.paper_003.candidates import network_name
from magsim.papers.paper_003.published import BEST, CHOSEN, TABLE_1, TABLE_2, TABLE_3
from magsim.papers.tables import Cell, Column, Line, PaperTable

SCORE = "ir pp"
"""What the paper ranks by."""


class Claim(NamedTuple):
    """One model above another in a world, and the ratio of their printed improvement ratios."""

    world: str
    better: str
    other: str
    published: float

    @property
    def text(self) -> str:
        """The claim in words."""
        return f"{self.world}: {self.better} > {self.other}"


def _of_table_1(world: str, better: str, other: str) -> Claim:
    return Claim(world, better, other, TABLE_1[better][world] / TABLE_1[other][world])


def _of_table_3(better: str, other: str) -> Claim:
    return Claim("drawn", better, other, TABLE_3[better][SCORE] / TABLE_3[other][SCORE])


CLAIMS: tuple[Claim, ...] = (
    _of_table_1("static", "LSTM-BP", "BP"),
    _of_table_1("static", "BP", "LSTM"),
    _of_table_1("dynamic", "LSTM-BP", "LSTM"),
    _of_table_1("dynamic", "LSTM", "BP"),
    _of_table_3("LSTM-BP", "GRU-BP"),
    _of_table_3("GRU-BP", "LSTM"),
    _of_table_3("LSTM", "BP"),
    _of_table_3("LSTM-BP", "BP"),
)
"""Those of Table 1 and of Table 3, in the paper's order of models."""


def sign_test(ratios: Sequence[float]) -> float:
    """Return the two-sided p-value of the exact sign test that ratios are as often above 1 as below."""
    return float(binomtest(sum(ratio > 1.0 for ratio in ratios), len(ratios), 0.5).pvalue)


def ratios_of(results: Results, world: str, better: str, other: str) -> tuple[float, ...]:
    """Return the improvement ratio of one model over that of another, flight by flight."""
    pairs = zip(
        values_of(results, SCORE, "judge", world=world, line=better),
        values_of(results, SCORE, "judge", world=world, line=other),
        strict=True,
    )
    return tuple(own / theirs for own, theirs in pairs)


def claims(results: Results) -> PaperTable:
    """Return which model is above which, in the paper's world and for an aircraft."""
    physical = [Claim("physical", claim.better, claim.other, 0.0) for claim in CLAIMS if claim.world == "drawn"]
    lines = []
    for claim in (*CLAIMS, *physical):
        found = ratios_of(results, claim.world, claim.better, claim.other)
        cells = {
            "ratio": Cell(claim.published or None, found),
            "holds": Cell(None, (100.0 * float(np.mean(np.array(found) > 1.0)),)),
            "p": Cell(None, (sign_test(found),)),
        }
        lines.append(Line(claim.text, cells, added=claim.world == "physical"))
    columns = (
        Column("ratio", "ratio of their IR", "", 2),
        Column("holds", "holds in", "% of flights", 0),
        Column("p", "p of the sign test", "", 3),
    )
    note = (
        "Published ratios are computed from the IR that Tables 1 and 3 print. Table 3 has another 'before' for each "
        "model: its test segments differ, so that its own rows cannot be compared."
    )
    return PaperTable(
        "claims", "Claims: which model is above which", columns, tuple(lines), f"{len(found)} flights", (note,)
    )


def grid_of(results: Results) -> np.ndarray:
    """Return the improvement ratios of Table 2, (flights, cells) in the order of the table."""
    names = [network_name(network) for network in TABLE_2]
    return np.array([values_of(results, SCORE, "judge", world="drawn", line=name) for name in names]).T


def agreement(grid: np.ndarray) -> tuple[float, ...]:
    """Return Kendall's tau of the order of the cells with the printed one, (flights,)."""
    return tuple(float(kendalltau(row, [*TABLE_2.values()]).statistic) for row in grid)


def claims_of_table_2(results: Results) -> PaperTable:
    """Return the ranks of the two cells that the paper names, and how far the order of all 16 agrees."""
    grid, printed = grid_of(results), np.array([*TABLE_2.values()])
    ranks, published = rankdata(-grid, axis=1), rankdata(-printed)
    cells = [*TABLE_2]
    lines = []
    for network, words in ((BEST, "the best"), (CHOSEN, "the paper's choice")):
        at = cells.index(network)
        first = int((ranks[:, at] == 1.0).sum())
        chance = binomtest(first, len(grid), 1.0 / len(cells), alternative="greater")
        found = {
            "rank": Cell(float(published[at]), tuple(map(float, ranks[:, at]))),
            "best": Cell(None, (100.0 * first / len(grid),)),
            "p": Cell(None, (float(chance.pvalue),)),
        }
        lines.append(Line(f"{network.name}, {words}", found))
    lines.append(Line("order of all 16 cells", {"tau": Cell(None, agreement(grid))}))
    columns = (
        Column("rank", "rank of 16", "", 1),
        Column("best", "best in", "% of flights", 0),
        Column("p", "p of no more than chance, 1 of 16", "", 3),
        Column("tau", "Kendall's tau with the paper's order", "", 2),
    )
    notes = ("Ranks are by the improvement ratio, 1 the best; the paper's are of one training each.",)
    return PaperTable(
        "claims_table_2", "Claims: the best cell of Table 2", columns, tuple(lines), f"{len(grid)} flights", notes
    )


def headlines(results: Results) -> dict[str, Cell]:
    """Return whether the printed best cell is the best, how far all 16 agree, and how far models are apart."""
    grid = grid_of(results)
    best = grid.argmax(axis=1) == [*TABLE_2].index(BEST)
    out = {
        "best_cell_is_2tanh": Cell(1.0, tuple(map(float, best))),
        "grid_kendall_tau": Cell(1.0, agreement(grid)),
    }
    for name, better, other in (
        ("ratio_lstmbp_over_bp", "LSTM-BP", "BP"),
        ("ratio_lstmbp_over_grubp", "LSTM-BP", "GRU-BP"),
        ("ratio_lstm_over_bp", "LSTM", "BP"),
    ):
        claim = _of_table_3(better, other)
        out[name] = Cell(claim.published, ratios_of(results, claim.world, better, other))
    return out

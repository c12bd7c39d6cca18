"""What paper 003 claims, tested over flights: which model is above which, which cell of its grid is best."""

import numpy as np
from scipy.stats import binomtest, kendalltau, rankdata

from magsim.papers.claims import Claim, claims_table, ratios
from magsim.papers.paper import Results, values_of
from magsim.papers.paper_003.candidates import network_name
from magsim.papers.paper_003.published import BEST, CHOSEN, TABLE_1, TABLE_2, TABLE_3
from magsim.papers.tables import Cell, Column, Line, PaperTable, counted

SCORE = "ir pp"
"""What the paper ranks by."""

IN_TABLE_1 = (
    ("static", "LSTM-BP", "BP"),
    ("static", "BP", "LSTM"),
    ("dynamic", "LSTM-BP", "LSTM"),
    ("dynamic", "LSTM", "BP"),
)
"""World, the better model, the other one: those next to each other in the paper's ranking."""

IN_TABLE_3 = (("LSTM-BP", "GRU-BP"), ("GRU-BP", "LSTM"), ("LSTM", "BP"), ("LSTM-BP", "BP"))
"""Neighbors in the paper's ranking, and its first and last."""


def compared(results: Results, world: str, better: str, other: str) -> Claim:
    """Return the claim that one model is above another in a world; ``physical`` is not the paper's."""
    found = ratios(*(values_of(results, SCORE, "judge", world=world, line=line) for line in (better, other)))
    published: float | None = None
    if world == "drawn":
        published = TABLE_3[better][SCORE] / TABLE_3[other][SCORE]
    elif world != "physical":
        published = TABLE_1[better][world] / TABLE_1[other][world]
    return Claim(f"{world}: {better} > {other}", found, published, added=world == "physical")


def claims(results: Results) -> PaperTable:
    """Return which model is above which, in the paper's worlds and for an aircraft."""
    found = [compared(results, *names) for names in IN_TABLE_1]
    found += [compared(results, world, *names) for world in ("drawn", "physical") for names in IN_TABLE_3]
    note = (
        "Ratios are of improvement ratios; the published ones are computed from what Tables 1 and 3 print. Table 3 has "
        "another 'before' for each model: its test segments differ, so that its own rows cannot be compared."
    )
    return claims_table(found, counted(len(found[0].ratios)), (note,))


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
        "claims_table_2", "Claims: the best cell of Table 2", columns, tuple(lines), counted(len(grid)), notes
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
        claim = compared(results, "drawn", better, other)
        out[name] = Cell(claim.published, claim.ratios)
    return out

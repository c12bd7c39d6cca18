"""The claims of paper 000 that can be tested: who is better than whom, flight by flight."""

from collections.abc import Callable, Sequence
from itertools import pairwise

from scipy.stats import kendalltau

from magsim.papers.claims import Claim, claims_table, ratios
from magsim.papers.paper import Results
from magsim.papers.paper_000 import worlds
from magsim.papers.paper_000.found import by_default, of_method, over, share_of_recipe
from magsim.papers.paper_000.published import NETWORKS, RANKING, SIMULATED
from magsim.papers.tables import Cell, PaperTable

NAMES = {**NETWORKS, "tl16": "T-L"}

Scores = Callable[[str], tuple[float, ...]]
"""Improvement ratios of a method, flight by flight."""

NOTES = (
    (
        "The paper's order is MagTCN, ResNet, T-L, BPNN, WilliamsNN, of one run each. Ratios are of improvement ratios "
        "of circuit 2 against truth."
    ),
    (
        "Training against structure: with T-L first, by their presets default, the same kinds of networks, of other "
        "sizes, learn what Tolles-Lawson leaves."
    ),
)


def tau_of(scores: Sequence[float]) -> float:
    """Return Kendall's tau of scores that are given in the paper's order, best first: 1 where they fall.

    The form b, in which ties count for neither order; 0 where all are equal.
    """
    return float(kendalltau(range(len(scores), 0, -1), scores).statistic) if len(set(scores)) > 1 else 0.0


def _as_printed(results: Results) -> Scores:
    (part,) = worlds.JUDGED[worlds.SIMULATED]
    return lambda method: of_method(results, method, worlds.SIMULATED, f"ir {part}")


def _stage_first(results: Results) -> Scores:
    """Return scores with Tolles-Lawson first, which is itself as it was."""
    (part,) = worlds.JUDGED[worlds.SIMULATED]
    return lambda method: by_default(results, method, f"ir {part}")


def claims(results: Results) -> PaperTable:
    """Return the paper's order, pair by pair, as the paper trains and with Tolles-Lawson first."""
    found = []
    for scores, how in ((_as_printed(results), ""), (_stage_first(results), ", T-L first")):
        for better, worse in pairwise(RANKING):
            parts = [NAMES[one] for one in (better, worse) if one in NETWORKS and share_of_recipe(results, one) < 1.0]
            remark = f"no test of the claim: {' and '.join(parts)} had a part of the training" if parts else ""
            found.append(
                Claim(
                    f"{NAMES[better]} over {NAMES[worse]}{how}",
                    ratios(scores(better), scores(worse)),
                    None if how else SIMULATED[better][1] / SIMULATED[worse][1],
                    "" if how else remark,
                    added=bool(how),
                )
            )
    return claims_table(found, over(results, worlds.SIMULATED), NOTES)


def headlines(results: Results) -> dict[str, Cell]:
    """Return how far the order of Table 2 is the paper's, and MagTCN over Tolles-Lawson."""
    out = {}
    for scores, how in ((_as_printed(results), ""), (_stage_first(results), "_stage_first")):
        orders = tuple(tau_of(flight) for flight in zip(*map(scores, RANKING), strict=True))
        out[f"table2_order_kendall_tau{how}"] = Cell(None if how else 1.0, orders)
        printed = None if how else SIMULATED["magtcn"][1] / SIMULATED["tl16"][1]
        out[f"ratio_magtcn_over_tl{how}"] = Cell(printed, ratios(scores("magtcn"), scores("tl16")))
    return out

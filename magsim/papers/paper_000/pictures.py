"""Figures of paper 000: the losses (Figures 8 and 10), and the tables over the flights."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from magsim.papers.paper import Results
from magsim.papers.paper_000 import published, worlds
from magsim.papers.paper_000.found import by_default, of_method, trained
from magsim.papers.paper_000.published import EPOCHS, NETWORKS

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def figures(results: Results) -> Mapping[str, "Figure"]:
    """Return all figures."""
    return {
        "figure_8": _losses(results, worlds.SIMULATED, published.LOSS_SIMULATED_NT2),
        "figure_10": _losses(results, worlds.LINES, published.LOSS_REAL_NT2),
        "table_2": _scores(results),
    }


def _losses(results: Results, world: str, printed: Mapping[str, tuple[float, ...]]) -> "Figure":
    from magsim.plots.spread import curves

    lines = {}
    for network, name in NETWORKS.items():
        found = trained(results, network, world)
        lines[name] = (found[0]["epochs"], np.median([one["losses"] for one in found], axis=0).tolist())
    points = {name: (EPOCHS, printed[network]) for network, name in NETWORKS.items()}
    return curves(lines, "epoch", "training loss [nT$^2$]", points=points, logarithmic=True)


def _scores(results: Results) -> "Figure":
    from magsim.plots.spread import Series, spread

    methods = {**NETWORKS, "tl16": "T-L"}
    (part,) = worlds.JUDGED[worlds.SIMULATED]
    values = [of_method(results, method, worlds.SIMULATED, f"ir {part}") for method in methods]
    printed = {number: published.SIMULATED[method][1] for number, method in enumerate(methods)}
    first = [by_default(results, network, f"ir {part}") for network in NETWORKS]
    return spread(
        [*methods.values()],
        [Series("as the paper trains", values, printed), Series("T-L first", [*first, ()])],
        "improvement ratio",
        logarithmic=True,
    )

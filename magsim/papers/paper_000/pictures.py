"""Figures of paper 000: losses (8 and 10), what is left of one flight (9, 11 and 12), and Table 2 over the flights."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from magsim.papers.paper import Results, found_of
from magsim.papers.paper_000 import published, worlds
from magsim.papers.paper_000.found import by_default, of_method, trained
from magsim.papers.paper_000.published import EPOCHS, NETWORKS

if TYPE_CHECKING:
    from matplotlib.figure import Figure


WINDOW_ROWS = 100
"""Of the running STD: 10 s, a maneuver's time."""


def figures(results: Results) -> Mapping[str, "Figure"]:
    """Return all figures."""
    (circuit,) = worlds.JUDGED[worlds.SIMULATED]
    first, second = worlds.JUDGED[worlds.LINES]
    return {
        "figure_8": _losses(results, worlds.SIMULATED, published.LOSS_SIMULATED_NT2),
        "figure_9": _left(results, worlds.SIMULATED, circuit),
        "figure_10": _losses(results, worlds.LINES, published.LOSS_REAL_NT2),
        "figure_11": _left(results, worlds.LINES, first),
        "figure_12": _left(results, worlds.LINES, second),
        "table_2": _scores(results),
    }


def _left(results: Results, world: str, part: str) -> "Figure":
    """Draw what each method leaves in band of the first flight, as a running STD: curves over three decades."""
    from magsim.plots.spread import curves

    lines = {}
    for method, name in {"none": "origin", **NETWORKS, "tl16": "T-L"}.items():
        drawn = {"network": method, "output": "interference"} if method in NETWORKS else {"method": method}
        work = "train" if method in NETWORKS else "judge"
        (found,) = found_of(results, work, world=world, curve=True, **drawn)
        curve = found[f"curve {part}"]
        lines[name] = (curve["time_s"], running_std(np.array(curve["left"]), WINDOW_ROWS).tolist())
    return curves(lines, "time [s]", f"in band, STD over {WINDOW_ROWS / 10:g} s [nT]", logarithmic=True)


def running_std(values: np.ndarray, rows: int) -> np.ndarray:
    """Return the STD of a window around each value, (n,); near the ends of what there is of it."""
    weights = np.ones(rows)
    count, first, second = (np.convolve(one, weights, mode="same") for one in (np.ones(len(values)), values, values**2))
    return np.sqrt(np.maximum(second / count - (first / count) ** 2, 0.0))


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

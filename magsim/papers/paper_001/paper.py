"""Paper 001 as it is re-run: its two tables, its curves of R2, its claims."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from magsim.papers.claims import Claim, claims_table, ratios
from magsim.papers.paper import Paper, Results, found_of, values_of
from magsim.papers.paper_001.published import TABLE_1, TABLE_2, Printed
from magsim.papers.paper_001.work import CURVE_STEPS, NETWORKS, flights, tasks, work
from magsim.papers.tables import BESIDE, Cell, Column, Line, PaperTable, counted

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NAMES: Mapping[str, str] = {
    "least_squares": "LS",
    "ridge": "RR",
    "bp": "BP",
    "res_bp": "Res-Bp",
    "least_squares_broad": "LS, unfiltered",
    "ridge_broad": "RR, unfiltered",
    "bp_held_out": "BP, one heading held out",
    "res_bp_held_out": "Res-Bp, one heading held out",
    "bp_default": "BP, our default",
    "res_bp_default": "Res-Bp, our default",
    "tl16": "T-L, 16 columns",
    **BESIDE,
}
"""Of each method in the tables."""

COLUMNS = (
    Column("before_nt", "STDu", "nT"),
    Column("std_paper_nt", "STDc", "nT"),
    Column("ir_paper", "IR", "", 2),
    Column("ir_legs", "IR without trends", "", 2),
    Column("std_nt", "STD, truth", "nT"),
    Column("ir", "IR, truth", "", 2),
    Column("r2", "R2, truth", "", 4),
)
BELOW_1 = ("least_squares_broad", "ridge_broad", "tl16", "tl16_auxiliary", "exact_norm", "noise_floor")
BELOW_2 = (
    "bp_held_out", "res_bp_held_out", "least_squares", "bp_default", "res_bp_default", "tl16_auxiliary", "exact_norm",
    "noise_floor",
)  # fmt: skip
EPOCH_STEPS = 21
"""Of 256 rows, in a flight of 9 minutes."""

NOTES = (
    (
        "STDu, STDc and IR are of the reading in 0.1 to 0.6 Hz, in which the drone of these flights was given the "
        "paper's level; the paper names no filter. Without one, less the linear trend of each straight leg, the "
        "reading has 3.7 nT before compensation (IR without trends). R2 is that of all of the interference, which has "
        "35 nT STD, most of it between headings."
    ),
    (
        "The paper has another STDu of flight A in Table 1 (2.171) than in Table 2 (2.112), so figures compare within "
        "a table only, and one run of each; here pairs of flights on other days, each with start weights of its own."
    ),
)


def _cells(results: Results, method: str, judged: str, printed: Printed | None) -> dict[str, Cell]:
    published = {} if printed is None else dict(zip(("before_nt", "std_paper_nt", "ir_paper"), printed, strict=True))
    return {
        column.key: Cell(published.get(column.key), _values(results, column.key, method, judged)) for column in COLUMNS
    }


def _values(results: Results, figure: str, method: str, judged: str) -> tuple[float, ...]:
    return values_of(results, figure, "judge", method=method, judged=judged, curve=False)


def _over(results: Results) -> str:
    return counted(len(_values(results, "ir", "noise_floor", "A")), "pairs of flights")


REMARKS_1: Mapping[str, str] = {
    "RR": "equal to least squares: on scaled columns, which the paper does not mention, cross-validation asks for "
    "hardly any ridge, and the dependence of the 18 columns is solved by singular values; the paper's gain of 10 % "
    "may be that of an inverse of X^T X, which is singular by construction",
    "RR, unfiltered": "fitted as the paper's equations read, without a filter, with a constant beside them",
}
REMARKS_2: Mapping[str, str] = {
    "BP, flight B": "sizes and recipe are not printed: 18 - 64 - 64 - 1, Adam at 1e-3, 200 epochs, 256 rows a step "
    "(estimate)",
    "Res-Bp, flight B": "three layers of 64 units with skips (estimate), else as BP",
    "Res-Bp, flight B, one heading held out": "trained on three headings and stopped by the fourth, a network "
    "on single samples does not know the fourth; the paper's must have learned all of a flight",
    "Res-Bp, flight B, our default": "few tanh units on what Tolles-Lawson leaves, by Levenberg-Marquardt, and no more "
    "of their output than holds on rows that were not learned",
    "exact_norm (ours), flight B": "reads the currents, which no method of the paper does: that of the motor is what "
    "Tolles-Lawson leaves here",
}


def table_1(results: Results) -> PaperTable:
    """Return Table 1: linear methods, trained on flight B, judged on A."""
    lines = []
    for method in ("least_squares", "ridge", *BELOW_1):
        name = NAMES[method]
        cells = _cells(results, method, "A", TABLE_1.get(("A", method)))
        lines.append(Line(name, cells, REMARKS_1.get(name, ""), added=method in BELOW_1))
    title = "Table 1: linear methods on flight A, trained on flight B"
    return PaperTable("table_1", title, COLUMNS, tuple(lines), _over(results), NOTES)


def table_2(results: Results) -> PaperTable:
    """Return Table 2: networks, each flight with what was trained on the other."""
    lines = []
    for added, methods in ((False, NETWORKS), (True, BELOW_2)):
        for judged in ("B", "A"):
            for method in methods:
                name = f"{NAMES[method]}, flight {judged}"
                if method.endswith(("_held_out", "_default")):
                    network, how = NAMES[method].split(", ")
                    name = f"{network}, flight {judged}, {how}"
                cells = _cells(results, method, judged, None if added else TABLE_2[judged, method])
                lines.append(Line(name, cells, REMARKS_2.get(name, ""), added=added))
    title = "Table 2: BP and Res-Bp, each flight with the network of the other"
    return PaperTable("table_2", title, COLUMNS, tuple(lines), _over(results), NOTES)


def _ratios(results: Results, first: str, second: str, judged: str, figure: str = "ir_paper") -> tuple[float, ...]:
    return ratios(*(_values(results, figure, method, judged) for method in (first, second)))


def claims(results: Results) -> PaperTable:
    """Return what the paper claims, as ratios of improvement ratios, and what comes of it against truth."""
    ls, rr = (TABLE_1["A", method].ir for method in ("least_squares", "ridge"))
    bp, res = ({flight: TABLE_2[flight, method].ir for flight in "AB"} for method in NETWORKS)
    found = [Claim("RR over LS, flight A", _ratios(results, "ridge", "least_squares", "A"), rr / ls)]
    for flight in ("B", "A"):
        own = _ratios(results, "res_bp", "bp", flight)
        found.append(Claim(f"Res-Bp over BP, flight {flight}", own, res[flight] / bp[flight]))
    found.append(Claim("Res-Bp over LS, flight A", _ratios(results, "res_bp", "least_squares", "A"), res["A"] / ls))
    found.append(Claim("Res-Bp over RR, flight A", _ratios(results, "res_bp", "ridge", "A"), res["A"] / rr))
    found.append(Claim("BP over LS, flight A", _ratios(results, "bp", "least_squares", "A"), bp["A"] / ls))
    for flight in ("B", "A"):
        errors = _unexplained(results, judged=flight, curve=False)
        found.append(Claim(f"Res-Bp over BP by 1 - R2, flight {flight}", errors))
        early = _unexplained(results, judged=flight, curve=True, steps=CURVE_STEPS[0])
        found.append(Claim(f"the same after {CURVE_STEPS[0] / EPOCH_STEPS:.0f} epochs, flight {flight}", early))
    note = (
        "Ratios of the paper's improvement ratios. Those over LS and RR are across its two tables, which have another "
        "STD before compensation of the same flight. Claims on R2 are curves alone (Figure 10)."
    )
    return claims_table(found, _over(results), (note,))


def _unexplained(results: Results, **params: object) -> tuple[float, ...]:
    """Return 1 - R2 of BP over that of Res-Bp, pair by pair."""
    rest = [[1.0 - r2 for r2 in values_of(results, "r2", "judge", method=method, **params)] for method in NETWORKS]
    return ratios(*rest)


def headlines(results: Results) -> dict[str, Cell]:
    """Return the ratios that the paper stands for."""
    ls, res = TABLE_1["A", "least_squares"].ir, TABLE_2["A", "res_bp"].ir
    return {
        "ratio_resbp_over_ls": Cell(res / ls, _ratios(results, "res_bp", "least_squares", "A")),
        "ratio_resbp_over_ls_truth": Cell(None, _ratios(results, "res_bp", "least_squares", "A", "ir")),
        "ratio_resbp_over_bp": Cell(
            TABLE_2["B", "res_bp"].ir / TABLE_2["B", "bp"].ir, _ratios(results, "res_bp", "bp", "B")
        ),
    }


def tables(results: Results) -> list[PaperTable]:
    """Return Tables 1 and 2, and the claims."""
    return [table_1(results), table_2(results), claims(results)]


def _judged_curve(results: Results, method: str) -> tuple[list[float], list[float]]:
    """Return epochs, and the median of R2 over all flights that were not learned."""
    counts = sorted({task.params["steps"] for task, _ in results if task.params["curve"]})
    found = [values_of(results, "r2", "judge", method=method, curve=True, steps=steps) for steps in counts]
    last = _losses(results, method)[0, -1, 0]
    found.append(values_of(results, "r2", "judge", method=method, curve=False))
    return [steps / EPOCH_STEPS for steps in (*counts, last)], [float(np.median(values)) for values in found]


def _learned_curve(results: Results, method: str) -> tuple[list[float], list[float]]:
    """Return epochs, and the median of R2 over all flights that were learned: 1 less the loss."""
    losses = _losses(results, method)
    return [*(losses[0, :, 0] / EPOCH_STEPS)], [*(1.0 - np.median(losses[:, :, 1], axis=0))]


def _losses(results: Results, method: str) -> np.ndarray:
    """Return steps and loss of each training, (trainings, reports, 2)."""
    return np.array([found["loss"] for found in found_of(results, "judge", method=method, curve=False)])


def figures(results: Results) -> Mapping[str, "Figure"]:
    """Return Figure 10, R2 over the training as what it lacks of 1, and both tables as a picture."""
    from magsim.plots.spread import Series, curves, spread

    lines = {}
    for method in NETWORKS:
        for where, (epochs, r2) in (
            ("learned", _learned_curve(results, method)),
            ("other flight", _judged_curve(results, method)),
        ):
            lines[f"{NAMES[method]}, {where}"] = epochs, [1.0 - value for value in r2]
    methods = ("least_squares", "ridge", *NETWORKS)
    series = []
    for judged in ("B", "A"):
        values = [_values(results, "ir_paper", method, judged) for method in methods]
        known = {**TABLE_1, **TABLE_2}
        published = {k: known[judged, method].ir for k, method in enumerate(methods) if (judged, method) in known}
        series.append(Series(f"flight {judged}", values, published))
    return {
        "figure_10_r2": curves(lines, "epoch", "1 - R2", logarithmic=True),
        "tables_1_2": spread([NAMES[method] for method in methods], series, "improvement ratio"),
    }


PAPER = Paper(
    "001",
    "Res-Bp, a perceptron with skips",
    "P. Yu, F. Bi, J. Jiao, X. Zhao, S. Zhou and Z. Su: An Aeromagnetic Compensation Algorithm Based on a Residual "
    "Neural Network, Appl. Sci. 2022, 12, 10759",
    flights,
    tasks,
    work,
    headlines,
    tables,
    figures,
    gpu=True,
)

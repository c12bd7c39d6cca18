"""Paper 002, a bird on a rope: Tolles-Lawson with Taylor terms of the field, learned on a diamond, judged on a square.

Published figures: the text on Figures 6 and 7 of Zhou et al.; the figures themselves print no numbers.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from magsim.benchmark import evaluate
from magsim.papers.paper import Effort, Found, Paper, PaperFlight, Results, Surroundings, Task, values_of
from magsim.papers.tables import BESIDE, Cell, Column, Line, PaperTable, counted
from magsim.recording import Recording

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ORDERS = range(5)
HEADINGS = (0, 90, 180, 270)
NAMES: Mapping[int, str] = {0: "north", 90: "east", 180: "south", 270: "west"}

PLAIN = "tl16_measured"
WITH_GRADIENT: Mapping[int, str] = {order: f"tl16_gradient:order={order}" for order in ORDERS}
PRINTED: Mapping[str, str] = {
    "none": "no compensation",
    PLAIN: "Tolles-Lawson",
    **{method: f"N = {order}" for order, method in WITH_GRADIENT.items()},
}
METHODS: Mapping[str, str] = {**PRINTED, **BESIDE}
"""Name in the tables of each method."""

GAIN_ORDER_3_PCT = 6.0
"""Over the compensation without gradient, N = 3: the text on Figure 6."""

IR_HEADING: Mapping[int, float] = {0: 2.47, 90: 2.75}
"""With gradient terms, by heading: the text on Figure 7."""

SCORES: Mapping[str, str] = {"ir_003": "IR 0.03 Hz", "ir": "IR, truth"}


def flights(effort: Effort) -> list[PaperFlight]:
    """Return pairs of flights over the same ground: other sways, gusts and noise in each."""
    out = []
    for number in range(effort.count(12, 2)):
        out += [
            PaperFlight(f"{pattern}_{number:02d}", f"papers/002_{pattern}", (f"seed={first + number}",))
            for pattern, first in (("diamond", 1000), ("square", 2000))
        ]
    return out


def tasks(effort: Effort) -> list[Task]:
    """Return the fit of each method to each diamond."""
    pairs = [(f"diamond_{number:02d}", f"square_{number:02d}") for number in range(effort.count(12, 2))]
    return [Task("judge", pair, {"method": method}) for method in METHODS for pair in pairs]


def work(task: Task, recordings: Sequence[Recording], _surroundings: Surroundings) -> Found:
    """Fit one method to the diamond, judge it on the square: both scores, whole and by heading."""
    method = task.params["method"]
    report = evaluate(list(recordings), [method])
    square = recordings[1].name
    segments = {"whole": "test", **{NAMES[heading]: f"heading {heading}" for heading in HEADINGS}}
    return {
        f"{score} {where}": report.value(method, score, recording=square, segment=segment)
        for score in SCORES
        for where, segment in segments.items()
    }


def headlines(results: Results) -> dict[str, Cell]:
    """Return the gain of order 3 over Tolles-Lawson in the paper's score and against truth [%]."""
    gains = {score: _gains(results, WITH_GRADIENT[3], PLAIN, score) for score in SCORES}
    return {
        "gain_order3_pct": Cell(GAIN_ORDER_3_PCT, gains["ir_003"]),
        "gain_order3_truth_pct": Cell(None, gains["ir"]),
    }


def tables(results: Results) -> list[PaperTable]:
    """Return Figures 6 and 7 as tables."""
    return [_figure_6(results), *(_figure_7(results, score) for score in SCORES)]


def _over(results: Results) -> str:
    return counted(len(values_of(results, "ir whole", "judge", method="none")), "pairs of flights")


def _gains(results: Results, method: str, base: str, score: str) -> tuple[float, ...]:
    """Return the gain of a method over another, pair by pair [%]."""
    own, other = (values_of(results, f"{score} whole", "judge", method=name) for name in (method, base))
    return tuple(100.0 * (a / b - 1.0) for a, b in zip(own, other, strict=True))


def _figure_6(results: Results) -> PaperTable:
    remarks = {
        "N = 3": "the paper's 6 % is of one flight, in a score that counts what of the ground's field lies above "
        "0.03 Hz as interference; even a perfect compensator gains little in it here, and the gain shows against "
        "truth alone",
        "N = 0": "height alone: the paper does not say whether its N = 0 has it",
    }
    lines = []
    for method, name in METHODS.items():
        cells = {score: Cell(None, values_of(results, f"{score} whole", "judge", method=method)) for score in SCORES}
        for score in SCORES:
            published = GAIN_ORDER_3_PCT if name == "N = 3" and score == "ir_003" else None
            if method not in {"none", PLAIN, "noise_floor"}:
                cells[f"gain {score}"] = Cell(published, _gains(results, method, PLAIN, score))
        lines.append(Line(name, cells, remarks.get(name, ""), added=method in BESIDE))
    columns = [Column(score, name, "", 2) for score, name in SCORES.items()]
    columns += [Column(f"gain {score}", f"gain of {name}", "%", 1) for score, name in SCORES.items()]
    note = (
        "Figure 6 prints no numbers; its text says that N = 1 is above N = 0, N = 2 and 3 above N = 1, and N = 4 "
        "slightly below N = 3, which is the best. Gains are over Tolles-Lawson, pair by pair."
    )
    return PaperTable(
        "figure_6", "Figure 6: improvement ratio by order N", tuple(columns), tuple(lines), _over(results), (note,)
    )


def _figure_7(results: Results, score: str) -> PaperTable:
    lines = []
    for method, name in METHODS.items():
        cells = {}
        for heading in HEADINGS:
            published = IR_HEADING.get(heading) if name == "N = 3" and score == "ir_003" else None
            values = values_of(results, f"{score} {NAMES[heading]}", "judge", method=method)
            cells[NAMES[heading]] = Cell(published, values)
        remark = (
            "gusts and geology are ours; the headings of a paper's single flight in one wind are no law"
            if name == "N = 3" and score == "ir_003"
            else ""
        )
        lines.append(Line(name, cells, remark, added=method in BESIDE))
    columns = tuple(Column(name, name, "", 2) for name in NAMES.values())
    title = f"Figure 7: {SCORES[score]} by heading"
    return PaperTable(f"figure_7_{score}", title, columns, tuple(lines), _over(results))


def figures(results: Results) -> Mapping[str, "Figure"]:
    """Return Figures 6 and 7 as pictures, over the pairs of flights."""
    from magsim.plots.spread import Series, spread

    orders = [_values(results, score, "whole", PRINTED) for score in SCORES]
    six = [Series(name, values) for name, values in zip(SCORES.values(), orders, strict=True)]
    seven = []
    for order in (0, 1, 3):
        method = WITH_GRADIENT[order]
        values = [values_of(results, f"ir_003 {where}", "judge", method=method) for where in NAMES.values()]
        published = {HEADINGS.index(heading): ir for heading, ir in IR_HEADING.items()} if order == 3 else {}
        seven.append(Series(PRINTED[method], values, published))
    return {
        "figure_6": spread([*PRINTED.values()], six, "improvement ratio"),
        "figure_7": spread([*NAMES.values()], seven, "improvement ratio, high-pass 0.03 Hz"),
    }


def _values(results: Results, score: str, where: str, methods: Iterable[str]) -> list[tuple[float, ...]]:
    return [values_of(results, f"{score} {where}", "judge", method=method) for method in methods]


PAPER = Paper(
    "002",
    "Towed bird with geomagnetic gradient",
    "Z. Zhou, Z. Liu, W. Li, Y. Wang and C. Wang: Analyze and improve the influence of geomagnetic gradient on "
    "aeromagnetic compensation in a towed bird, preprint",
    flights,
    tasks,
    work,
    headlines,
    tables,
    figures,
)

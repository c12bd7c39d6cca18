"""Tables 1 to 6 of paper 000, and what becomes of its claims."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from magsim.papers.paper import Results, found_of, values_of
from magsim.papers.paper_000 import published, worlds
from magsim.papers.paper_000.claims import claims
from magsim.papers.paper_000.found import by_default, of_method, over, recipe_in_words, share_of_recipe, trained
from magsim.papers.paper_000.published import COST, EPOCHS, NETWORKS
from magsim.papers.paper_000.recipes import PART
from magsim.papers.tables import BESIDE, Cell, Column, Line, PaperTable

PRESENT = (
    Column("std_nt", "STD", "nT", 3),
    Column("ir", "IR", "", 1),
    Column("std_paper_nt", "STD of the reading", "nT", 3),
    Column("ir_paper", "IR of the reading", "", 1),
    Column("rmse0_nt", "broadband STD", "nT", 2),
)


def tables(results: Results) -> list[PaperTable]:
    """Return all tables, those of the paper first."""
    first, second = worlds.JUDGED[worlds.LINES]
    lines = "nearest simulated flights, not the paper's data"
    return [
        _losses(results, worlds.SIMULATED, "table_1", "Table 1: training loss", published.LOSS_SIMULATED_NT2),
        _table_2(results),
        _losses(results, worlds.LINES, "table_3", f"Table 3: training loss, {lines}", published.LOSS_REAL_NT2),
        _scores_of_lines(results, "table_4", f"Table 4: line 1002.20, {lines}", first),
        _scores_of_lines(results, "table_5", f"Table 5: line 1006.06, {lines}", second),
        _table_6(results),
        claims(results),
        _outputs(results),
    ]


def _recipe_notes(results: Results, world: str) -> tuple[str, ...]:
    """Return how much of the paper's training each network had."""
    notes = []
    for network, name in NETWORKS.items():
        best = np.median([found["best epoch"] for found in trained(results, network, world)])
        notes.append(f"{name}: {recipe_in_words(results, network)}; best on leg 4 after epoch {best:.0f} (median).")
    return tuple(notes)


def _losses(results: Results, world: str, key: str, title: str, printed: Mapping[str, Sequence[float]]) -> PaperTable:
    lines = []
    for number, epoch in enumerate(EPOCHS):
        cells = {}
        for network in NETWORKS:
            values = tuple(loss_at(found, epoch) for found in trained(results, network, world))
            cells[network] = Cell(printed[network][number], values)
        remark = (
            "ours is the loss of the untrained network, which puts out the mean: the square of the interference's STD; "
            "the paper does not say what its epoch 0 is"
            if epoch == 0
            else ""
        )
        lines.append(Line(f"epoch {epoch}", cells, remark))
    columns = tuple(Column(network, name, "nT^2", 2) for network, name in NETWORKS.items())
    note = "Ours are means over two epochs or more, on the rows that are learned; MagTCN's is that of eq. 39."
    return PaperTable(key, title, columns, tuple(lines), over(results, world), (note, *_recipe_notes(results, world)))


def loss_at(found: Mapping[str, Sequence[float]], epoch: float) -> float:
    """Return the loss of the validation nearest to an epoch."""
    return float(found["losses"][int(np.argmin(np.abs(np.asarray(found["epochs"]) - epoch)))])


def _cells(
    results: Results, method: str, world: str, part: str, printed: Mapping[str, float] | None = None
) -> dict[str, Cell]:
    return {
        column.key: Cell((printed or {}).get(column.key), of_method(results, method, world, f"{column.key} {part}"))
        for column in PRESENT
    }


def _printed(scores: published.Scores, method: str) -> dict[str, float]:
    return dict(zip(("std_nt", "ir"), scores[method], strict=True)) if method in scores else {}


def _table_2(results: Results) -> PaperTable:
    world = worlds.SIMULATED
    (part,) = worlds.JUDGED[world]
    remarks = {
        "tl16": "another aircraft's field of the same size; ours is fitted to the label in band",
    }
    lines = [
        Line(
            "before compensation",
            _cells(results, "none", world, part, {"std_nt": published.RAW_SIMULATED_NT}),
            "the paper's 16.2 nT are its STD times its IR; the aircraft and its maneuvers are ours",
        )
    ]
    for method, name in {**NETWORKS, "tl16": "T-L Model"}.items():
        cells = _cells(results, method, world, part, _printed(published.SIMULATED, method))
        lines.append(Line(name, cells, remarks[method] if method in remarks else _why(results, method, world)))
    for network, name in NETWORKS.items():
        cells = {column.key: Cell(None, by_default(results, network, f"{column.key} {part}")) for column in PRESENT}
        lines.append(Line(f"{name}, T-L first (default)", cells, added=True))
    lines += [Line(name, _cells(results, method, world, part), added=True) for method, name in BESIDE.items()]
    notes = (
        (
            "STD and IR are in 0.1 to 0.6 Hz, of the error against truth; those of the reading take the compensated "
            "reading as the error, so that the field along the track, a constant in the paper's world, counts in ours."
        ),
        *_recipe_notes(results, world),
    )
    title = "Table 2: circuit 2 of the simulated flight"
    return PaperTable("table_2", title, PRESENT, tuple(lines), over(results, world), notes)


def _why(results: Results, network: str, world: str) -> str:
    """Return why a network by the paper's recipe has other scores."""
    if share_of_recipe(results, network) < 1.0:
        return "a part of the paper's training" + ("; the whole wants --device cuda" if network in PART else "")
    ours = "sizes and the choice of the epoch are ours, the paper tells neither"
    if world == worlds.LINES:
        return ours
    return (
        "circuit 1 is learned below the paper's losses (Table 1), but circuit 2 has other amplitudes, and a network "
        f"without T-L knows the maneuvers that it has seen (on lines that repeat them: Table 4); {ours}"
    )


def _scores_of_lines(results: Results, key: str, title: str, part: str) -> PaperTable:
    world = worlds.LINES
    scores, raw = {
        "1002.20": (published.REAL_1002_20, published.RAW_1002_20_NT),
        "1006.06": (published.REAL_1006_06, published.RAW_1006_06_NT),
    }[part]
    lines = [Line("before compensation", _cells(results, "none", world, part, {"std_nt": raw}))]
    for network, name in NETWORKS.items():
        cells = _cells(results, network, world, part, _printed(scores, network))
        lines.append(Line(name, cells, _why(results, network, world)))
    below: Iterable[tuple[str, str]] = {"tl16": "T-L Model", **BESIDE}.items()
    lines += [Line(name, _cells(results, method, world, part), added=True) for method, name in below]
    notes = (
        (
            "The paper's data are flights of a real aircraft, ours simulated ones of the same type: nothing can be "
            "expected to agree but the order of magnitude."
        ),
        "The paper prints no T-L row for its real lines.",
    )
    return PaperTable(key, title, PRESENT, tuple(lines), over(results, world), notes)


def _table_6(results: Results) -> PaperTable:
    lines = []
    for network, name in NETWORKS.items():
        ms, million = COST[network]
        cells = {
            "ms": Cell(ms, values_of(results, "ms", "cost", network=network)),
            "million": Cell(million, values_of(results, "million", "cost", network=network)),
            "parameters": Cell(None, values_of(results, "parameters", "cost", network=network)),
        }
        lines.append(Line(name, cells))
    columns = (
        Column("ms", "time of an output", "ms", 3),
        Column("million", "operations", "million", 3),
        Column("parameters", "parameters", "", 0),
    )
    outputs = [int(found["outputs"]) for found in found_of(results, "cost")]
    notes = (
        (
            "The paper's times are of a GeForce RTX 4060 Ti, ours of one thread of this machine's CPU or of the "
            f"device that was asked for, batch 1, mean of {min(outputs):,} to {max(outputs):,}; the paper's of 30,000."
        ),
        (
            'Operations are multiply-accumulates; the paper prints them as "MB". The sizes of the networks here were '
            "chosen so that they meet its numbers: they are no evidence."
        ),
        "Its text gives BPNN the figures of WilliamsNN; its table is followed.",
    )
    return PaperTable("table_6", "Table 6: cost of an output", columns, tuple(lines), "one run", notes, timed=True)


def _outputs(results: Results) -> PaperTable:
    """Return what the output is: interference, or the clean field, as the paper has it."""
    world = worlds.SIMULATED
    (part,) = worlds.JUDGED[world]
    columns = (PRESENT[0], PRESENT[1], Column("gain", "anomaly gain", "", 3))
    lines = []
    for network, name in NETWORKS.items():
        for output in ("clean field", "interference"):
            found = trained(results, network, world, output)
            cells = {
                column.key: Cell(None, tuple(float(one[f"{column.key} {part}"]) for one in found)) for column in columns
            }
            best = [one["best epoch"] for one in found]
            constant = "the network before its first step, a constant, is the best on leg 4" if not any(best) else ""
            remark = constant if output == "clean field" else ""
            lines.append(Line(f"{name}, output is the {output}", cells, remark, added=output == "interference"))
    notes = (
        (
            "The anomaly gain is the share of injected anomalies, of the worst of three heights, in the compensated "
            "signal: 1 is right. A network whose output is the clean field does not see the reading: none reaches it."
        ),
    )
    count = len(trained(results, "bpnn", world, output="clean field"))
    number = f"{over(results, world)}, of the clean field {count}"
    title = "What is put out: the clean field, as in the paper, or the interference"
    return PaperTable("outputs", title, columns, tuple(lines), number, notes)

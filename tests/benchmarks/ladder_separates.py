"""What each level of the ladder costs, how sets scatter, and who stands where: on development sets that no board uses.

Run ``python tests/benchmarks/ladder_separates.py [--json] [--sets 12] [--jobs 2]``. Two methods that know every
level's truth from labels say what a level costs: Tolles-Lawson with 16 terms, and the exact norm without channels and
memory, each against its own level L0. Then ours and Tolles-Lawson with and without channels, on the fluxgate's, the
INS's and the calibrated direction, and networks of the papers on the same inputs.
"""

import argparse
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from magsim.benchmark.contest import Allowance, Contestant
from magsim.benchmark.statistics import geometric_mean
from magsim.ladder.board import Board, LevelTable
from magsim.ladder.definition import read_ladder
from magsim.ladder.run import Settings, run_ladder
from tests.benchmarks.rows import Row, at_least, finish, stated

SEED = 17_001
"""Development: no published board has these sets."""

COSTS = ("tl16", "exact_norm_plain")
PLAIN = "exact_norm:channels=[]:memory=false"

METHODS = {
    "tl16": "tl16",
    "tl18": "tl18",
    "tl16_channels": "tolles_lawson:terms=16:auxiliary=['currents','voltages','surfaces']",
    "tl18_channels": "tolles_lawson:terms=18:auxiliary=['currents','voltages','surfaces']",
    "tl16_ins": "tl16_ins",
    "tl16_ins_channels": "tolles_lawson:terms=16:direction=ins:auxiliary=['currents','voltages','surfaces']",
    "tl16_calibrated": "tl16_calibrated",
    "tl18_calibrated": "tolles_lawson:terms=18:direction=calibrated",
    "tl16_auxiliary": "tl16_auxiliary",
    "tl18_auxiliary": "tolles_lawson:terms=18:direction=calibrated:auxiliary=['currents','voltages','surfaces']",
    "exact_norm": "exact_norm",
    "exact_norm_whole": "exact_norm_whole",
}
"""Names on the board, and what is run."""

NETWORKS = ("bp", "subnetworks", "magtcn", "res_bp", "williams")
RANKED = ("L0", "L4", "L5d", "L6", "LF", "LX")


def settings(levels: Sequence[str], sets: int, methods: Mapping[str, str], networks: Sequence[str] = ()) -> Settings:
    """Return what is run."""
    entries = tuple(Contestant(name, text) for name, text in methods.items())
    return Settings(
        tuple(levels),
        ("open",),
        sets,
        SEED,
        entries,
        tuple(Contestant(name, name, quick=True) for name in networks),
        read_ladder().networks,
        4,
        Allowance(),
        "",
    )


def spread(board: Board) -> float:
    """Return the factor by which sets scatter about their mean: the IR of Tolles-Lawson on L0."""
    values = [s.value for s in board.scores if (s.level, s.method, s.flight, s.metric) == ("L0", "tl16", "all", "ir")]
    return float(np.exp(np.std(np.log(values), ddof=1)))


def costs(board: Board) -> list[Row]:
    """Return what each level costs each of the two methods, by set against its own L0."""
    left: dict[tuple[str, str, str], dict[int, float]] = {}
    for s in board.scores:
        if s.flight == "all" and s.metric == "std_nt":
            left.setdefault((s.method, s.level, s.sensor), {})[s.set] = s.value
    out = []
    for (method, level, sensor), own in left.items():
        base = left.get((method, "L0", "cabin"), {})
        if method not in COSTS or level == "L0":
            continue
        shared = sorted(set(base) & set(own))
        ratio = geometric_mean(np.array([own[k] / base[k] for k in shared]))
        free = "; costs nothing" if ratio.low <= 1.1 and ratio.value < 1.1 else ""
        unit = f"times the error on L0, 95 % interval {ratio.low:.3g} .. {ratio.high:.3g}{free}"
        out.append(stated(f"cost_{level}_{sensor}_{method}", ratio.value, unit))
    return out


def ranks(table: LevelTable) -> list[Row]:
    """Return the standings of a table."""
    out = []
    for one in table.standings:
        marks = [
            f"rank {one.rank} ({one.rank_low} to {one.rank_high})" if one.rank else "no rank: " + ", ".join(one.failed)
        ]
        marks += ["ties with the first"] if one.ties_leader else []
        unit = f"IR, 95 % interval {one.ir.low:.3g} .. {one.ir.high:.3g}, {one.sets} sets, {', '.join(marks)}"
        out.append(stated(f"ir_{table.level}_{table.sensor}_{one.method}", one.ir.value, unit))
    return out


def run(what: Settings, folder: Path, jobs: int) -> Board:
    """Run, or go on with what was broken off."""
    resume = folder.exists()
    return run_ladder(
        what,
        folder,
        workers=jobs,
        resume=resume,
        announce=lambda line: sys.stderr.write(f"{folder.name}: {line}\n") and None,
    )


def main() -> None:
    """Fly, judge, and print the rows."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    parser.add_argument("--sets", type=int, default=12, help="sets of flights")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument(
        "--folder", type=Path, help="where runs are kept and gone on with; by default they are not kept"
    )
    arguments = parser.parse_args()
    folder = arguments.folder or Path(tempfile.mkdtemp())
    folder.mkdir(parents=True, exist_ok=True)
    levels = [name for name, level in read_ladder().levels.items() if not level.family and name != "B"]
    cost = run(
        settings(levels, arguments.sets, {"tl16": "tl16", "exact_norm_plain": PLAIN}), folder / "costs", arguments.jobs
    )
    ranking = run(settings(RANKED, arguments.sets, METHODS, NETWORKS), folder / "ranking", arguments.jobs)
    rows = [
        at_least("spread_of_sets", spread(cost), "factor of the IR of tl16 on L0", 1.1),
        *costs(cost),
        *(row for table in ranking.tables for row in ranks(table)),
    ]
    finish(rows, as_json=arguments.json)


if __name__ == "__main__":
    main()

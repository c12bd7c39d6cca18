"""Choose the settings of the ``default`` presets of networks by random search, with an equal budget for all.

Run ``python tests/benchmarks/network_tuning.py [--json] [--methods bp] [--trials 8] [--minutes 9] [--workers 2]``. Each
trial of a method is fitted to the tuning flights (``scenarios/tuning``, ``--pairs`` of them in each of four worlds) and
judged on them; a fit that takes longer than ``--limit`` of processor time ends its trial. Trial 0 is the preset as it
is, the others are drawn from the ranges of ``network_rows/spaces.py`` by ``--seed``.

The best trial has the highest geometric mean of the improvement ratio over all worlds and pairs, among those that stay
above 0.97 of their first stage in each world. Results are kept in the folder, and the same command goes on where it was
broken off; ``trials.csv`` has them all. Nothing is written into the package: what is chosen is put there by hand.
"""

import argparse
import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from magsim.storage import atomic_write
from tests.benchmarks.network_rows import command
from tests.benchmarks.network_rows.flights import DRAWS, fly
from tests.benchmarks.network_rows.search import Trial, best_of, cases_of, judged_trial
from tests.benchmarks.network_rows.spaces import SPACES
from tests.benchmarks.physics_rows.shown import tell
from tests.benchmarks.rows import Row, finish, stated

LIMIT_S = 30.0
"""What a default fit may take on one core."""


@dataclass(frozen=True)
class Budget:
    """What each method gets: trials, pairs in each world, processor time of a fit [s]; and the seed of the draws."""

    trials: int
    pairs: int
    limit_s: float
    seed: int


def search(bench: command.Bench, method: str, budget: Budget) -> tuple[list[Trial], bool]:
    """Make the trials of one method; return those that are complete, and whether all are."""
    found = []
    for number in range(budget.trials):
        results = []
        worlds = cases_of(method, number, budget.seed, budget.pairs)
        # one world after the other, so that a trial ends where it fails; all at once for several workers
        for cases in worlds if bench.workers == 1 else [[case for world in worlds for case in world]]:
            some, complete = bench.results(cases, budget.limit_s)
            results += some
            if any("failed" in one for _, one in some):
                break
            if not complete:
                return found, False
        found.append(judged_trial(method, number, budget.seed, results))
        tell(f"{method}, trial {number}: {_told(found[-1])}")
    return found, True


def _told(one: Trial) -> str:
    reached = one.failed or f"IR {one.ir:.4g}, {one.over_stage:.3g} of its stage at least, fit {one.fit_s:.1f} s"
    return f"{reached}: {one.settings}"


def rows(method: str, trials: Sequence[Trial]) -> list[Row]:
    """Return the preset as it is, and the best trial; nothing of what failed."""
    named = {"default": trials[0] if not trials[0].failed else None, "best": best_of(trials)}
    return [
        stated(f"{method}_{name}_ir", one.ir, f"1, trial {one.number} of {len(trials)}: {_told(one)}")
        for name, one in named.items()
        if one is not None
    ]


def write(path: Path, trials: Sequence[Trial]) -> None:
    """Write all trials as a table."""

    def lines(target: Path) -> None:
        with target.open("w", encoding="utf-8", newline="") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(["method", "trial", "ir", "over_stage", "fit_s", "allowed", "failed", "settings"])
            for one in trials:
                figures = [f"{value:.6g}" for value in (one.ir, one.over_stage, one.fit_s)]
                table.writerow([one.method, one.number, *figures, one.allowed, one.failed, one.settings])

    atomic_write(path, lines, force=True)


def main() -> None:
    """Search, method by method."""
    draw = DRAWS["tune"]
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    command.add_options(parser, command.cache("networks") / "tune")
    parser.add_argument("--trials", type=int, default=12, help="of each method; default 12")
    parser.add_argument("--pairs", type=int, default=draw.pairs, help=f"of each world; default {draw.pairs}")
    parser.add_argument(
        "--limit", type=float, default=LIMIT_S, help=f"processor time of a fit [s]; default {LIMIT_S:g}"
    )
    parser.add_argument("--seed", type=int, default=0, help="of what is drawn")
    arguments = parser.parse_args()
    if not 1 <= arguments.pairs <= draw.pairs:
        parser.error(f"--pairs is {arguments.pairs}; allowed: 1 to {draw.pairs}")
    if arguments.trials < 1:
        parser.error(f"--trials is {arguments.trials}; allowed: 1 or more")
    methods = command.methods_of(parser, arguments.methods)
    if without := [name for name in methods if name not in SPACES]:
        parser.error(f"no range of settings for {', '.join(without)} in network_rows/spaces.py")
    folder = fly(arguments.folder, draw, tell)
    bench = command.Bench.of(arguments, folder, "tuning.jsonl")
    budget = Budget(arguments.trials, arguments.pairs, arguments.limit, arguments.seed)
    found = {method: search(bench, method, budget) for method in methods}
    write(folder / "trials.csv", [one for trials, _ in found.values() for one in trials])
    if not all(complete for _, complete in found.values()):
        command.unfinished()
    finish([row for method, (trials, _) in found.items() for row in rows(method, trials)], as_json=arguments.json)


if __name__ == "__main__":
    main()

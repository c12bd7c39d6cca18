"""Networks on flights that they were not tuned on: what they add to their first stage, from several start weights.

Run ``python tests/benchmarks/network_accuracy.py [--json] [--only default] [--methods bp,magtcn] [--minutes 9]``. Five
pairs of flights in paper 000's world and on levels 0, 4 and 6 of the ladder (``network_rows/flights.py``). Flights and
results are kept, so that the work can be done in parts, on one core or on several (``--workers``). Figures are printed
once all of their fits are made.

``METHOD_over_stage_WORLD`` is the improvement ratio of a network over that of its own first stage on the same rows, and
1 where the network learned to stay away.
"""

import argparse
from pathlib import Path

from tests.benchmarks.network_rows import command
from tests.benchmarks.network_rows.flights import DRAWS, WORLDS, fly
from tests.benchmarks.network_rows.subjects import SUBJECTS, Plan
from tests.benchmarks.physics_rows.shown import tell
from tests.benchmarks.rows import Row, finish


def main() -> None:
    """Ask for subjects, and print their rows."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    command.add_options(parser, command.cache("networks"))
    parser.add_argument("--only", help=f"subjects by comma: {', '.join(SUBJECTS)}; default all")
    parser.add_argument("--worlds", help=f"worlds of the subject default, by comma: {', '.join(WORLDS)}; default all")
    parser.add_argument("--draw", default="show", choices=sorted(DRAWS), help="tune: the flights settings come from")
    parser.add_argument("--pairs", type=int, help="fewer pairs than are drawn, for a quick look")
    arguments = parser.parse_args()
    subjects = command.listed(parser, "--only", arguments.only, tuple(SUBJECTS))
    draw = DRAWS[arguments.draw]
    pairs = draw.pairs if arguments.pairs is None else arguments.pairs
    if not 1 <= pairs <= draw.pairs:
        parser.error(f"--pairs is {pairs}; allowed: 1 to {draw.pairs}")
    worlds = command.listed(parser, "--worlds", arguments.worlds, WORLDS)
    plan = Plan(command.methods_of(parser, arguments.methods), worlds, pairs)
    folder: Path = fly(arguments.folder / arguments.draw, draw, tell)
    bench = command.Bench.of(arguments, folder, "accuracy.jsonl")
    rows: list[Row] = []
    whole = True
    for name in subjects:
        results, complete = bench.results(SUBJECTS[name].cases(plan))
        whole = whole and complete
        if complete:
            rows += SUBJECTS[name].rows(results)
    if not whole:
        command.unfinished()
    finish(rows, as_json=arguments.json)


if __name__ == "__main__":
    main()

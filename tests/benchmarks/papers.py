"""The five papers re-run: how many published figures lie in the spread of ours, and the few that each paper stands for.

Run ``python tests/benchmarks/papers.py [--json] [--papers 001,002] [--quick] [--seeds N] [--folder F] [--workers 2]``.
Runs that are in the folder are taken up and not done again: it may be that of ``magsim paper``'s own full runs.

Nothing here has a goal: a published figure is one of another aircraft in another air. Each row states its interval over
flights.
"""

import argparse
import os
import sys
from pathlib import Path

from magsim.papers import Cell, Effort, PaperTable, numbers, run_paper
from tests.benchmarks.rows import Row, finish, stated


def share_row(number: str, table: PaperTable) -> Row | None:
    """Return the share of published figures that lie in the range of ours; None where none was tried."""
    inside, tried = table.reproduced
    if not tried:
        return None
    return stated(f"paper_{number}_{table.key}_reproduced", inside / tried, f"1, {inside} of {tried}, {table.over}")


def headline_row(number: str, name: str, cell: Cell) -> Row:
    """Return a figure that the paper stands for: the median of ours, with its interval and what is published."""
    published = "" if cell.published is None else f"; published {cell.published:g}"
    spread = f"{len(cell.found)} values"
    if cell.interval is not None:
        low, high = cell.interval
        spread = f"median of {len(cell.found)}, {low:.3g} .. {high:.3g}"
    return stated(f"paper_{number}_{name}", cell.median, f"{spread}{published}")


def main() -> None:
    """Run papers, and print their rows."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    parser.add_argument("--papers", default=",".join(numbers()), help="by comma; default all")
    parser.add_argument("--quick", action="store_true", help="the quick runs")
    parser.add_argument("--seeds", type=int, help="flights, or pairs of flights")
    parser.add_argument("--folder", type=Path, default=Path("papers"), help="of the runs, one folder each")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    arguments = parser.parse_args()
    rows: list[Row] = []
    for number in arguments.papers.split(","):
        run = run_paper(
            number,
            arguments.folder / number,
            Effort(arguments.quick, arguments.seeds),
            workers=arguments.workers,
            announce=lambda line: print(line, file=sys.stderr),
        )
        rows += [headline_row(number, name, cell) for name, cell in run.headlines.items()]
        rows += [row for table in run.tables if (row := share_row(number, table))]
    finish(rows, as_json=arguments.json)


if __name__ == "__main__":
    main()

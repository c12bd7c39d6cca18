"""Fill docs/benchmark from a run of the ladder and the answer of ``ladder_separates.py``.

Run ``python tests/benchmarks/ladder_page.py --board FOLDER --separates FILE``.
"""

import argparse
import json
import re
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path

from magsim.ladder import pages
from magsim.ladder.board import Board, make_board
from magsim.ladder.definition import read_ladder
from magsim.ladder.results import read_set

PAGE = Path(__file__).parents[2] / "docs" / "benchmark" / "README.md"
KEPT = ("sets.csv", "standings.csv", "entered.csv", "board.md")


def read_board(folder: Path) -> Board:
    """Return the board of a finished run."""
    found = [read_set(path) for path in sorted((folder / "sets").glob("set_*.json"))]
    about = json.loads((folder / "ladder.json").read_text(encoding="utf-8"))
    scores = [score for scores, _ in found for score in scores]
    return make_board(about, read_ladder(), scores, [one for _, every in found for one in every])


def matrix(board: Board) -> str:
    """Return a table of levels for each track."""
    out = []
    for track in dict.fromkeys(table.track for table in board.tables):
        tables = [table for table in board.tables if table.track == track]
        methods = dict.fromkeys(one.method for table in tables for one in table.standings)
        heads = [f"{table.level} {table.sensor}" if table.sensor != "cabin" else table.level for table in tables]
        lines = [f"Track `{track}`:", "", _row(["method", *heads]), _row(["---"] * (len(heads) + 1))]
        lines.append(_row(["perfect", *(pages.number(table.floor_ir) for table in tables)]))
        for method in methods:
            cells = []
            for table in tables:
                one = next((one for one in table.standings if one.method == method), None)
                text = "" if one is None else pages.number(one.ir.value)
                first = one is not None and (one.rank == 1 or one.ties_leader)
                cells.append(f"~~{text}~~" if one is not None and one.failed else f"**{text}**" if first else text)
            lines.append(_row([f"`{method}`", *cells]))
        out.append("\n".join(lines))
    return "\n\n".join(out)


def costs(rows: Sequence[Mapping[str, object]]) -> str:
    """Return a table of what each level costs the two methods that tell."""
    found: dict[str, dict[str, str]] = {}
    for row in rows:
        match = re.fullmatch(r"cost_(\w+?)_(cabin|stinger|bird)_(tl16|exact_norm_plain)", str(row["name"]))
        if match is None:
            continue
        level, sensor, method = match.groups()
        name = level if sensor == "cabin" else f"{level} {sensor}"
        bounds = re.search(r"interval (\S+) \.\. ([\d.e+]+)", str(row["unit"]))
        assert bounds is not None
        free = "costs nothing" in str(row["unit"])
        text = "-" if free else f"{pages.number(float(str(row['value'])))} ({bounds[1]} to {bounds[2]})"
        found.setdefault(name, {})[method] = text
    heads = ("level", "`tl16`", "exact norm")
    lines = [_row(heads), _row(["---"] * 3)]
    lines += [_row([name, own.get("tl16", ""), own.get("exact_norm_plain", "")]) for name, own in found.items()]
    return "\n".join(lines)


def _row(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def filled(text: str, name: str, content: str) -> str:
    """Return a page with what stands between its marks replaced."""
    pattern = rf"(<!-- {name} -->\n).*?(<!-- end -->)"
    return re.sub(pattern, lambda match: f"{match[1]}\n{content}\n\n{match[2]}", text, count=1, flags=re.DOTALL)


def main() -> None:
    """Read both, and write the page and the files beside it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--board", type=Path, required=True, help="folder of a finished run of the ladder")
    parser.add_argument("--separates", type=Path, help="answer of ladder_separates.py --json")
    arguments = parser.parse_args()
    text = PAGE.read_text(encoding="utf-8")
    text = filled(text, "board", matrix(read_board(arguments.board)))
    if arguments.separates is not None:
        text = filled(text, "costs", costs(json.loads(arguments.separates.read_text(encoding="utf-8"))))
    PAGE.write_text(text, encoding="utf-8")
    target = PAGE.parent / "v1_quick"
    target.mkdir(exist_ok=True)
    for name in KEPT:
        shutil.copyfile(arguments.board / name, target / name)


if __name__ == "__main__":
    main()

"""Whether recordings and scores are still those of the commit called "before" (``tests/support/before.py``).

    python tests/benchmarks/same_as_before.py [--json] [--only NAME,NAME]

flies every scenario that was shipped then with that commit and with the one that ended the rebuilding of the judging
half (``before.REBUILT``; since then flights have changed on purpose), each in its own process, and compares every
column bit for bit. Then it fits and judges methods on the recordings of the first, with its code and with the present
one: they must agree within 1e-9 relative. Networks are trained otherwise since.

Since that commit, training and validation rows that touch are joined, and a test piece keeps what was flown before it.
For the comparison the recordings are cut where the old code cut them, so that both learn from the same rows; the rows
``joined_*`` list what the joining changes: the improvement ratio before and now.
"""

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np

from magsim.recording import Recording
from tests.benchmarks.rows import Row, at_most, finish, stated
from tests.support import before
from tests.support.paths import ROOT

METHODS = ("none", "tl16", "tl18", "tl16_measured", "noise_floor")
TOWED = ("tl16_gradient",)
CLOSED_FORM_TOLERANCE = 1e-9

JUDGE_BEFORE = """
import json, sys
from pathlib import Path
from magsim.benchmark import benchmark
from magsim.recording import Recording
folder, names, methods = Path(sys.argv[1]), sys.argv[2].split(","), sys.argv[3].split(",")
recordings = [Recording.read(folder / f"{name}.h5") for name in names]
report = benchmark(recordings, methods)
print(json.dumps([[r.recording, r.method, r.segment, r.metric, r.value] for r in report.rows]))
"""

JUDGE_NOW = """
import json, sys
from pathlib import Path
import magsim
from magsim.recording import Recording
folder, names, methods, cut = Path(sys.argv[1]), sys.argv[2].split(","), sys.argv[3].split(","), sys.argv[4] == "cut"
recordings = [Recording.read(folder / f"{name}.h5") for name in names]
if cut:
    parts = [(r, split) for split in ("train", "valid", "test") for r in recordings]
    recordings = [r.where(split=split) for r, split in parts if r.mask(split=split).sum() >= 2]
report = magsim.evaluate(recordings, methods)
print(json.dumps([[r.recording, r.method, r.segment, r.metric, r.value] for r in report.rows]))
"""

Key = tuple[str, str, str, str]
Scores = dict[Key, float]


def changed_columns(old: Recording, new: Recording) -> list[str]:
    """Name the columns that differ in any bit, or that only one of two recordings has."""
    names = {*old.data, *new.data, "time_s"}
    return sorted(n for n in names if n not in _all(old) or n not in _all(new) or not _same(old[n], new[n]))


def _all(recording: Recording) -> set[str]:
    return {"time_s", *recording.data}


def _same(one: np.ndarray, other: np.ndarray) -> bool:
    return one.shape == other.shape and one.tobytes() == other.tobytes()


def scores_of(rows: list[list]) -> Scores:
    """Map recording, method, segment and metric to the score; NaN becomes text, since it equals nothing."""
    return {tuple(row[:4]): row[4] for row in rows}


def changed_scores(old: Scores, new: Scores) -> list[Key]:
    """Name the scores that differ by more than they may, or that only one side has."""

    def same(key: Key) -> bool:
        if key not in old or key not in new:
            return False
        a, b = old[key], new[key]
        if np.array_equal(a, b, equal_nan=True):
            return True
        return abs(a - b) <= CLOSED_FORM_TOLERANCE * abs(a)

    return sorted(key for key in {*old, *new} if not same(key))


def recordings_rows(tree: Path, names: list[str], folder: Path) -> list[Row]:
    """Fly scenarios with both states and count the recordings with a changed column."""
    before.fly(tree, names, folder / "before")
    with before.laid_out(before.REBUILT) as rebuilt:
        before.fly(rebuilt, names, folder / "rebuilt")
    changed = 0
    for name in names:
        file = name.replace("/", "__") + ".h5"
        old, new = (Recording.read(folder / side / file) for side in ("before", "rebuilt"))
        columns = changed_columns(old, new)
        changed += bool(columns)
        if columns:
            sys.stderr.write(f"{name}: {len(columns)} columns differ: {', '.join(columns[:8])}\n")
    return [stated("recordings", len(names), "1"), at_most("recordings_changed", changed, "1", 0)]


def scores_rows(tree: Path, folder: Path) -> list[Row]:
    """Fit and judge with both states on the same recordings and count the changed scores."""
    jobs = [(["calibration_c208b"], METHODS), (["papers__002_diamond", "papers__002_square"], TOWED)]
    rows, changed, count, flown = [], 0, 0, folder / "before"
    for names, methods in jobs:
        arguments = [flown, ",".join(names), ",".join(methods)]
        old = scores_of(before.run(tree, JUDGE_BEFORE, arguments))
        new = scores_of(before.run(ROOT, JUDGE_NOW, [*arguments, "cut"]))
        wrong = changed_scores(old, new)
        for key in wrong[:20]:
            sys.stderr.write(f"{' / '.join(key)}: {old.get(key)} before, {new.get(key)} now\n")
        changed, count = changed + len(wrong), count + len(old)
        joined = scores_of(before.run(ROOT, JUDGE_NOW, [*arguments, "joined"]))
        for method in methods:
            for recording in dict.fromkeys(key[0] for key in old):
                key = (recording, method, "test", "ir")
                rows.append(stated(f"cut_{recording}_{method}_ir", old[key], "1"))
                rows.append(stated(f"joined_{recording}_{method}_ir", joined[key], "1"))
    return [stated("scores", count, "1"), at_most("scores_changed", changed, "1", 0), *rows]


def main() -> None:
    """Compare both states."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else on stdout")
    parser.add_argument("--only", help="scenarios by comma, whose recordings alone are compared")
    arguments = parser.parse_args()
    with before.laid_out() as tree, tempfile.TemporaryDirectory() as temporary:
        shipped = before.run(tree, "import json; from magsim import assets; print(json.dumps(assets.list_scenarios()))")
        names = arguments.only.split(",") if arguments.only else shipped
        folder = Path(temporary)
        rows = recordings_rows(tree, names, folder)
        if not arguments.only:
            rows += scores_rows(tree, folder)
    finish(rows, as_json=arguments.json)


if __name__ == "__main__":
    main()

"""Physics methods on flights that they were not tuned on: to the noise floor, beside a plain peer, in honest worlds.

Run ``python tests/benchmarks/physics_methods.py [--json] [--only excess]``. The flights are flown once, into a cache
folder, and what was broken off goes on where it was; ``--sets 2`` is a quick look.
"""

import argparse
import importlib
import os
from pathlib import Path

from magsim.storage.sources import source_digest
from magsim.threads import one_blas_thread
from tests.benchmarks import physics_rows
from tests.benchmarks.physics_rows.sets import DRAWS
from tests.benchmarks.physics_rows.shown import Shown, tell
from tests.benchmarks.rows import finish

SUBJECTS = ("excess", "against_peer", "split", "coverage", "gain", "real_time", "honest")


def main() -> None:
    """Ask for subjects, and print their rows."""
    cache = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "magsim_benchmarks" / "physics_methods"
    # other sources make other flights
    cache /= source_digest("magsim.simulation")[:12]
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    parser.add_argument("--only", default=",".join(SUBJECTS), help=f"subjects by comma: {', '.join(SUBJECTS)}")
    parser.add_argument("--draw", default="show", choices=sorted(DRAWS), help="tune: the sets that settings come from")
    parser.add_argument("--sets", type=int, help="fewer sets than are drawn, for a quick look")
    parser.add_argument(
        "--folder", type=Path, default=cache, help="where flights are kept; finished ones are taken as they are"
    )
    arguments = parser.parse_args()
    asked = arguments.only.split(",")
    if unknown := sorted(set(asked) - set(SUBJECTS)):
        parser.error(f"no subject is called {', '.join(unknown)}; allowed: {', '.join(SUBJECTS)}")
    draw = DRAWS[arguments.draw]
    count = draw.sets if arguments.sets is None else arguments.sets
    if not 1 <= count <= draw.sets:
        parser.error(f"--sets is {count}; allowed: 1 to {draw.sets}")
    shown = Shown(arguments.folder / arguments.draw, draw, count)
    rows = []
    with one_blas_thread():
        for subject in asked:
            found = importlib.import_module(f"{physics_rows.__name__}.{subject}").rows(shown)
            for row in found:
                tell(f"{row.name} {row.value:.5g} {row.unit}")
            rows += found
    finish(rows, as_json=arguments.json)


if __name__ == "__main__":
    main()

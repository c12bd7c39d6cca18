"""Kill ``magsim generate`` at random moments: the target is absent or complete, and the next writer leaves no leftover.

Run ``python tests/benchmarks/killed_generate.py [--json] [--moments N]``. One in five moments is drawn over the whole
run, the others over 60 ms after a temporary file first holds data, in which it is written and renamed.
"""

import argparse
import contextlib
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from magsim.errors import DataError
from magsim.recording.verify import verify
from magsim.storage import atomic_write
from tests.benchmarks.rows import at_most, finish, stated

SCENARIO = "patterns/straight"
WRITING_S = 0.06


def start(target: Path) -> subprocess.Popen[bytes]:
    """Start a run."""
    arguments = [sys.executable, "-m", "magsim", "generate", SCENARIO, "--quiet", "--output", str(target)]
    return subprocess.Popen(arguments, cwd=Path(__file__).parents[2], stderr=subprocess.DEVNULL)


def wait_for_data(process: subprocess.Popen[bytes], folder: Path) -> None:
    """Wait until a temporary file holds data, or the run ends."""
    while process.poll() is None:
        with contextlib.suppress(FileNotFoundError):  # it has been renamed meanwhile
            if any(path.stat().st_size for path in folder.glob(".*.part/*.h5")):
                return
        time.sleep(0.0005)


def main() -> None:
    """Time one run, then kill one at each moment."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    parser.add_argument("--moments", type=int, default=50)
    arguments = parser.parse_args()
    rng = np.random.default_rng(5)
    counts = {"absent": 0, "whole": 0, "broken": 0}
    while_writing = left_over = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        began = time.perf_counter()
        start(folder / "whole.h5").wait()
        run_s = time.perf_counter() - began
        for number in range(arguments.moments):
            target = folder / f"{number}.h5"
            process = start(target)
            if number % 5:
                wait_for_data(process, folder)
                time.sleep(rng.uniform(0.0, WRITING_S))
            else:
                time.sleep(rng.uniform(0.0, run_s))
            process.kill()
            process.wait()
            while_writing += bool(list(folder.glob(".*.part")))
            counts[_state(target)] += 1
            atomic_write(target, lambda path: path.write_text(""), force=True)
            left_over += bool(list(folder.glob(".*.part")))
    finish(
        [
            at_most("broken", counts["broken"], "1", 0),
            at_most("left_over", left_over, "1", 0),
            stated("absent", counts["absent"], "1"),
            stated("whole", counts["whole"], "1"),
            stated("killed_while_writing", while_writing, "1"),
            stated("run_s", run_s, "s"),
        ],
        as_json=arguments.json,
    )


def _state(target: Path) -> str:
    if not target.exists():
        return "absent"
    try:
        verify(target)
    except DataError:
        return "broken"
    return "whole"


if __name__ == "__main__":
    main()

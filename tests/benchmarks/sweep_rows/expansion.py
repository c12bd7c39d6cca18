"""Expanding a sweep: memory beside a recipe of as many flights, and the time of a million."""

import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from tests.benchmarks.rows import Row, at_most, stated
from tests.support.paths import ROOT
from tests.support.sweeps import LINE, sweep_file

RECIPE = """
import json, resource, sys
from pathlib import Path
from magsim.generation import load_recipe
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
recipe = load_recipe(Path(sys.argv[1]))
assert len(recipe.tasks) == 5000
print(json.dumps(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before))
"""

SWEEP = """
import json, resource, sys, time
import magsim.generation
from magsim import sweep as room
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
plan = room.read_sweep(sys.argv[1], [f"sweep.flights={sys.argv[2]}"])
began, count, texts = time.perf_counter(), 0, 0
for first in range(0, plan.space.count, 4096):
    for flight in plan.space.flights(first, first + 4096):
        count += 1
        texts += len(plan.overrides(flight))
assert count == int(sys.argv[2])
spent = time.perf_counter() - began
print(json.dumps([resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before, spent]))
"""

FLIGHTS = 5000


def rows() -> Sequence[Row]:
    """Measure both."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        path = sweep_file(folder)
        recipe_kb = _answer(RECIPE, _recipe(folder / "many"))
        sweep_kb, _ = _answer(SWEEP, path, FLIGHTS)
        million_kb, spent_s = _answer(SWEEP, path, 1_000_000)
    return [
        at_most("expand_5000_memory_over_recipe", sweep_kb / recipe_kb, "1", 0.1),
        stated("recipe_5000_mb", recipe_kb / 1024.0, "MB"),
        stated("expand_5000_mb", sweep_kb / 1024.0, "MB"),
        at_most("expand_million_s", spent_s, "s", 60.0),
        at_most("expand_million_growth_mb", (million_kb - sweep_kb) / 1024.0, "MB beyond 5000 flights", 20.0),
    ]


def _recipe(folder: Path) -> Path:
    """Write a recipe of as many flights, as a script writes one."""
    folder.mkdir()
    (folder / "line.toml").write_text(LINE, encoding="utf-8")
    lines = [
        "schema = 1",
        'title = "many"',
        'description = "many"',
        "date = 2026-01-01",
    ]
    for shard in range(FLIGHTS // 100):
        lines += ["[[shards]]", f'name = "s{shard}"']
        for flight in range(100):
            number = shard * 100 + flight
            lines += [
                "[[shards.flights]]",
                f'name = "f{number}"',
                'scenario = "line.toml"',
                f'set = ["seed={number}", "start.heading_deg={number % 360}.0"]',
                'splits = ["train"]',
            ]
    (folder / "recipe.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder


def _answer(script: str, *arguments: object) -> object:
    command = [sys.executable, "-c", script, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT)
    return json.loads(done.stdout.splitlines()[-1])

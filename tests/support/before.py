"""The state of the code before a change, laid out beside the present one and run in its own processes.

"Before" is one fixed commit. A measurement is a script that both states run in turn; what differs between them (names
of functions, for example) is up to the two scripts.
"""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.support.paths import ROOT

COMMIT = "89ca7d9"
"""The commit that figures called "before" belong to."""

REBUILT = "08c6ccea"
"""The last commit whose flights are those of ``COMMIT`` bit for bit; later ones differ, as the changelog says."""


FLY = """
import json, sys
from pathlib import Path
import magsim
for name in sys.argv[2:]:
    magsim.simulate(magsim.load_scenario(name)).write(Path(sys.argv[1]) / (name.replace("/", "__") + ".h5"))
    print(name, file=sys.stderr, flush=True)
print(json.dumps(None))
"""
"""Fly scenarios into a folder; the same text for every state."""


@contextmanager
def laid_out(commit: str = COMMIT) -> Iterator[Path]:
    """Lay out a commit as a git worktree in a temporary folder; it is removed at the end.

    Yields
    ------
    Path
        Root of the worktree.
    """
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "before"
        git = ["git", "-C", str(ROOT), "worktree"]
        subprocess.run([*git, "add", "--quiet", "--detach", str(tree), commit], check=True)
        try:
            yield tree
        finally:
            subprocess.run([*git, "remove", "--force", str(tree)], check=True)


def run(tree: Path, script: str, arguments: Sequence[object] = (), *, environment: Mapping[str, str] = {}) -> Any:
    """Run a Python script on the code of a tree, in a process of its own and on one BLAS thread.

    Parameters
    ----------
    tree : Path
        Root of a checkout; its ``magsim`` and ``tests`` are what the script imports.
    script : str
        Source code; the last line of what it prints is JSON.
    arguments : sequence
        Passed on as ``sys.argv[1:]``.
    environment : mapping of str to str
        Variables that are added.

    Returns
    -------
    object
        The JSON value.
    """
    threads = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    env = {**os.environ, **threads, "PYTHONPATH": str(tree), **environment}
    command = [sys.executable, "-c", script, *map(str, arguments)]
    done = subprocess.run(command, env=env, cwd=tree, check=True, stdout=subprocess.PIPE, text=True)
    return json.loads(done.stdout.splitlines()[-1])


def fly(tree: Path, names: Sequence[str], folder: Path) -> None:
    """Fly scenarios with the code of a tree and write their recordings into a new folder."""
    folder.mkdir()
    run(tree, FLY, [folder, *names])

"""A run of a paper of which a part is done again."""

import shutil
from pathlib import Path

from magsim.papers import Effort, run_paper


def require_same_tables(number: str, folder: Path, every: int) -> None:
    """Assert that a quick run of one seed, without some of its results and all of its tables, ends in the same."""
    before = {path: path.read_bytes() for path in folder.glob("tables/*")}
    shutil.rmtree(folder / "tables")
    for path in sorted((folder / "results").iterdir())[::every]:
        path.unlink()
    run_paper(number, folder, Effort(quick=True, seeds=1))
    assert {path: path.read_bytes() for path in folder.glob("tables/*")} == before

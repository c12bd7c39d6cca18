"""What the text of an entry stands for: a registered method, a class in a file, a trained run."""

import contextlib
import json
from pathlib import Path
from typing import Any

from magsim.compensation import saving
from magsim.compensation.registry import lookup

NETWORKS = "magsim.compensation.networks"


def absolute(method: str) -> str:
    """Return the text with the whole path of its file, if it names one."""
    name, colon, rest = method.partition(":")
    return f"{Path(name).resolve()}{colon}{rest}" if name.endswith(".py") else method


def files_of(method: str) -> list[str]:
    """Return what the method's process must read besides magsim and the installed packages: its own file."""
    name = absolute(method).partition(":")[0]
    return [name] if name.endswith(".py") else []


def is_network(method: str) -> bool:
    """Whether a method is one of the networks of magsim, or a file that names torch.

    Raises
    ------
    RequestError
        If no method has that name, or a folder holds none.
    DataError
        If what it holds is broken.
    """
    if Path(method).is_dir():
        return is_network(saving.read_settings(Path(method))["method"])
    name = method.partition(":")[0].strip()
    if name.endswith(".py"):
        # what cannot be read is refused when the method is made
        return Path(name).is_file() and b"torch" in Path(name).read_bytes()
    target = lookup(name).target
    return (target if isinstance(target, str) else target.__module__).startswith(NETWORKS)


def read_run(folder: Path) -> tuple[list[str], list[memoryview]]:
    """Return the names and the contents of the files of a fitted method."""
    names = [name for name in saving.FILES if (folder / name).is_file()]
    return names, [memoryview((folder / name).read_bytes()) for name in names]


def learned(folder: Path) -> tuple[str, ...]:
    """Return the digests of the rows that a trained run says it has learned; none where it does not say."""
    with contextlib.suppress(OSError, ValueError, KeyError, TypeError):
        rows: list[dict[str, Any]] = json.loads((folder / "run.json").read_text(encoding="utf-8"))["rows"]
        return tuple(str(row["sha256"]) for row in rows)
    return ()

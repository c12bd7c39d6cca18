"""Inspection of HDF5 files from elsewhere by a child process, and the results known so far.

A bad file can hang or crash the HDF5 library itself. So a process of its own, with limits of memory and time, reads
the whole file first (``inspector.py``). Contents that it has found good are remembered in the user's cache
(``inspected``).
"""

import contextlib
import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from magsim.errors import DataError, MagsimError
from magsim.storage.checksum import known_state
from magsim.storage.inspected import note_inspected, was_inspected

INSPECTOR = Path(__file__).with_name("inspector.py")
"""Program that reads a whole file in a process of its own."""

TIMEOUT_S = 30.0
"""Longest time that the child process may take."""

_NOT_ALLOWED = 4  # exit code of the inspector
_TIMEOUT = 124
_OUT_OF_CPU = -24  # SIGXCPU
_BATCH = 100
_RESULTS: dict[str, str] = {}
"""What is wrong with files, by the SHA-256 of all their bytes: "" for good ones, as are those written here."""


def inspect_many(paths: Sequence[Path]) -> None:
    """Inspect many files ahead, which is faster than one by one; opening a bad one raises the error."""
    if not hasattr(os, "fork"):
        return
    states = []
    for path in paths:
        with contextlib.suppress(MagsimError):  # raised again on opening
            states.append((path, known_state(path)))
    wanted = [(path, state.digest) for path, state in states if state.kind != "broken" and not _is_known(state.digest)]
    for start in range(0, len(wanted) if len(wanted) > 1 else 0, _BATCH):
        batch = wanted[start : start + _BATCH]
        names = [str(path.absolute()) for path, _ in batch]
        run = _child(["--many", str(TIMEOUT_S), *names], TIMEOUT_S * (1 + len(batch)))
        answers = [] if run is None else run.stdout.splitlines()
        for (_, digest), answer in zip(batch, answers, strict=False):
            _note_inspection(digest, _result(*json.loads(answer)))


def inspect(path: Path, digest: str) -> None:
    """Have a child process read the whole file first, unless the result is known.

    Parameters
    ----------
    path : Path
    digest : str
        SHA-256 of all its bytes.

    Raises
    ------
    DataError
        If the file is damaged, or holds anything that is not allowed.
    """
    if not _is_known(digest):
        run = _child([str(path.absolute())], TIMEOUT_S)
        lines = [] if run is None else run.stderr.strip().splitlines()
        result = _result(_TIMEOUT if run is None else run.returncode, (lines or [""])[-1])
        _note_inspection(digest, result)
    if _RESULTS[digest]:
        msg = f"{path}: {_RESULTS[digest]}"
        raise DataError(msg)


def _is_known(digest: str) -> bool:
    """Whether the result for a content is in ``_RESULTS``, where one of an earlier process may come to."""
    if digest not in _RESULTS and was_inspected(digest, INSPECTOR):
        note_result(digest, "")
    return digest in _RESULTS


def _note_inspection(digest: str, result: str) -> None:
    note_result(digest, result)
    if not result:
        note_inspected(digest, INSPECTOR)


def _child(arguments: list[str], timeout_s: float) -> subprocess.CompletedProcess[str] | None:
    """Run the inspector; None if it took too long."""
    # HDF5 may load no code that a file's filters ask for
    quiet = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "HDF5_PLUGIN_PRELOAD": "::"}
    try:
        return subprocess.run(
            [sys.executable, "-P", str(INSPECTOR), *arguments],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            encoding="utf-8",
            errors="replace",
            timeout=timeout_s,
            check=False,
            env={**os.environ, **quiet},
        )
    except subprocess.TimeoutExpired:
        return None


def _result(code: int, last_line: str) -> str:
    """Translate exit code and last line of the inspector into words that follow the file's name; "" for good."""
    plain = "".join(c if c.isprintable() else "?" for c in last_line)[:300] or "no reason given"
    if code == 0:
        return ""
    if code == _NOT_ALLOWED:
        return plain
    if code in (_TIMEOUT, _OUT_OF_CPU):
        return "is damaged: HDF5 does not come to an end with it"
    if code < 0:
        return "is damaged: HDF5 breaks down over it"
    return damage_of(plain)


def note_result(digest: str, result: str) -> None:
    """Store the result of the file with that SHA-256."""
    if len(_RESULTS) >= 20_000:
        _RESULTS.clear()
    _RESULTS[digest] = result


def damage_of(line: str) -> str:
    """Translate a message of HDF5 into words that follow the file's name."""
    if "truncated" in line:
        return "is truncated: it ends before its data do"
    return f"is damaged: HDF5 cannot read it ({line[:200]})"

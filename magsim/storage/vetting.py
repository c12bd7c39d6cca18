"""Walks of a child process through files from elsewhere, and what is known of files already.

A bad file can hang or crash the HDF5 library itself, so a process of its own goes through it first (``vet.py``), with
limits of memory and time.
"""

import contextlib
import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from magsim.errors import DataError, MagsimError
from magsim.storage.seal import seal_state

VET_PROGRAM = Path(__file__).with_name("vet.py")
"""Walks through a file in a process of its own."""

VET_TIMEOUT_S = 30.0
"""Longest time that the child process may take."""

_REFUSED = 4  # exit code of the vet program
_TIMEOUT = 124
_OUT_OF_CPU = -24  # SIGXCPU
_MANY = 100
_KNOWN: dict[str, str] = {}
"""What the child process said of files, by the SHA-256 of all their bytes: "" for good. Files written here are good."""


def vet_many(paths: Sequence[Path]) -> None:
    """Let child processes walk through many files ahead, faster than one by one; what they say is told on opening."""
    if not hasattr(os, "fork"):
        return
    states = []
    for path in paths:
        with contextlib.suppress(MagsimError):  # told on opening
            states.append((path, seal_state(path)))
    wanted = [(path, state.digest) for path, state in states if state.kind != "broken" and state.digest not in _KNOWN]
    for start in range(0, len(wanted) if len(wanted) > 1 else 0, _MANY):
        batch = wanted[start : start + _MANY]
        names = [str(path.absolute()) for path, _ in batch]
        run = _child(["--many", str(VET_TIMEOUT_S), *names], VET_TIMEOUT_S * (1 + len(batch)))
        answers = [] if run is None else run.stdout.splitlines()
        for (_, digest), answer in zip(batch, answers, strict=False):
            remember(digest, _verdict(*json.loads(answer)))


def vet(path: Path, digest: str) -> None:
    """Let a child process walk through the whole file first, unless what it would say is known."""
    verdict = _KNOWN.get(digest)
    if verdict is None:
        run = _child([str(path.absolute())], VET_TIMEOUT_S)
        lines = [] if run is None else run.stderr.strip().splitlines()
        verdict = _verdict(_TIMEOUT if run is None else run.returncode, (lines or [""])[-1])
        remember(digest, verdict)
    if verdict:
        msg = f"{path}: {verdict}"
        raise DataError(msg)


def _child(arguments: list[str], timeout_s: float) -> subprocess.CompletedProcess[str] | None:
    """Run the vet program; None where it took too long."""
    # HDF5 may load no code that a file's filters ask for
    quiet = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "HDF5_PLUGIN_PRELOAD": "::"}
    try:
        return subprocess.run(
            [sys.executable, "-P", str(VET_PROGRAM), *arguments],
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


def _verdict(code: int, last_line: str) -> str:
    """What the exit code and last line of the vet program mean, in words that follow the file's name; "" for good."""
    plain = "".join(c if c.isprintable() else "?" for c in last_line)[:300] or "no reason given"
    if code == 0:
        return ""
    if code == _REFUSED:
        return plain
    if code in (_TIMEOUT, _OUT_OF_CPU):
        return "is damaged: HDF5 does not come to an end with it"
    if code < 0:
        return "is damaged: HDF5 breaks down over it"
    return damage(plain)


def remember(digest: str, verdict: str) -> None:
    """Note what is known of the file with that SHA-256."""
    if len(_KNOWN) >= 20_000:
        _KNOWN.clear()
    _KNOWN[digest] = verdict


def damage(line: str) -> str:
    """What a message of HDF5 means, in words that follow the file's name."""
    if "truncated" in line:
        return "is truncated: it ends before its data do"
    return f"is damaged: HDF5 cannot read it ({line[:200]})"

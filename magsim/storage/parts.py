"""Hidden folders for files that are being written.

A file or a folder is written in a hidden folder of its own beside the target and moved to its place when it is
finished. The writer holds a lock on that folder, which the system releases when the writer ends, however it ends. So
an unlocked folder for the same target was left by a killed writer, and the next writer of that target removes it.
Without such locks in the system or the file system, leftovers stay.
"""

import contextlib
import fnmatch
import hashlib
import os
import re
import secrets
import shutil
from collections.abc import Iterator
from pathlib import Path

try:
    import fcntl
except ImportError:  # no POSIX
    fcntl = None  # type: ignore[assignment]


@contextlib.contextmanager
def part_folder(path: Path) -> Iterator[Path]:
    """Make a hidden folder beside a path, locked, and remove it at the end with all that is in it.

    Raises
    ------
    OSError, ValueError
        If it cannot be made.
    """
    folder, handle = _new_folder(path)
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        if handle is not None:
            os.close(handle)


_PART = re.compile(r"\.[0-9a-f]{12}-[0-9a-f]{12}\.part")

PREVIOUS = "before"
"""Name in the hidden folder of the previous target, while it is replaced."""


def remove_leftovers(path: Path) -> None:
    """Remove the hidden folders that killed writers of a path left; one with anything else in it stays.

    A previous target goes back to its place if its writer was killed while replacing it.
    """
    name = re.compile(re.escape(_prefix(path)) + r"[0-9a-f]{12}\.part")
    with contextlib.suppress(OSError):
        # names alone: the folder of a sweep holds a hundred thousand
        for folder in [Path(entry) for entry in os.scandir(path.parent) if name.fullmatch(entry.name)]:
            with contextlib.suppress(BlockingIOError):
                handle = _lock(folder)
                if handle is not None:
                    _clear(folder, path)
                    os.close(handle)


def remove_leftovers_in(folder: Path, *patterns: str) -> None:
    """Remove the hidden folders that killed writers left of files in a folder whose names match a pattern.

    For files whose names are not known beforehand; one with anything else in it stays.
    """
    with contextlib.suppress(OSError):
        for part in [Path(entry) for entry in os.scandir(folder) if _PART.fullmatch(entry.name)]:
            inside = list(part.iterdir())
            if not all(part.name.startswith(_prefix(path)) and _is_like(path.name, patterns) for path in inside):
                continue
            with contextlib.suppress(BlockingIOError):
                handle = _lock(part)
                if handle is not None:
                    shutil.rmtree(part, ignore_errors=True)
                    os.close(handle)


def _is_like(name: str, patterns: tuple[str, ...]) -> bool:
    return any(fnmatch.fnmatchcase(name, pattern) for pattern in patterns)


def _clear(folder: Path, path: Path) -> None:
    """Remove one leftover folder."""
    if not {entry.name for entry in folder.iterdir()} <= {path.name, PREVIOUS}:
        return
    if (folder / PREVIOUS).exists() and not path.exists():
        (folder / PREVIOUS).rename(path)
    shutil.rmtree(folder, ignore_errors=True)


def _new_folder(path: Path) -> tuple[Path, int | None]:
    """Make a folder for writing a path, and return it with a handle that holds its lock; None without locks."""
    while True:
        folder = path.with_name(f"{_prefix(path)}{secrets.token_hex(6)}.part")
        folder.mkdir()
        # Until it is locked it looks like a leftover: another writer may have locked and removed it.
        with contextlib.suppress(BlockingIOError):
            handle = _lock(folder)
            if folder.is_dir():
                return folder, handle
            if handle is not None:
                os.close(handle)


def _prefix(path: Path) -> str:
    """Return the beginning of the names of all folders in which a path is written."""
    return f".{hashlib.sha256(os.fsencode(path.name)).hexdigest()[:12]}-"


def _lock(folder: Path) -> int | None:
    """Lock a folder; None if that is not possible.

    Raises
    ------
    BlockingIOError
        If another process holds the lock.
    """
    if fcntl is None:
        return None
    try:
        handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    except OSError:
        return None
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        os.close(handle)
        if isinstance(error, BlockingIOError):
            raise
        return None
    return handle

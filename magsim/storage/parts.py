"""Hidden folders for what is being written.

A file or a folder is written in a hidden folder of its own beside the target and moved to its place when it is
finished. The writer holds a lock on that folder, which the system takes from it when it dies, however it dies. So a
folder for the same target that nobody holds is what a killed writer left, and the next writer of that target removes
it. Where the system or the file system has no such locks, leftovers stay.
"""

import contextlib
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
    """A new hidden folder beside a path, locked; it is gone in the end with all that is in it.

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


BEFORE = "before"
"""Name in the hidden folder of what stood at the target and makes way."""


def sweep(path: Path) -> None:
    """Remove what killed writers of a path left; with anything else in it, it stays.

    What stood at the path goes back there if a writer was killed after it took that away.
    """
    name = re.compile(re.escape(_begin(path)) + r"[0-9a-f]{12}\.part")
    with contextlib.suppress(OSError):
        for folder in [entry for entry in path.parent.iterdir() if name.fullmatch(entry.name)]:
            with contextlib.suppress(BlockingIOError):
                handle = _lock(folder)
                if handle is not None:
                    _clear(folder, path)
                    os.close(handle)


def _clear(folder: Path, path: Path) -> None:
    """Remove a leftover."""
    if not {entry.name for entry in folder.iterdir()} <= {path.name, BEFORE}:
        return
    if (folder / BEFORE).exists() and not path.exists():
        (folder / BEFORE).rename(path)
    shutil.rmtree(folder, ignore_errors=True)


def _new_folder(path: Path) -> tuple[Path, int | None]:
    """A new folder for the writing of a path, and a handle that holds its lock; None where there are no locks."""
    while True:
        folder = path.with_name(f"{_begin(path)}{secrets.token_hex(6)}.part")
        folder.mkdir()
        # Until it is locked it looks like a leftover: where another writer was faster to lock it, it is gone.
        with contextlib.suppress(BlockingIOError):
            handle = _lock(folder)
            if folder.is_dir():
                return folder, handle
            if handle is not None:
                os.close(handle)


def _begin(path: Path) -> str:
    """Begin of the names of all folders that a path is written in."""
    return f".{hashlib.sha256(os.fsencode(path.name)).hexdigest()[:12]}-"


def _lock(folder: Path) -> int | None:
    """Lock a folder; None where that is not possible.

    Raises
    ------
    BlockingIOError
        If somebody else has it.
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

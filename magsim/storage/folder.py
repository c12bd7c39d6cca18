"""Writing a folder of files whole or not at all."""

import contextlib
import os
import secrets
import shutil
from collections.abc import Callable
from glob import escape
from pathlib import Path

from magsim.errors import RequestError
from magsim.storage.atomic import cannot_write, sync

try:
    import fcntl
except ImportError:  # no such locks there: what a killed writer left is not known from what another one writes
    fcntl = None

PART = ".part"


def check_folder_target(path: Path, *, force: bool = False) -> None:
    """Refuse a folder that cannot be written, before any work is spent on it.

    Parameters
    ----------
    path : Path
        Where the folder shall be; the folder around it is made.
    force : bool
        Whether an existing folder may be replaced.

    Raises
    ------
    RequestError
        If the path is taken, or the folder around it cannot be made or written to.
    """
    if not path.name:
        msg = f"cannot write {path}: give the name of a new folder"
        raise RequestError(msg)
    try:
        taken = path.exists() or path.is_symlink()
        if taken and (path.is_symlink() or not path.is_dir()):
            msg = f"cannot write {path}: it is not a folder"
            raise RequestError(msg)
        if taken and not force and any(path.iterdir()):
            msg = f"{path} exists already; --force replaces it"
            raise RequestError(msg)
        path.parent.mkdir(parents=True, exist_ok=True)
        probe = _hidden(path)
        probe.mkdir()
        probe.rmdir()
    except (OSError, ValueError) as error:
        raise cannot_write(path, error) from None


def atomic_folder(path: Path, write: Callable[[Path], object], *, force: bool = False) -> None:
    """Write a folder so that it is there whole or not at all.

    It is filled under a hidden name beside its place and then renamed. What writers that were killed have left there
    is removed. With ``force`` there is a moment between two renames at which the folder is absent.

    Parameters
    ----------
    path : Path
        Where the folder shall be.
    write : callable
        Fills the folder that it is given.
    force : bool
        Replace an existing folder with all that is in it.

    Raises
    ------
    RequestError
        If the path is taken and ``force`` is not set, or it cannot be written to. Nothing is left behind.
    """
    check_folder_target(path, force=force)
    _sweep(path)
    temporary, lock = _reserve(path)
    try:
        write(temporary)
        for file in sorted(temporary.rglob("*")):
            sync(file)
        sync(temporary)
        _publish(temporary, path, force=force)
        sync(path.parent)
    except OSError as error:
        raise cannot_write(path, error) from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
        if lock is not None:
            os.close(lock)


def _hidden(path: Path) -> Path:
    """A new name beside the path for what is not finished."""
    return path.with_name(f".{path.name[:100]}.{secrets.token_hex(6)}{PART}")


def _reserve(path: Path) -> tuple[Path, int | None]:
    """A new folder beside the path, locked as long as this process lives."""
    while True:
        temporary = _hidden(path)
        try:
            temporary.mkdir()
        except OSError as error:
            raise cannot_write(path, error) from None
        lock = _lock(temporary)
        if temporary.is_dir():  # else another writer swept it before it was locked
            return temporary, lock
        if lock is not None:
            os.close(lock)


def _lock(folder: Path, *, wait: bool = True) -> int | None:
    """Hold a folder until the handle is closed or the process ends; None where that cannot be."""
    if fcntl is None:
        return None
    handle = None
    try:
        handle = os.open(folder, os.O_RDONLY)
        fcntl.flock(handle, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except OSError:
        if handle is not None:
            os.close(handle)
        return None
    return handle


def _sweep(path: Path) -> None:
    """Remove what killed writers of this folder have left: hidden folders that nobody holds."""
    for left in path.parent.glob(f".{escape(path.name[:100])}.*{PART}"):
        lock = _lock(left, wait=False)
        if lock is not None:
            shutil.rmtree(left, ignore_errors=True)
            os.close(lock)


def _publish(temporary: Path, path: Path, *, force: bool) -> None:
    """Give the finished folder its name."""
    if not (force and path.exists()):
        temporary.rename(path)
        return
    before = _hidden(path)
    path.rename(before)
    try:
        temporary.rename(path)
    except OSError:
        with contextlib.suppress(OSError):
            before.rename(path)
        raise
    shutil.rmtree(before, ignore_errors=True)

"""Writing of a folder of files, completely or not at all."""

import contextlib
from collections.abc import Callable
from pathlib import Path

from magsim.errors import RequestError
from magsim.storage.atomic import cannot_write, sync
from magsim.storage.parts import PREVIOUS, part_folder, remove_leftovers


def check_folder_target(path: Path, *, force: bool = False) -> None:
    """Raise an error for a folder that cannot be written, before any work is spent on it.

    Parameters
    ----------
    path : Path
        The folder; its parent is made.
    force : bool
        Whether an existing folder may be replaced.

    Raises
    ------
    RequestError
        If the path is taken, or its parent cannot be made or written to.
    """
    if not path.name:
        msg = f"cannot write {path}: give the name of a new folder"
        raise RequestError(msg)
    remove_leftovers(path)
    try:
        taken = path.exists() or path.is_symlink()
        if taken and (path.is_symlink() or not path.is_dir()):
            msg = f"cannot write {path}: it is not a folder"
            raise RequestError(msg)
        if taken and not force and any(path.iterdir()):
            msg = f"{path} exists already; --force replaces it"
            raise RequestError(msg)
        path.parent.mkdir(parents=True, exist_ok=True)
        with part_folder(path) as hidden:
            (hidden / path.name).mkdir()
    except (OSError, ValueError) as error:
        raise cannot_write(path, error) from None


def atomic_folder(path: Path, write: Callable[[Path], object], *, force: bool = False) -> None:
    """Write a folder so that it exists completely or not at all.

    It is filled under a hidden name beside its place and then renamed. Leftovers of killed writers are removed.
    With ``force`` there is a moment between two renames at which the folder is absent.

    Parameters
    ----------
    path : Path
        The folder.
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
    try:
        with part_folder(path) as hidden:
            temporary = hidden / path.name
            temporary.mkdir()
            write(temporary)
            for file in sorted(temporary.rglob("*")):
                sync(file)
            sync(temporary)
            _publish(temporary, path, force=force)
            sync(path.parent)
    except OSError as error:
        raise cannot_write(path, error) from error


def _publish(temporary: Path, path: Path, *, force: bool) -> None:
    """Give the finished folder its name."""
    if not (force and path.exists()):
        temporary.rename(path)
        return
    previous = temporary.with_name(PREVIOUS)
    path.rename(previous)
    try:
        temporary.rename(path)
    except OSError:
        with contextlib.suppress(OSError):
            previous.rename(path)
        raise

"""Writing of a file, completely or not at all."""

import contextlib
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from stat import S_ISDIR, S_ISREG

from magsim.errors import RequestError
from magsim.storage.parts import part_folder, remove_leftovers


def check_target(path: Path, *, force: bool = False) -> None:
    """Raise an error for an output path that cannot be written, before any work is spent on it.

    Parameters
    ----------
    path : Path
        The file to be written.
    force : bool
        Whether an existing file may be replaced.

    Raises
    ------
    RequestError
        If the folder is missing or cannot be written to, or the path is taken.
    """
    _refuse_taken(path, force=force)
    with _reserved(path):
        pass


def atomic_write(path: Path, write: Callable[[Path], object], *, force: bool = False) -> None:
    """Write a file so that it exists completely or not at all.

    Parameters
    ----------
    path : Path
        The file. Its folder must exist.
    write : callable
        Writes the file at the path that it is given: one of the same name in a temporary folder beside it.
    force : bool
        Replace an existing file.

    Raises
    ------
    RequestError
        If the path is taken and ``force`` is not set, or it cannot be written to. Nothing is left behind.
    """
    _refuse_taken(path, force=force)
    remove_leftovers(path)
    with _reserved(path) as temporary:
        try:
            write(temporary)
            sync(temporary)
            _publish(temporary, path, force=force)
            sync(path.parent)
        except OSError as error:
            raise cannot_write(path, error) from error


def _refuse_taken(path: Path, *, force: bool) -> None:
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        if not path.parent.is_dir():
            msg = f"cannot write {path}: there is no folder {path.parent}; make it first, or give another path"
            raise RequestError(msg) from None
        return
    except (OSError, ValueError) as error:
        raise cannot_write(path, error) from None
    if S_ISDIR(mode):
        msg = f"cannot write {path}: it is a folder; give the name of a file"
    elif not S_ISREG(mode):
        msg = f"cannot write {path}: it is not a regular file"
    elif not force:
        msg = f"{path} exists already; --force replaces it"
    else:
        return
    raise RequestError(msg)


def atomic_text(path: Path, text: str, *, force: bool = False) -> None:
    """Write a text as UTF-8, its lines ended by line feeds, completely or not at all; see ``atomic_write``.

    Raises
    ------
    RequestError
        As ``atomic_write``.
    """
    atomic_write(path, lambda part: part.write_text(text, encoding="utf-8", newline="\n"), force=force)


@contextlib.contextmanager
def _reserved(path: Path) -> Iterator[Path]:
    """Make an empty file of the path's name in a hidden folder beside it, and remove both at the end.

    The file has the permissions of the final one.
    """
    with contextlib.ExitStack() as stack:
        try:
            temporary = stack.enter_context(part_folder(path)) / path.name
            os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        except (OSError, ValueError) as error:
            raise cannot_write(path, error) from None
        yield temporary


def _publish(temporary: Path, path: Path, *, force: bool) -> None:
    """Give the finished file its name. Without force, a file that was made meanwhile stays."""
    if not force:
        try:
            os.link(temporary, path)
        except FileExistsError:
            _refuse_taken(path, force=False)
        except OSError:
            _refuse_taken(path, force=False)  # a file system without hard links: look, then replace
        else:
            return
    temporary.replace(path)


def sync(path: Path) -> None:
    """Flush a file or a folder to the disk, if the system can."""
    try:
        handle = os.open(path, os.O_RDONLY)
    except OSError:
        return
    try:
        os.fsync(handle)
    except OSError:
        if not path.is_dir():
            raise
    finally:
        os.close(handle)


def cannot_write(path: Path, error: Exception) -> RequestError:
    """Return the error, in one line, about a path that cannot be written."""
    reason = getattr(error, "strerror", None) or str(error).splitlines()[0]
    return RequestError(f"cannot write {path}: {reason}")

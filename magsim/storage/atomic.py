"""Writing a file whole or not at all."""

import contextlib
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from stat import S_ISDIR, S_ISREG

from magsim.errors import RequestError
from magsim.storage.parts import part_folder, sweep


def check_target(path: Path, *, force: bool = False) -> None:
    """Refuse an output path that cannot be written, before any work is spent on it.

    Parameters
    ----------
    path : Path
        Where a file shall be written.
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
    """Write a file so that it is there whole or not at all.

    Parameters
    ----------
    path : Path
        Where the file shall be. Its folder must exist.
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
    sweep(path)
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


@contextlib.contextmanager
def _reserved(path: Path) -> Iterator[Path]:
    """A new empty file of the path's name in a hidden folder beside it; both are gone in the end.

    The file has the permissions that the final one shall have.
    """
    with contextlib.ExitStack() as stack:
        try:
            temporary = stack.enter_context(part_folder(path)) / path.name
            os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        except (OSError, ValueError) as error:
            raise cannot_write(path, error) from None
        yield temporary


def _publish(temporary: Path, path: Path, *, force: bool) -> None:
    """Give the finished file its name. Without force, a file that came up meanwhile stays."""
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
    """Bring a file or a folder to the disk, where the system can."""
    try:
        handle = os.open(path, os.O_RDONLY)
    except OSError:
        return
    try:
        with contextlib.suppress(OSError if path.is_dir() else ()):
            os.fsync(handle)
    finally:
        os.close(handle)


def cannot_write(path: Path, error: Exception) -> RequestError:
    """The one line that tells why a path cannot be written to."""
    reason = getattr(error, "strerror", None) or str(error).splitlines()[0]
    return RequestError(f"cannot write {path}: {reason}")

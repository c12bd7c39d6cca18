"""Writing a file whole or not at all.

A file is written in a hidden folder of its own beside the target and moved to its place when it is finished. The writer
holds a lock on that folder, which the system takes from it when it dies, however it dies. So a folder for the same
target that nobody holds is what a killed writer left, and the next writer of that target removes it. Where the system
or the file system has no such locks, leftovers stay.
"""

import contextlib
import hashlib
import os
import re
import secrets
from collections.abc import Callable, Iterator
from pathlib import Path
from stat import S_ISDIR, S_ISREG

from magsim.errors import RequestError

try:
    import fcntl
except ImportError:  # no POSIX
    fcntl = None  # type: ignore[assignment]


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
    _sweep(path)
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
    """A new empty file of the path's name in a new hidden folder beside it; both are gone in the end.

    The file has the permissions that the final one shall have, and the folder is locked.
    """
    folder: Path | None = None
    handle: int | None = None
    try:
        try:
            folder, handle = _new_folder(path)
            temporary = folder / path.name
            os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        except (OSError, ValueError) as error:
            raise cannot_write(path, error) from None
        yield temporary
    finally:
        if folder is not None:
            _remove(folder, path.name)
        if handle is not None:
            os.close(handle)


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


def _sweep(path: Path) -> None:
    """Remove what killed writers of this path left."""
    name = re.compile(re.escape(_begin(path)) + r"[0-9a-f]{12}\.part")
    with contextlib.suppress(OSError):
        for folder in [entry for entry in path.parent.iterdir() if name.fullmatch(entry.name)]:
            with contextlib.suppress(BlockingIOError):
                handle = _lock(folder)
                if handle is not None:
                    _remove(folder, path.name)
                    os.close(handle)


def _remove(folder: Path, name: str) -> None:
    """Remove a folder of that kind with its one file; with anything else in it, it stays."""
    with contextlib.suppress(OSError):
        (folder / name).unlink(missing_ok=True)
        folder.rmdir()


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

"""Contents of files that an inspection has found good, remembered in the user's cache for later processes.

One line of a text file for each content: its SHA-256. Inspectors of different code, and other versions of h5py, have
files of their own, so that a stricter one starts anew. What a process has written itself is not remembered here: who
can write a file can write one that only looks like it.
"""

import contextlib
import hashlib
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from magsim.storage.cache import cache_folder

MOST_BYTES = 20_000_000
"""Size at which a list starts anew: some 300 000 files."""

_LINE_BYTES = 65
_SEEN: dict[Path, tuple[int, set[str]]] = {}
"""What was read of each list: bytes, and contents."""


def was_inspected(digest: str, inspector: Path) -> bool:
    """Whether some process of this user has had a content inspected, and it was good.

    Parameters
    ----------
    digest : str
        SHA-256 of all bytes of the file.
    inspector : Path
        The program that inspects.
    """
    path = _list_of(inspector)
    if path is None:
        return False
    done, found = _SEEN.get(path, (0, set()))
    if digest not in found:
        with contextlib.suppress(OSError), path.open("rb") as file:
            file.seek(done)
            # a line that is just being written is read next time
            lines = file.read(MOST_BYTES).split(b"\n")[:-1]
            found |= {line.decode("ascii", "replace") for line in lines}
            _SEEN[path] = done + sum(len(line) + 1 for line in lines), found
    return digest in found


def note_inspected(digest: str, inspector: Path) -> None:
    """Remember a content that was inspected and is good; a cache that cannot be written is not used."""
    path = _list_of(inspector)
    if path is None or was_inspected(digest, inspector):
        return
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.exists() and path.stat().st_size > MOST_BYTES - _LINE_BYTES:
            path.unlink()
            _SEEN.pop(path, None)
        with path.open("ab") as file:
            file.write(f"{digest}\n".encode())


def _list_of(inspector: Path) -> Path | None:
    folder, name = cache_folder(), _name_of(inspector)
    return None if folder is None or not name else folder / "inspected" / name


@lru_cache(maxsize=8)
def _name_of(inspector: Path) -> str:
    """Return the name of the list of an inspector; empty if it cannot be read."""
    try:
        code = inspector.read_bytes() + version("h5py").encode()
    except (OSError, PackageNotFoundError):
        return ""
    return f"{hashlib.sha256(code).hexdigest()[:16]}.txt"

"""Files that the keys of a sweep name: an edited one makes another sweep."""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from magsim.aircraft import load_aircraft, load_bird
from magsim.config import keys
from magsim.errors import RequestError


def _of_file(name: str, folder: Path) -> str:
    with (folder / name).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


NAMING: Mapping[str, Callable[[str, Path], str]] = {
    "aircraft": lambda name, folder: load_aircraft(name, folder).digest,
    "tow.bird": lambda name, folder: load_bird(name, folder).digest,
    "pattern.file": _of_file,
    "terrain.file": _of_file,
}
"""Keys of a scenario that name a file or a folder, and how its digest is found."""


def digests(values: Mapping[str, Sequence[object]], folder: Path) -> dict[str, str]:
    """Return the digest of every file that values of keys name.

    Parameters
    ----------
    values : mapping of str to sequence
        By key path; a path may be that of a table that has such a key in it.
    folder : Path
        In which relative paths begin.

    Returns
    -------
    dict of str to str
        By key path and name. What cannot be read is "unreadable": flights with it are refused.
    """
    out = {}
    for path, given in values.items():
        for naming, digest in NAMING.items():
            for value in given:
                name = _inside(value, path, naming)
                if isinstance(name, str) and f"{naming} {name}" not in out:
                    try:
                        out[f"{naming} {name}"] = digest(name, folder)
                    except (RequestError, OSError, ValueError):
                        out[f"{naming} {name}"] = "unreadable"
    return out


def _inside(value: object, path: str, naming: str) -> object:
    """Return what a value that is set at a path sets under another, or None."""
    outer, inner = keys.split(path) or (), keys.split(naming) or ()
    if inner[: len(outer)] != outer:
        return None
    for part in inner[len(outer) :]:
        value = value.get(part) if isinstance(value, Mapping) else None
    return value

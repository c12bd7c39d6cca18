"""Results that take long, kept by the hash of what they were made from."""

import contextlib
import hashlib
import json
import os
import re
from collections.abc import Callable, Mapping
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from magsim.errors import MagsimError
from magsim.storage.atomic import atomic_write

FORMAT = 1
"""Version of the entries; an entry of another version is never found."""

KEEP, KEEP_BYTES = 1000, 512 * 2**20
"""Most entries of one kind, and most bytes of all of them; the oldest go first."""

_CHECKSUM = "checksum"
_KIND = re.compile(r"[a-z][a-z0-9_-]*")


def cached(
    kind: str, key: Mapping[str, object] | str, make: Callable[[], dict[str, np.ndarray]]
) -> dict[str, np.ndarray]:
    """What ``make`` returns, from the cache where the same was made before.

    An entry is found by the kind, the key, the source code of the package of magsim that ``make`` belongs to,
    and the versions of numpy and scipy, so neither a new solver nor a new library meets old results. A damaged
    entry is made again, and a cache that cannot be written to is not used. Writers do not disturb each other.

    Parameters
    ----------
    kind : str
        What is kept, for example ``"response"``; names a folder of the cache.
    key : mapping or str
        Everything that the result depends on; a mapping of JSON values and arrays.
    make : callable
        Makes the result: arrays of plain types by name.

    Returns
    -------
    dict of str to array
        Read-only, the same bits with the cache and without.
    """
    if not _KIND.fullmatch(kind):
        msg = f"{kind!r} cannot name a folder of the cache; allowed: {_KIND.pattern}"
        raise ValueError(msg)
    folder = cache_folder()
    name = hashlib.sha256(
        "\0".join([str(FORMAT), kind, _canonical(key), _maker(make), _libraries()]).encode()
    ).hexdigest()
    path = folder / kind / f"{name}.npz" if folder else None
    if path is not None:
        kept = _read(path)
        if kept is not None:
            return kept
    made = {name: _frozen(name, array) for name, array in make().items()}
    if path is not None:
        with contextlib.suppress(OSError, MagsimError):
            path.parent.mkdir(parents=True, exist_ok=True)
            atomic_write(path, lambda temporary: _write(temporary, made), force=True)
            _drop_old(path.parent)
    return made


def cache_folder() -> Path | None:
    """Folder of the cache: ``$MAGSIM_CACHE``, else ``magsim`` in the user's cache folder; None where there is none."""
    own = os.environ.get("MAGSIM_CACHE")
    if own:
        return Path(own).absolute()
    shared = os.environ.get("XDG_CACHE_HOME", "")
    if Path(shared).is_absolute():
        return Path(shared) / "magsim"
    try:
        return Path.home() / ".cache" / "magsim"
    except RuntimeError:
        return None


def _canonical(key: Mapping[str, object] | str) -> str:
    if isinstance(key, str):
        return key
    return json.dumps(key, sort_keys=True, allow_nan=False, separators=(",", ":"), default=_array_key)


def _array_key(value: object) -> object:
    if isinstance(value, np.ndarray | np.generic):
        array = np.ascontiguousarray(value)
        return [array.dtype.str, list(array.shape), hashlib.sha256(array.tobytes()).hexdigest()]
    msg = f"a cache key cannot hold {type(value).__name__}"
    raise TypeError(msg)


def _maker(make: Callable) -> str:
    """Digest of the source code behind a function of magsim; empty for one from elsewhere."""
    while hasattr(make, "func"):
        make = make.func
    module = getattr(make, "__module__", None) or ""
    return _source_digest(".".join(module.split(".")[:2])) if module.startswith("magsim.") else ""


@lru_cache(maxsize=16)
def _source_digest(package: str) -> str:
    spec = find_spec(package)
    if spec is None or spec.origin is None:
        return ""
    origin = Path(spec.origin)
    files = sorted(origin.parent.rglob("*.py")) if origin.name == "__init__.py" else [origin]
    digest = hashlib.sha256()
    for file in files:
        digest.update(file.relative_to(origin.parent).as_posix().encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()


@lru_cache(maxsize=1)
def _libraries() -> str:
    found = []
    for name in ("numpy", "scipy"):
        with contextlib.suppress(PackageNotFoundError):
            found.append(f"{name} {version(name)}")
    return ", ".join(found)


def _frozen(name: str, array: np.ndarray) -> np.ndarray:
    array = np.array(array, order="C")
    if array.dtype.hasobject or name == _CHECKSUM:
        msg = f"a cached result cannot hold {name!r} of type {array.dtype}"
        raise TypeError(msg)
    array.flags.writeable = False
    return array


def _digest(arrays: Mapping[str, np.ndarray]) -> np.ndarray:
    digest = hashlib.sha256()
    for name in sorted(arrays):
        array = arrays[name]
        digest.update(f"{name}\0{array.dtype.str}\0{array.shape}\0".encode())
        digest.update(array.tobytes())
    return np.frombuffer(digest.digest(), dtype=np.uint8)


def _write(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    with path.open("wb") as file:
        np.savez(file, **{_CHECKSUM: _digest(arrays)}, **arrays)


def _read(path: Path) -> dict[str, np.ndarray] | None:
    """An entry, or None where there is none or it is damaged in any way."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as entry:
            arrays = {name: entry[name] for name in entry.files}
        checksum = arrays.pop(_CHECKSUM)
        if not np.array_equal(checksum, _digest(arrays)):
            return None
        return {name: _frozen(name, array) for name, array in arrays.items()}
    except Exception:
        return None


def _drop_old(folder: Path) -> None:
    entries = [(entry.stat(), entry) for entry in folder.glob("*.npz")]
    entries.sort(key=lambda pair: pair[0].st_mtime_ns, reverse=True)
    total = 0
    for number, (stat, entry) in enumerate(entries):
        total += stat.st_size
        if number and (number >= KEEP or total > KEEP_BYTES):
            entry.unlink(missing_ok=True)

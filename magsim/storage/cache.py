"""Results that take long to compute, stored under a hash of everything that they depend on."""

import contextlib
import hashlib
import json
import os
import re
from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping
from contextvars import ContextVar
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from magsim.errors import MagsimError
from magsim.storage.atomic import atomic_write
from magsim.storage.machine import kind_of_machine
from magsim.storage.sources import source_digest

FORMAT = 1
"""Version of the entries; an entry of another version is never found."""

KEEP, KEEP_BYTES = 10_000, 512 * 2**20
"""Most entries of one kind, and most bytes of all of them; what has not been used for longest goes first."""

Report = Callable[[str, float], None]
"""Called with the kind of a result and its share done, 0 or 1."""

_REPORT: ContextVar[Report | None] = ContextVar("report", default=None)

RECENT = 2
"""Most results of one kind that ``kept`` holds in memory."""

_recent: dict[str, OrderedDict[tuple[Path | None, str], dict[str, np.ndarray]]] = {}

_CHECKSUM = "checksum"
_KIND = re.compile(r"[a-z][a-z0-9_-]*")


def cached(
    kind: str, key: Mapping[str, object] | str, make: Callable[[], dict[str, np.ndarray]]
) -> dict[str, np.ndarray]:
    """Return what ``make`` returns, from the cache if the same was made before.

    An entry is found by its kind, its key, the source code of every module of magsim that the module of ``make``
    imports directly or indirectly (``sources``), and the kind of machine with the versions of the libraries that
    compute (``machine``). So no change of the code, wherever it is, and no other library returns an old result. A
    damaged entry is made again, and a cache that cannot be written to is not used. Writers do not disturb each other.

    Parameters
    ----------
    kind : str
        What is stored, for example ``"response"``; names a folder of the cache.
    key : mapping or str
        Everything that the result depends on; a mapping of JSON values and arrays.
    make : callable
        Computes the result: arrays of plain types by name. What it uses must be imported by its module.

    Returns
    -------
    dict of str to array
        Read-only, the same bits with the cache and without.
    """
    if not _KIND.fullmatch(kind):
        msg = f"{kind!r} cannot name a folder of the cache; allowed: {_KIND.pattern}"
        raise ValueError(msg)
    folder, name = cache_folder(), _name(kind, key, make)
    path = folder / kind / f"{name}.npz" if folder else None
    if path is not None:
        stored = _read(path)
        if stored is not None:
            with contextlib.suppress(OSError):
                os.utime(path)
            return stored
    report = _REPORT.get() or (lambda _kind, _share: None)
    report(kind, 0.0)
    made = {name: _frozen(name, array) for name, array in make().items()}
    report(kind, 1.0)
    if path is not None:
        with contextlib.suppress(OSError, MagsimError):
            path.parent.mkdir(parents=True, exist_ok=True)
            atomic_write(path, lambda temporary: _write(temporary, made), force=True)
            _drop_old(path.parent)
    return made


@contextlib.contextmanager
def reported(report: Report) -> Iterator[None]:
    """Report every result that ``cached`` computes inside, because it is not in the cache.

    Parameters
    ----------
    report : callable
        ``report(kind, share)``: share 0 before a result is computed, 1 after. One result may need another.
    """
    token = _REPORT.set(report)
    try:
        yield
    finally:
        _REPORT.reset(token)


def kept(
    kind: str, key: Mapping[str, object] | str, make: Callable[[], dict[str, np.ndarray]]
) -> dict[str, np.ndarray]:
    """Return the result of ``cached``; this process keeps the last ``RECENT`` of a kind in memory, too.

    For what one simulation after another needs: reading and checking an entry takes longer than some of them.
    """
    recent, name = _recent.setdefault(kind, OrderedDict()), (cache_folder(), _name(kind, key, make))
    if name not in recent:
        recent[name] = cached(kind, key, make)
    recent.move_to_end(name)
    while len(recent) > RECENT:
        recent.popitem(last=False)
    return dict(recent[name])


def _name(kind: str, key: Mapping[str, object] | str, make: Callable[..., object]) -> str:
    """Return the name of an entry: a digest of all that it depends on."""
    parts = [str(FORMAT), kind, _canonical(key), _source(make), _machine()]
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()


def cache_folder() -> Path | None:
    """Return ``$MAGSIM_CACHE``, else ``magsim`` in the user's cache folder; None if there is none."""
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


def _source(make: Callable[..., object]) -> str:
    """Return the digest of all source code that a function of magsim depends on; empty for one from elsewhere."""
    while isinstance(make, partial):
        make = make.func
    module = getattr(make, "__module__", None) or ""
    return source_digest(module) if module.startswith("magsim.") else ""


def _machine() -> str:
    return json.dumps(kind_of_machine(), sort_keys=True)


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
        digest.update(np.ascontiguousarray(array).reshape(-1).view(np.uint8).data)
    return np.frombuffer(digest.digest(), dtype=np.uint8)


def _write(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    entry: dict[str, Any] = {_CHECKSUM: _digest(arrays), **arrays}
    with path.open("wb") as file:
        np.savez(file, **entry)


def _read(path: Path) -> dict[str, np.ndarray] | None:
    """Return an entry, or None if there is none or it is damaged in any way."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as entry:
            arrays = {name: entry[name] for name in entry.files}
        checksum = arrays.pop(_CHECKSUM)
        if not np.array_equal(checksum, _digest(arrays)):
            return None
        for array in arrays.values():
            array.flags.writeable = False
        return arrays
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

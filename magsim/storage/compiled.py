"""Functions that numba compiles, kept in magsim's cache.

Numba by itself keeps what it compiled beside the source file and looks at that file alone: a compiled function that
calls one of another file would go on with the other's old code. Here an entry belongs to the source of every module
that the function's module imports, directly or indirectly (``sources``), as the other results of the cache do. Where
nothing can be written, functions are compiled in every process; that takes seconds.
"""

import contextlib
import shutil
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeAlias, TypeVar, cast

import numba

from magsim.storage.cache import cache_folder
from magsim.storage.sources import source_digest

KEEP = 40
"""Most folders of compiled modules, each for one state of its sources; the oldest go first."""

F = TypeVar("F", bound=Callable[..., Any])

Record: TypeAlias = Any
"""A record of a structured array, whose fields are attributes in compiled functions."""


def compiled(function: F) -> F:
    """Compile a function of plain numbers and arrays by numba when it is first called; a decorator.

    There is no fast-math: the bits are those of the source's order of operations. A division by zero gives infinity.
    Modules that use it import numba, which takes half a second: they are imported where they are needed.
    """
    with _own_locator():
        try:
            return cast(F, numba.njit(cache=True, error_model="numpy")(function))
        except RuntimeError:
            # numba found no folder that it can write to
            return cast(F, numba.njit(error_model="numpy")(function))


@contextlib.contextmanager
def _own_locator() -> Iterator[None]:
    """Let numba ask ``SourcesLocator`` where a function is cached (its setting ``NUMBA_CACHE_LOCATOR_CLASSES``)."""
    settings: Any = numba.config
    before = getattr(settings, "CACHE_LOCATOR_CLASSES", "")
    settings.CACHE_LOCATOR_CLASSES = f"{__name__}.SourcesLocator"
    try:
        yield
    finally:
        settings.CACHE_LOCATOR_CLASSES = before


class SourcesLocator:
    """Where numba keeps a compiled function, and what its entry depends on.

    Parameters
    ----------
    module : str
        Of the function.
    line : int
        At which the function begins.
    folder : Path
        The cache.
    """

    def __init__(self, module: str, line: int, folder: Path) -> None:
        self._line, self._stamp = line, source_digest(module)
        self._path = folder / "compiled" / f"{module}-{self._stamp[:16]}"

    def get_cache_path(self) -> str:
        """Return the folder of the entries."""
        return str(self._path)

    def ensure_cache_path(self) -> None:
        """Make the folder; raise OSError if it cannot be written to."""
        if not self._path.is_dir():
            self._path.mkdir(parents=True, exist_ok=True)
            _drop_old(self._path.parent)
        with tempfile.TemporaryFile(dir=self._path):
            pass

    def get_source_stamp(self) -> str:
        """Return what an entry must have been made from."""
        return self._stamp

    def get_disambiguator(self) -> str:
        """Return what tells functions of one name apart."""
        return str(self._line)

    @classmethod
    def from_function(cls, function: Callable[..., Any], file: str) -> "SourcesLocator | None":
        """Return the locator of a function, None if the cache cannot be written to."""
        folder = cache_folder()
        if folder is None:
            return None
        locator = cls(function.__module__, function.__code__.co_firstlineno, folder)
        try:
            locator.ensure_cache_path()
        except OSError:
            return None
        return locator


def _drop_old(folder: Path) -> None:
    """Remove the oldest entries beyond ``KEEP``."""
    entries = sorted(folder.iterdir(), key=lambda entry: entry.stat().st_mtime_ns, reverse=True)
    for entry in entries[KEEP:]:
        shutil.rmtree(entry, ignore_errors=True)

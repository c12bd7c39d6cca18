"""HDF5 files opened with care: a file from outside is hostile until checked.

Recordings end with a seal: a line with the SHA-256 of all bytes before it. It lies beyond the end that HDF5 knows of,
so every HDF5 library reads the file as if it were not there. A file with a good seal is as it was written, and is
opened at once. One without a seal is first walked through by a child process (``vet``), because a damaged file
can hang or crash the HDF5 library itself. Everything that is read passes the checks of ``Reader``.
"""

import contextlib
import hashlib
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import numpy as np

from magsim.errors import DataError, MagsimError, RequestError

if TYPE_CHECKING:
    import h5py

MAX_VALUE_BYTES = 1024**3
"""Largest data set that is read."""

VET_PROGRAM = Path(__file__).with_name("vet.py")
"""Walks through a file in a process of its own."""

VET_TIMEOUT_S = 30.0
"""Longest time that the child process may take."""

NAME = re.compile(r"[a-z0-9_]+")
"""Names of objects that are read."""

FILTERS = ("deflate", "shuffle", "fletcher32")
"""Filters that a data set may have passed: those that HDF5 itself brings."""

_SEAL = re.compile(rb"magsim-sha256:([0-9a-f]{64})\n")
SEAL_BYTES = len("magsim-sha256:") + 64 + 1
_MAGIC = b"\x89HDF\r\n\x1a\n"


def seal(path: Path) -> None:
    """Append the SHA-256 of a finished file to it."""
    digest = _sha256(path, path.stat().st_size)
    with path.open("ab") as file:
        file.write(b"magsim-sha256:" + digest.encode() + b"\n")


@contextlib.contextmanager
def open_careful(path: Path) -> Iterator["Reader"]:
    """Open an HDF5 file from anywhere for reading.

    Yields
    ------
    Reader
        Of the root group.

    Raises
    ------
    RequestError
        If there is no such file, or it cannot be opened.
    DataError
        If it is no HDF5 file, or is damaged; also where that shows only while it is read.
    """
    _check_file(path)
    if not _seal_is_good(path):
        _vet(path)
    import h5py

    try:
        with h5py.File(path, "r", locking=False) as file:
            yield Reader(path, file)
    except MagsimError:
        raise
    except Exception as error:  # whatever HDF5 stumbles over, the file is the reason
        raise damaged(path, error) from error


def damaged(path: Path, error: Exception) -> DataError:
    """The one line that tells of a file that HDF5 cannot read."""
    lines = str(error).splitlines() or [type(error).__name__]
    if "truncated" in lines[0]:
        return DataError(f"{path}: is truncated: it ends before its data do")
    return DataError(f"{path}: is damaged: HDF5 cannot read it ({lines[0][:200]})")


class Reader:
    """A group of an HDF5 file, of which only plain and bounded things are read.

    Parameters
    ----------
    path : Path
        File, for messages.
    group : h5py.Group
    """

    def __init__(self, path: Path, group: "h5py.Group") -> None:
        self.path = path
        self._group = group

    @property
    def where(self) -> str:
        """File and group, for messages."""
        name = self._group.name.strip("/")
        return f"{self.path}: {name}" if name else str(self.path)

    def names(self) -> list[str]:
        """Names of all members, sorted."""
        names = sorted(self._group)
        for name in names:
            if not NAME.fullmatch(name):
                self.refuse(f"the name {name[:60]!a} is not allowed; allowed: lower-case letters, digits and _")
        return names

    def group(self, name: str) -> "Reader":
        """A group inside."""
        import h5py

        item = self._member(name)
        if not isinstance(item, h5py.Group):
            self.refuse(f"{name} is not a group")
        return Reader(self.path, item)

    def array(self, name: str, *, kind: str, ndim: int) -> np.ndarray:
        """Values of a data set.

        Parameters
        ----------
        name : str
        kind : str
            Kind of numpy type that it must have: ``f`` float, ``i`` integer, ``S`` bytes.
        ndim : int
            Number of dimensions that it must have.
        """
        import h5py

        item = self._member(name)
        if not isinstance(item, h5py.Dataset):
            self.refuse(f"{name} is not a data set")
        if item.external or item.is_virtual:
            self.refuse(f"{name} keeps its values in another file, which is not allowed")
        self._check_filters(name, item)
        if item.ndim != ndim or item.dtype.kind != kind or item.dtype.hasobject:
            self.refuse(f"{name} is {item.ndim}-dimensional of type {item.dtype}; expected {ndim} of kind {kind!r}")
        size = int(np.prod([int(n) for n in item.shape], dtype=object)) * item.dtype.itemsize
        # deflate shrinks by 1032 at most, so anything larger is a claim without values
        limit = min(MAX_VALUE_BYTES, self.path.stat().st_size * 1032)
        if size > limit:
            self.refuse(f"{name} claims {size} bytes; allowed: up to {limit}")
        return item[()]

    def attributes(self) -> dict[str, str | int | float]:
        """Attributes that are one text or one number; others are left out."""
        out: dict[str, str | int | float] = {}
        for name in sorted(self._group.attrs):
            found = self._group.attrs.get_id(name)
            if found.shape != () or found.get_storage_size() > 2**20 or found.dtype.hasobject:
                continue
            value = self._group.attrs[name]
            if isinstance(value, bytes | np.bytes_):
                out[name] = bytes(value).decode("utf-8")
            elif isinstance(value, str | np.str_):
                out[name] = str(value)
            elif isinstance(value, np.integer | np.floating):
                out[name] = value.item()
        return out

    def texts_attribute(self, member: str, name: str) -> list[str]:
        """Attribute of a member that is a list of texts."""
        attributes = self._member(member).attrs  # type: ignore[attr-defined]
        if name not in attributes:
            self.refuse(f"{member} has no attribute {name}")
        found = attributes.get_id(name)
        if len(found.shape or ()) != 1 or found.dtype.kind != "S" or found.get_storage_size() > 2**20:
            self.refuse(f"attribute {name} of {member} is not a list of texts")
        return [text.decode("utf-8", "replace") for text in attributes[name].astype("S").tolist()]

    def refuse(self, why: str) -> NoReturn:
        """Raise the DataError that tells what is wrong here."""
        msg = f"{self.where}: {why}"
        raise DataError(msg)

    def _member(self, name: str) -> object:
        import h5py

        if name not in self._group:
            self.refuse(f"there is no {name}")
        if not isinstance(self._group.get(name, getlink=True), h5py.HardLink):
            self.refuse(f"{name} is a link to elsewhere, which is not allowed")
        return self._group[name]

    def _check_filters(self, name: str, item: "h5py.Dataset") -> None:
        import h5py

        codes = {h5py.h5z.FILTER_DEFLATE, h5py.h5z.FILTER_SHUFFLE, h5py.h5z.FILTER_FLETCHER32}
        properties = item.id.get_create_plist()
        used = {properties.get_filter(i)[0] for i in range(properties.get_nfilters())}
        if used - codes:
            self.refuse(f"{name} is packed with filter {min(used - codes)}; allowed: {', '.join(FILTERS)}")


def _check_file(path: Path) -> None:
    try:
        if path.is_dir():
            msg = f"{path}: is a folder, not a recording"
            raise RequestError(msg)
        if path.exists() and not path.is_file():
            msg = f"{path}: is not a regular file"
            raise RequestError(msg)
        with path.open("rb") as file:
            head = file.read(len(_MAGIC))
    except FileNotFoundError:
        msg = f"{path}: there is no such file"
        raise RequestError(msg) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        msg = f"{path}: cannot be read: {reason}"
        raise RequestError(msg) from None
    if head != _MAGIC:
        what = "is empty" if not head else "is not an HDF5 file"
        msg = f"{path}: {what}, so it is no recording"
        raise DataError(msg)


def _seal_is_good(path: Path) -> bool:
    """Whether the file ends with a seal; a seal that does not fit the bytes before it is a DataError."""
    size = path.stat().st_size - SEAL_BYTES
    if size <= 0:
        return False
    with path.open("rb") as file:
        file.seek(size)
        tail = file.read()
    found = _SEAL.fullmatch(tail)
    if found is None and b"magsim-sha256:" in tail:
        msg = f"{path}: is truncated: the checksum at its end is not complete"
        raise DataError(msg)
    if found is None:
        return False
    if _sha256(path, size) != found[1].decode():
        msg = f"{path}: is damaged: its bytes are not those that were written (the checksum at its end differs)"
        raise DataError(msg)
    return True


def _sha256(path: Path, size: int) -> str:
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while size > 0:
            block = file.read(min(size, 2**20))
            if not block:
                break
            digest.update(block)
            size -= len(block)
    return digest.hexdigest()


def _vet(path: Path) -> None:
    """Let a child process read the whole file first."""
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    try:
        run = subprocess.run(
            [sys.executable, str(VET_PROGRAM), str(path.absolute())],
            capture_output=True,
            text=True,
            timeout=VET_TIMEOUT_S,
            check=False,
            env=environment,
        )
    except subprocess.TimeoutExpired:
        msg = f"{path}: is damaged: HDF5 does not come to an end with it"
        raise DataError(msg) from None
    if run.returncode < 0:
        msg = f"{path}: is damaged: HDF5 breaks down over it"
        raise DataError(msg)
    if run.returncode:
        last = (run.stderr.strip().splitlines() or ["no reason given"])[-1]
        raise damaged(path, ValueError(last.split(": ", 1)[-1]))

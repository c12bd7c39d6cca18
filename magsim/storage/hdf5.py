"""HDF5 files opened with care: a file from outside is hostile until checked.

Recordings end with a seal (``seal``), and one that does not fit is refused at once. But anyone can make a seal that
fits: so a file that this process has not written itself is first walked through by a child process (``vetting``).
Everything that is read passes the checks of ``Reader`` too.
"""

import contextlib
import re
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import numpy as np

from magsim.errors import DataError, MagsimError
from magsim.storage.seal import append_seal, seal_state
from magsim.storage.vetting import damage, remember, vet

if TYPE_CHECKING:
    import h5py

MAX_VALUE_BYTES = 1024**3
"""Largest data set that is read."""

NAME = re.compile(r"[a-z0-9_]+")
"""Names of objects that are read."""

FILTERS = ("deflate", "shuffle", "fletcher32")
"""Filters that a data set may have passed: those that HDF5 itself brings."""


def seal(path: Path) -> None:
    """Append the SHA-256 of a finished file to it; it needs no walk in this process."""
    remember(append_seal(path), "")


@contextlib.contextmanager
def open_careful(path: Path, *, also: Collection[str] = (), whatever_the_seal: bool = False) -> Iterator["Reader"]:
    """Open an HDF5 file from anywhere for reading.

    Parameters
    ----------
    path : Path
    also : collection of str
        Names of members that are allowed beside those that fit ``NAME``.
    whatever_the_seal : bool
        Open a file whose seal is broken too, to find out where it differs.

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
    state = seal_state(path)
    if state.kind == "broken" and not whatever_the_seal:
        msg = f"{path}: {state.why}"
        raise DataError(msg)
    vet(path, state.digest)
    import h5py

    try:
        with h5py.File(path, "r", locking=False) as file:
            yield Reader(path, file, also)
    except MagsimError:
        raise
    except Exception as error:  # whatever HDF5 stumbles over, the file is the reason
        raise damaged(path, error) from error


def damaged(path: Path, error: Exception) -> DataError:
    """The one line that tells of a file that HDF5 cannot read."""
    lines = str(error).splitlines() or [type(error).__name__]
    return DataError(f"{path}: {damage(lines[0])}")


class Reader:
    """A group of an HDF5 file, of which only plain and bounded things are read.

    Parameters
    ----------
    path : Path
        File, for messages.
    group : h5py.Group
    also : collection of str
        See ``open_careful``.
    """

    def __init__(
        self, path: Path, group: "h5py.Group", also: Collection[str] = (), left: list[int] | None = None
    ) -> None:
        self.path = path
        self._also = also
        self._group = group
        self._left = [path.stat().st_size + MAX_VALUE_BYTES] if left is None else left

    @property
    def where(self) -> str:
        """File and group, for messages."""
        name = self._group.name.strip("/")
        return f"{self.path}: {name}" if name else str(self.path)

    def names(self) -> list[str]:
        """Names of all members, sorted."""
        names = sorted(self._group)
        for name in names:
            if not NAME.fullmatch(name) and name not in self._also:
                self.refuse(f"the name {name[:60]!a} is not allowed; allowed: lower-case letters, digits and _")
        return names

    def group(self, name: str) -> "Reader":
        """A group inside."""
        import h5py

        item = self._member(name)
        if not isinstance(item, h5py.Group):
            self.refuse(f"{name} is not a group")
        return Reader(self.path, item, self._also, self._left)

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
        item = self._plain(name, kind=kind, ndim=ndim)
        self._spend(name, item)
        return item[()]

    def block(self, name: str, *, ndim: int) -> tuple[int, tuple[int, ...]]:
        """Where in the file the values of a data set lie, for memory mapping.

        Parameters
        ----------
        name : str
        ndim : int

        Returns
        -------
        (int, tuple of int)
            Offset in bytes from the beginning of the file, and shape. The values are little-endian float64, in C order,
            and lie in the file whole.
        """
        item = self._plain(name, kind="f", ndim=ndim)
        offset = item.id.get_offset() if item.chunks is None else None
        if offset is None or item.dtype.str != "<f8":
            self.refuse(f"{name} is not one contiguous block of float64, so it cannot be mapped")
        if offset + item.size * 8 > self.path.stat().st_size:
            self.refuse(f"{name} ends beyond the end of the file")
        return offset, item.shape

    def text_attribute(self, member: str, name: str) -> str | None:
        """Attribute of a member that is one text, or None where there is none."""
        attributes = self._member(member).attrs  # type: ignore[attr-defined]
        if name not in attributes:
            return None
        found = attributes.get_id(name)
        if found.shape != () or found.dtype.kind != "S" or found.get_storage_size() > 2**20:
            self.refuse(f"attribute {name} of {member} is not a text")
        return bytes(attributes[name]).decode("utf-8", "replace")

    def _plain(self, name: str, *, kind: str, ndim: int) -> "h5py.Dataset":
        import h5py

        item = self._member(name)
        if not isinstance(item, h5py.Dataset):
            self.refuse(f"{name} is not a data set")
        if item.external or item.is_virtual:
            self.refuse(f"{name} keeps its values in another file, which is not allowed")
        self._check_filters(name, item)
        if item.ndim != ndim or item.dtype.kind != kind or item.dtype.hasobject:
            self.refuse(f"{name} is {item.ndim}-dimensional of type {item.dtype}; expected {ndim} of kind {kind!r}")
        return item

    def _spend(self, name: str, item: "h5py.Dataset") -> None:
        size = int(np.prod([int(n) for n in item.shape], dtype=object)) * item.dtype.itemsize
        # deflate shrinks by 1032 at most, so anything larger is a claim without values
        limit = min(MAX_VALUE_BYTES, self.path.stat().st_size * 1032, self._left[0])
        if size > limit:
            self.refuse(f"{name} claims {size} bytes; allowed: up to {limit}")
        self._left[0] -= size

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

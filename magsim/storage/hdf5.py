"""Reading of HDF5 files that are not trusted: a file from elsewhere may be damaged, or made to do harm.

Recordings end with a checksum line (``checksum``), and a file whose line does not fit is refused at once. But anyone
can write a line that fits: so a file that this process has not written itself is first read by a child process
(``inspection``). Everything that is read passes the checks of ``Reader`` too.
"""

import contextlib
import re
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import numpy as np

from magsim.errors import DataError, MagsimError
from magsim.storage.checksum import append_checksum, checksum_state, known_state
from magsim.storage.inspection import damage_of, inspect, note_result

if TYPE_CHECKING:
    import h5py

MAX_VALUE_BYTES = 1024**3
"""Largest data set that is read."""

NAME = re.compile(r"[a-z0-9_]+")
"""Names of objects that are read."""

FILTERS = ("deflate", "shuffle", "fletcher32")
"""Filters that are allowed for the values of a data set: those that are part of HDF5 itself."""


def add_checksum(path: Path) -> str:
    """Append the checksum line to a finished file; this process reads it without an inspection.

    Returns
    -------
    str
        SHA-256 of all bytes, that line included.
    """
    digest = append_checksum(path)
    note_result(digest, "")
    return digest


@contextlib.contextmanager
def open_untrusted(path: Path, *, also: Collection[str] = (), ignore_checksum: bool = False) -> Iterator["Reader"]:
    """Open an HDF5 file from any source for reading.

    Parameters
    ----------
    path : Path
    also : collection of str
        Names of members that are allowed beside those that fit ``NAME``.
    ignore_checksum : bool
        Open a file whose checksum does not fit too, to find out where it differs.

    Yields
    ------
    Reader
        Of the root group.

    Raises
    ------
    RequestError
        If there is no such file, or it cannot be opened.
    DataError
        If it is no HDF5 file, or is damaged; also if that shows only while it is read.
    """
    state = checksum_state(path) if ignore_checksum else known_state(path)
    if state.kind == "broken" and not ignore_checksum:
        msg = f"{path}: {state.reason}"
        raise DataError(msg)
    inspect(path, state.digest)
    import h5py

    try:
        with h5py.File(path, "r", locking=False) as file:
            yield Reader(path, file, also)
    except MagsimError:
        raise
    except Exception as error:  # whatever HDF5 stumbles over, the file is the reason
        raise damaged(path, error) from error


def damaged(path: Path, error: Exception) -> DataError:
    """Return the error, in one line, about a file that HDF5 cannot read."""
    lines = str(error).splitlines() or [type(error).__name__]
    return DataError(f"{path}: {damage_of(lines[0])}")


class Reader:
    """A group of an HDF5 file, of which only plain and bounded values are read.

    Parameters
    ----------
    path : Path
        File, for messages.
    group : h5py.Group
    also : collection of str
        See ``open_untrusted``.
    left_bytes : list of int, optional
        Bytes that may still be read from the file: one number, shared by all groups of the file.
    """

    def __init__(
        self, path: Path, group: "h5py.Group", also: Collection[str] = (), left_bytes: list[int] | None = None
    ) -> None:
        self.path = path
        self._also = also
        self._group = group
        self._left_bytes = [path.stat().st_size + MAX_VALUE_BYTES] if left_bytes is None else left_bytes

    @property
    def where(self) -> str:
        """File and group, for messages."""
        name = self._group.name.strip("/")
        return f"{self.path}: {name}" if name else str(self.path)

    def names(self) -> list[str]:
        """Return the names of all members, sorted.

        Raises
        ------
        DataError
            If one is not allowed.
        """
        names = sorted(self._group)
        for name in names:
            if not NAME.fullmatch(name) and name not in self._also:
                self.refuse(f"the name {name[:60]!a} is not allowed; allowed: lower-case letters, digits and _")
        return names

    def group(self, name: str) -> "Reader":
        """Return a group inside."""
        import h5py

        item = self._member(name)
        if not isinstance(item, h5py.Group):
            self.refuse(f"{name} is not a group")
        return Reader(self.path, item, self._also, self._left_bytes)

    def array(self, name: str, *, kind: str, ndim: int) -> np.ndarray:
        """Return the values of a data set.

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
        """Return the place of the values of a data set in the file, for memory mapping.

        Parameters
        ----------
        name : str
        ndim : int

        Returns
        -------
        (int, tuple of int)
            Offset in bytes from the beginning of the file, and shape. The values are little-endian float64, in C order,
            and are contiguous in the file.
        """
        item = self._plain(name, kind="f", ndim=ndim)
        offset = item.id.get_offset() if item.chunks is None else None
        if offset is None or item.dtype.str != "<f8":
            self.refuse(f"{name} is not one contiguous block of float64, so it cannot be mapped")
        if offset + item.size * 8 > self.path.stat().st_size:
            self.refuse(f"{name} ends beyond the end of the file")
        return offset, item.shape

    def text_attribute(self, member: str, name: str) -> str | None:
        """Return an attribute of a member that is one text; None if there is none."""
        attributes = self._member(member).attrs
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
        limit = min(MAX_VALUE_BYTES, self.path.stat().st_size * 1032, self._left_bytes[0])
        if size > limit:
            self.refuse(f"{name} claims {size} bytes; allowed: up to {limit}")
        self._left_bytes[0] -= size

    def attributes(self) -> dict[str, str | int | float]:
        """Return the attributes that are one text or one number; others are left out."""
        found = ((name, self.attribute(name)) for name in sorted(self._group.attrs))
        return {name: value for name, value in found if value is not None}

    def attribute(self, name: str) -> str | int | float | None:
        """Return an attribute that is one text or one number; None if it is something else or absent."""
        if name not in self._group.attrs:
            return None
        found = self._group.attrs.get_id(name)
        if found.shape != () or found.get_storage_size() > 2**20 or found.dtype.hasobject:
            return None
        value = self._group.attrs[name]
        if isinstance(value, bytes | np.bytes_):
            return bytes(value).decode("utf-8")
        if isinstance(value, str | np.str_):
            return str(value)
        return value.item() if isinstance(value, np.integer | np.floating) else None

    def texts_attribute(self, member: str, name: str) -> list[str]:
        """Return an attribute of a member that is a list of texts."""
        attributes = self._member(member).attrs
        if name not in attributes:
            self.refuse(f"{member} has no attribute {name}")
        found = attributes.get_id(name)
        if len(found.shape or ()) != 1 or found.dtype.kind != "S" or found.get_storage_size() > 2**20:
            self.refuse(f"attribute {name} of {member} is not a list of texts")
        return [text.decode("utf-8", "replace") for text in attributes[name].astype("S").tolist()]

    def refuse(self, reason: str) -> NoReturn:
        """Raise a DataError about this file and group."""
        msg = f"{self.where}: {reason}"
        raise DataError(msg)

    def _member(self, name: str) -> "h5py.HLObject":
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

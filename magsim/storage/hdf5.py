"""HDF5 files opened with care: a file from outside is hostile until checked.

Recordings end with a seal: a line with the SHA-256 of all bytes before it. It lies beyond the end that HDF5 knows of,
so every HDF5 library reads the file as if it were not there. A seal that does not fit is refused at once. But anyone
can make a seal that fits: so a file that this process has not written itself is first walked through by a child process
(``vet``) with limits of memory and time, because a bad file can hang or crash the HDF5 library itself.
Everything that is read passes the checks of ``Reader`` too.
"""

import contextlib
import hashlib
import json
import os
import re
import subprocess
import sys
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
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

_REFUSED = 4  # exit code of the vet program
_TIMEOUT = 124
_OUT_OF_CPU = -24  # SIGXCPU
_MANY = 100
_KNOWN: dict[str, str] = {}
"""What the child process said of files, by the SHA-256 of all their bytes: "" for good. Files written here are good."""

_SEAL = re.compile(rb"magsim-sha256:([0-9a-f]{64})\n")
SEAL_BYTES = len("magsim-sha256:") + 64 + 1
_MAGIC = b"\x89HDF\r\n\x1a\n"


def seal(path: Path) -> None:
    """Append the SHA-256 of a finished file to it."""
    digest = _sha256(path, path.stat().st_size)
    line = b"magsim-sha256:" + digest.hexdigest().encode() + b"\n"
    with path.open("ab") as file:
        file.write(line)
    digest.update(line)
    _remember(digest.hexdigest(), "")


@dataclass(frozen=True)
class SealState:
    """What the seal of a file says.

    Attributes
    ----------
    kind : str
        ``good``, ``none`` or ``broken``.
    why : str
        What is wrong, in words that follow the file's name; empty where it is good.
    digest : str
        SHA-256 of all bytes, seal included.
    """

    kind: str
    why: str
    digest: str


def seal_state(path: Path) -> SealState:
    """Compare the seal of a file with its bytes.

    Raises
    ------
    RequestError
        If there is no such file, or it cannot be opened.
    DataError
        If it is no HDF5 file.
    """
    _check_file(path)
    size = max(0, path.stat().st_size - SEAL_BYTES)
    body = _sha256(path, size)
    with path.open("rb") as file:
        file.seek(size)
        tail = file.read(SEAL_BYTES)
    whole = body.copy()
    whole.update(tail)
    found = _SEAL.fullmatch(tail)
    if found is not None and body.hexdigest() == found[1].decode():
        return SealState("good", "", whole.hexdigest())
    if found is not None:
        why = "is damaged: its bytes are not those that were written (the checksum at its end differs)"
    elif b"magsim-sha256:" in tail[1:]:
        why = "is truncated: the checksum at its end is not complete"
    elif sum(a == b for a, b in zip(tail, b"magsim-sha256:", strict=False)) > 7:
        why = "is damaged: the checksum at its end is not one"
    else:
        return SealState("none", "has no checksum at its end: another program wrote or changed it", whole.hexdigest())
    return SealState("broken", why, whole.hexdigest())


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
    _vet(path, state.digest)
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
    return DataError(f"{path}: {_damage(lines[0])}")


def _damage(line: str) -> str:
    if "truncated" in line:
        return "is truncated: it ends before its data do"
    return f"is damaged: HDF5 cannot read it ({line[:200]})"


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


def _sha256(path: Path, size: int) -> "hashlib._Hash":
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while size > 0:
            block = file.read(min(size, 2**20))
            if not block:
                break
            digest.update(block)
            size -= len(block)
    return digest


def vet_many(paths: Sequence[Path]) -> None:
    """Let child processes walk through many files ahead, faster than one by one; what they say is told on opening."""
    if not hasattr(os, "fork"):
        return
    states = []
    for path in paths:
        with contextlib.suppress(MagsimError):  # told on opening
            states.append((path, seal_state(path)))
    wanted = [(path, state.digest) for path, state in states if state.kind != "broken" and state.digest not in _KNOWN]
    for start in range(0, len(wanted) if len(wanted) > 1 else 0, _MANY):
        batch = wanted[start : start + _MANY]
        names = [str(path.absolute()) for path, _ in batch]
        run = _child(["--many", str(VET_TIMEOUT_S), *names], VET_TIMEOUT_S * (1 + len(batch)))
        answers = [] if run is None else run.stdout.splitlines()
        for (_, digest), answer in zip(batch, answers, strict=False):
            _remember(digest, _verdict(*json.loads(answer)))


def _vet(path: Path, digest: str) -> None:
    """Let a child process walk through the whole file first, unless what it would say is known."""
    verdict = _KNOWN.get(digest)
    if verdict is None:
        run = _child([str(path.absolute())], VET_TIMEOUT_S)
        lines = [] if run is None else run.stderr.strip().splitlines()
        verdict = _verdict(_TIMEOUT if run is None else run.returncode, (lines or [""])[-1])
        _remember(digest, verdict)
    if verdict:
        msg = f"{path}: {verdict}"
        raise DataError(msg)


def _child(arguments: list[str], timeout_s: float) -> subprocess.CompletedProcess[str] | None:
    """Run the vet program; None where it took too long."""
    # HDF5 may load no code that a file's filters ask for
    quiet = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "HDF5_PLUGIN_PRELOAD": "::"}
    try:
        return subprocess.run(
            [sys.executable, "-P", str(VET_PROGRAM), *arguments],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            encoding="utf-8",
            errors="replace",
            timeout=timeout_s,
            check=False,
            env={**os.environ, **quiet},
        )
    except subprocess.TimeoutExpired:
        return None


def _verdict(code: int, last_line: str) -> str:
    """What the exit code and last line of the vet program mean, in words that follow the file's name; "" for good."""
    plain = "".join(c if c.isprintable() else "?" for c in last_line)[:300] or "no reason given"
    if code == 0:
        return ""
    if code == _REFUSED:
        return plain
    if code in (_TIMEOUT, _OUT_OF_CPU):
        return "is damaged: HDF5 does not come to an end with it"
    if code < 0:
        return "is damaged: HDF5 breaks down over it"
    return _damage(plain)


def _remember(digest: str, verdict: str) -> None:
    if len(_KNOWN) >= 20_000:
        _KNOWN.clear()
    _KNOWN[digest] = verdict

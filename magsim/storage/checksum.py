"""The checksum line at the end of a file: a last line with the SHA-256 of all bytes before it.

It follows the end that HDF5 records for the file, so every HDF5 library reads the file without noticing it.
"""

import hashlib
import re
import time
from dataclasses import dataclass
from pathlib import Path

from magsim.errors import DataError
from magsim.files import first_bytes

_LINE = re.compile(rb"magsim-sha256:([0-9a-f]{64})\n")
CHECKSUM_BYTES = len("magsim-sha256:") + 64 + 1
_MAGIC = b"\x89HDF\r\n\x1a\n"

SETTLED_S = 2.0
"""A file that changed less than this ago may change again without a new time stamp, so it is not recognized."""

_KNOWN: dict["Stamp", "ChecksumState"] = {}

Stamp = tuple[int, int, int, int, int]
"""What the system says of a file: device, number, size, times of the last change of content and of state [ns]."""


def stamp_of(path: Path) -> Stamp:
    """Return what the system says of a file; any change of the file changes it, but see ``SETTLED_S``."""
    found = path.stat()
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns


def append_checksum(path: Path) -> str:
    """Append the checksum line to a finished file.

    Returns
    -------
    str
        SHA-256 of all bytes, that line included.
    """
    digest = _sha256(path, path.stat().st_size)
    line = b"magsim-sha256:" + digest.hexdigest().encode() + b"\n"
    with path.open("ab") as file:
        file.write(line)
    digest.update(line)
    return digest.hexdigest()


@dataclass(frozen=True)
class ChecksumState:
    """Result of comparing a file with its checksum line.

    Attributes
    ----------
    kind : str
        ``good``, ``none`` or ``broken``.
    reason : str
        What is wrong, in words that follow the file's name; empty if good.
    digest : str
        SHA-256 of all bytes, the checksum line included.
    """

    kind: str
    reason: str
    digest: str


def known_state(path: Path) -> ChecksumState:
    """Return ``checksum_state`` of a file, without reading it again if it has not changed since this process did.

    Raises
    ------
    RequestError, DataError
        As ``checksum_state``.
    """
    try:
        stamp = stamp_of(path)
    except (OSError, ValueError):
        return checksum_state(path)  # raises what is wrong with the path
    known = _KNOWN.get(stamp)
    if known is None:
        known = checksum_state(path)
        if time.time() - max(stamp[3:]) / 1e9 > SETTLED_S and stamp_of(path) == stamp:
            if len(_KNOWN) >= 20_000:
                _KNOWN.clear()
            _KNOWN[stamp] = known
    return known


def checksum_state(path: Path) -> ChecksumState:
    """Compare the bytes of a file with its checksum line.

    Raises
    ------
    RequestError
        If there is no such file, or it cannot be opened.
    DataError
        If it is no HDF5 file.
    """
    _check_file(path)
    size = max(0, path.stat().st_size - CHECKSUM_BYTES)
    body = _sha256(path, size)
    with path.open("rb") as file:
        file.seek(size)
        tail = file.read(CHECKSUM_BYTES)
    whole = body.copy()
    whole.update(tail)
    found = _LINE.fullmatch(tail)
    if found is not None and body.hexdigest() == found[1].decode():
        return ChecksumState("good", "", whole.hexdigest())
    if found is not None:
        reason = "is damaged: its bytes are not those that were written (the checksum at its end differs)"
    elif b"magsim-sha256:" in tail[1:]:
        reason = "is truncated: the checksum at its end is not complete"
    elif sum(a == b for a, b in zip(tail, b"magsim-sha256:", strict=False)) > 7:
        reason = "is damaged: the checksum at its end is not one"
    else:
        reason = "has no checksum at its end: another program wrote or changed it"
        return ChecksumState("none", reason, whole.hexdigest())
    return ChecksumState("broken", reason, whole.hexdigest())


def _check_file(path: Path) -> None:
    head = first_bytes(path, len(_MAGIC), kind="a recording")
    if head != _MAGIC:
        what = "is empty" if not head else "is not an HDF5 file"
        msg = f"{path}: {what}, so it is no recording"
        raise DataError(msg)


def _sha256(path: Path, size: int) -> "hashlib._Hash":
    """Return the running SHA-256 of the first bytes of a file."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while size > 0:
            block = file.read(min(size, 2**20))
            if not block:
                break
            digest.update(block)
            size -= len(block)
    return digest

"""The seal of a file: a last line with the SHA-256 of all bytes before it.

It lies beyond the end that HDF5 knows of, so every HDF5 library reads the file as if it were not there.
"""

import hashlib
import re
from dataclasses import dataclass
from pathlib import Path

from magsim.errors import DataError
from magsim.files import first_bytes

_SEAL = re.compile(rb"magsim-sha256:([0-9a-f]{64})\n")
SEAL_BYTES = len("magsim-sha256:") + 64 + 1
_MAGIC = b"\x89HDF\r\n\x1a\n"


def append_seal(path: Path) -> str:
    """Append the SHA-256 of a finished file to it; that of all bytes, seal included."""
    digest = _sha256(path, path.stat().st_size)
    line = b"magsim-sha256:" + digest.hexdigest().encode() + b"\n"
    with path.open("ab") as file:
        file.write(line)
    digest.update(line)
    return digest.hexdigest()


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


def _check_file(path: Path) -> None:
    head = first_bytes(path, len(_MAGIC), kind="a recording")
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

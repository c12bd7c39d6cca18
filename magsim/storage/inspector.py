"""Read a whole HDF5 file; run as a program of its own, which may crash or hang in its caller's stead.

``python inspector.py FILE`` ends with 0 if everything in the file is allowed and could be read within its limits of
memory and time, with 4 if something is not allowed, with another code if HDF5 fails. The last line on stderr is the
reason. ``python inspector.py --many SECONDS FILE ...`` gives each file a process of its own with that many seconds, and
prints a line of JSON for each: [code, last line]. It imports nothing of magsim, so it starts fast.
"""

import json
import os
import select
import signal
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

if TYPE_CHECKING:
    import h5py

CPU_S = 8
MEMORY_BYTES = 4 * 1024**3
VALUE_BYTES = 1024**3
OBJECTS = 200_000
DEPTH = 16
NAME_BYTES = 255
FILTERS = (1, 2, 3)  # deflate, shuffle, fletcher32, as HDF5 numbers them
NOT_ALLOWED = 4


class NotAllowedError(Exception):
    """Something in the file that is never read."""


def main(path: str) -> int:
    """Read everything in the file, each value no larger than the limits allow, and return the exit code."""
    with suppress(ImportError, ValueError, OSError):
        import resource

        resource.setrlimit(resource.RLIMIT_CPU, (CPU_S, CPU_S))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    try:
        walk(path)
    except NotAllowedError as error:
        print(error, file=sys.stderr)
        return NOT_ALLOWED
    except Exception as error:
        print(*(str(error).splitlines()[:1] or [type(error).__name__]), file=sys.stderr)
        return 1
    return 0


def walk(path: str) -> None:
    """Read every object that can be reached from the root."""
    import h5py

    size = Path(path).stat().st_size
    budget = Budget(size)
    with h5py.File(path, "r", locking=False) as file:
        groups: list[tuple[h5py.Group, int]] = [(file, 0)]
        while groups:
            group, depth = groups.pop()
            read_attributes(group, budget)
            for name in group:
                item = member(group, name, budget)
                if isinstance(item, h5py.Group):
                    if depth >= DEPTH:
                        refuse(group, f"groups are nested deeper than is allowed; allowed: {DEPTH}")
                    groups.append((item, depth + 1))
                elif isinstance(item, h5py.Dataset):
                    read_attributes(item, budget)
                    read_values(item, budget, size)


class Budget:
    """Bytes and objects that a file may still hold: its own size, and an allowance for compressed values."""

    def __init__(self, size: int) -> None:
        self.bytes = size + VALUE_BYTES
        self.objects = OBJECTS

    def spend(self, item: "h5py.HLObject", claimed: int, limit: int) -> None:
        """Subtract what a value claims, or end the walk."""
        limit = min(limit, self.bytes)
        if claimed > limit:
            refuse(item, f"claims {claimed} bytes; allowed: up to {limit}")
        self.bytes -= claimed


def refuse(item: "h5py.HLObject", why: str) -> NoReturn:
    """End the walk.

    Raises
    ------
    NotAllowedError
        With the name of the item and the reason.
    """
    name = str(item.name).strip("/")[:200]
    raise NotAllowedError(f"{name!a} {why}" if name else why)


def member(group: "h5py.Group", name: str, budget: Budget) -> "h5py.HLObject":
    """Return a member that is a hard link; other links are not followed."""
    import h5py

    budget.objects -= 1
    if budget.objects < 0:
        refuse(group, f"has more objects than are allowed; allowed: {OBJECTS}")
    if len(os.fsencode(name)) > NAME_BYTES:
        refuse(group, f"has a name {name[:40]!a}... of {len(name)} characters; allowed: up to {NAME_BYTES} bytes")
    if not isinstance(group.get(name, getlink=True), h5py.HardLink):
        refuse(group, f"has a member {name[:60]!a} that is a link to elsewhere, which is not allowed")
    return group[name]


def read_attributes(item: "h5py.HLObject", budget: Budget) -> None:
    """Read every attribute."""
    for name in item.attrs:
        budget.spend(item, item.attrs.get_id(name).get_storage_size(), VALUE_BYTES)
        item.attrs[name]


def read_values(item: "h5py.Dataset", budget: Budget, size: int) -> None:
    """Read the values of a data set, except contiguous blocks of plain numbers."""
    if item.external or item.is_virtual:
        refuse(item, "keeps its values in another file, which is not allowed")
    properties = item.id.get_create_plist()
    for number in range(properties.get_nfilters()):
        code = properties.get_filter(number)[0]
        if code not in FILTERS:
            refuse(item, f"is packed with filter {code}; allowed: deflate, shuffle, fletcher32")
    if item.shape is None:
        return
    count = 1
    for length in item.shape:
        count *= int(length)
    # deflate shrinks by 1032 at most, so anything larger is a claim without values
    nbytes = count * item.dtype.itemsize
    budget.spend(item, nbytes, min(VALUE_BYTES, size * 1032))
    offset = item.id.get_offset() if item.chunks is None else None
    plain = item.dtype.str == "<f8" and offset is not None and 0 <= offset <= size - nbytes
    if not plain:
        item[()]


def many(seconds: float, paths: list[str]) -> None:
    """Inspect each file in a forked process of its own, so that the libraries are loaded once."""
    import h5py  # noqa: F401

    for path in paths:
        code, reason = in_child(seconds, path)
        print(json.dumps([code, reason]), flush=True)


def in_child(seconds: float, path: str) -> tuple[int, str]:
    """Return exit code, or the negative number of the signal that ended it, and last line of a process for one file."""
    reading, writing = os.pipe()
    child = os.fork()
    if not child:
        os.close(reading)
        os.dup2(writing, 2)
        code = 1
        with suppress(BaseException):
            code = main(path)
        with suppress(Exception):
            sys.stderr.flush()
        os._exit(code)
    os.close(writing)
    output, end = b"", time.monotonic() + seconds
    while True:
        ready, _, _ = select.select([reading], [], [], max(0.0, end - time.monotonic()))
        if not ready:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            os.close(reading)
            return 124, ""
        piece = os.read(reading, 65536)
        if not piece:
            break
        output = (output + piece)[-65536:]
    os.close(reading)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    return code, (output.decode("utf-8", "replace").strip().splitlines() or [""])[-1]


if __name__ == "__main__":
    if sys.argv[1] == "--many":
        many(float(sys.argv[2]), sys.argv[3:])
    else:
        sys.exit(main(sys.argv[1]))

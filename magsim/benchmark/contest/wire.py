"""What goes over a socket between the judge and a method: a JSON header, and arrays of float64 or bytes.

Both sides check all that they read; nothing is pickled.
"""

import json
import math
import mmap
import socket
import struct
import time
from collections.abc import Sequence
from itertools import accumulate, pairwise
from typing import Any, NamedTuple

import numpy as np

from magsim.recording import Recording

HEADER = struct.Struct("<QQ")
"""Bytes of the JSON header, and of what follows it."""

PID = struct.Struct("<q")
"""Number of a process."""

FORK, END = b"f", b"e"
"""What a server is asked for: a process, the end of it."""

MAX_HEADER = 2**20
MAX_BLOCKS = 2**14
PIECE = 2**20

Header = dict[str, Any]


class WireError(Exception):
    """The other side sent something that is no message, or too much."""


class Message(NamedTuple):
    """A header, and blocks of bytes."""

    header: Header
    blocks: tuple[memoryview, ...]

    def numbers(self, index: int) -> np.ndarray:
        """Return a block as float64, immutable.

        Raises
        ------
        WireError
            If there is no such block of whole numbers.
        """
        if not 0 <= index < len(self.blocks) or len(self.blocks[index]) % 8:
            msg = "an array is missing or cut off"
            raise WireError(msg)
        return np.frombuffer(self.blocks[index], dtype="<f8")


def send(
    line: socket.socket, header: Header, blocks: Sequence[bytes | memoryview] = (), *, until: float = math.inf
) -> None:
    """Send a message.

    Raises
    ------
    TimeoutError
        If the other side has not taken it by a time of ``time.monotonic`` [s].
    ConnectionError
        If the other side has ended.
    """
    sizes = [len(block) for block in blocks]
    text = json.dumps({**header, "sizes": sizes}).encode()
    for block in (HEADER.pack(len(text), sum(sizes)) + text, *blocks):
        _wait(line, until)
        line.sendall(block)


def receive(line: socket.socket, *, most: int, until: float = math.inf) -> Message:
    """Receive a message.

    Parameters
    ----------
    line : socket
    most : int
        Bytes that the blocks may have together.
    until : float [s]
        Of ``time.monotonic``.

    Raises
    ------
    TimeoutError
        If it is not there in time.
    EOFError
        If the other side has ended.
    WireError
        If it is no message, or a larger one.
    """
    length, size = HEADER.unpack(exactly(line, HEADER.size, until))
    if length > MAX_HEADER or size > most:
        msg = f"a message of {length} and {size} bytes; allowed: {MAX_HEADER} and {most}"
        raise WireError(msg)
    try:
        header = json.loads(bytes(exactly(line, length, until)))
        sizes = header.pop("sizes")
        if len(sizes) > MAX_BLOCKS or not all(type(one) is int and one >= 0 for one in sizes) or sum(sizes) != size:
            msg = "the sizes of a message do not add up"
            raise WireError(msg)
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        msg = f"the header of a message is broken: {type(error).__name__}"
        raise WireError(msg) from None
    whole = memoryview(mmap.mmap(-1, max(size, 1), flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS))[:size]
    _fill(whole, line, until)
    ends = accumulate(sizes, initial=0)
    return Message(header, tuple(whole.toreadonly()[a:b] for a, b in pairwise(ends)))


def exactly(line: socket.socket, count: int, until: float) -> bytearray:
    """Receive so many bytes; see ``receive`` for what is raised."""
    out = bytearray(count)
    _fill(memoryview(out), line, until)
    return out


def _fill(memory: memoryview, line: socket.socket, until: float) -> None:
    done = 0
    while done < len(memory):
        _wait(line, until)
        got = line.recv_into(memory[done : done + PIECE])
        if got == 0:
            raise EOFError
        done += got


def _wait(line: socket.socket, until: float) -> None:
    """Let the next step on a socket take until then."""
    left = until - time.monotonic()
    if left <= 0.0:
        raise TimeoutError
    line.settimeout(None if math.isinf(left) else left)


def numbers_as_bytes(values: np.ndarray) -> memoryview:
    """Return an array as a block of float64."""
    return np.ascontiguousarray(values, dtype="<f8").data.cast("B")


def send_recordings(line: socket.socket, recordings: Sequence[Recording], *, until: float) -> None:
    """Send recordings: a block for the times of each, and one for each of its columns; see ``send``."""
    heads = [{"name": one.name, "columns": list(one.data), "meta": dict(one.meta)} for one in recordings]
    columns = [values for one in recordings for values in (one.time_s, *one.data.values())]
    send(line, {"recordings": heads}, [numbers_as_bytes(values) for values in columns], until=until)


def receive_recordings(line: socket.socket, *, most: int) -> list[Recording]:
    """Receive recordings, in memory that is immutable and this process's own; see ``receive``."""
    message = receive(line, most=most)
    out, block = [], 0
    for head in message.header["recordings"]:
        data = {name: message.numbers(block + 1 + number) for number, name in enumerate(head["columns"])}
        out.append(Recording(head["name"], message.numbers(block), data, head["meta"]))
        block += 1 + len(data)
    return out

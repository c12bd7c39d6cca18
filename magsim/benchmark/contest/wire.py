"""What goes over a socket between the judge and a method: a JSON header, and arrays of float64 or bytes.

Both sides check all that they read; nothing is pickled.
"""

import json
import math
import socket
import struct
import time
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from magsim.recording import Recording

HEADER = struct.Struct("<QQ")
"""Bytes of the JSON header, and of what follows it."""

PID = struct.Struct("<q")
"""Number of a process."""

MAX_HEADER = 2**24
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


def send(line: socket.socket, header: Header, blocks: Sequence[bytes | memoryview] = ()) -> None:
    """Send a message."""
    sizes = [len(block) for block in blocks]
    text = json.dumps({**header, "sizes": sizes}).encode()
    line.sendall(HEADER.pack(len(text), sum(sizes)) + text)
    for block in blocks:
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
        sizes = [int(one) for one in header.pop("sizes")]
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        msg = f"the header of a message is broken: {type(error).__name__}"
        raise WireError(msg) from None
    if any(one < 0 for one in sizes) or sum(sizes) != size:
        msg = "the sizes of a message do not add up"
        raise WireError(msg)
    whole = memoryview(bytes(exactly(line, size, until)))
    ends = np.cumsum([0, *sizes])
    return Message(header, tuple(whole[a:b] for a, b in zip(ends[:-1], ends[1:], strict=True)))


def exactly(line: socket.socket, count: int, until: float) -> bytearray:
    """Receive so many bytes; see ``receive`` for what is raised."""
    out = bytearray(count)
    view, done = memoryview(out), 0
    while done < count:
        left = until - time.monotonic()
        if left <= 0.0:
            raise TimeoutError
        line.settimeout(None if math.isinf(left) else left)
        got = line.recv_into(view[done : done + PIECE])
        if got == 0:
            raise EOFError
        done += got
    return out


def packed(recordings: Sequence[Recording]) -> tuple[list[Header], list[memoryview]]:
    """Return recordings as headers and blocks, a block for the time and one for each column."""
    heads: list[Header] = []
    blocks: list[memoryview] = []
    for recording in recordings:
        heads.append({"name": recording.name, "columns": list(recording.data), "meta": dict(recording.meta)})
        columns = [recording.time_s, *recording.data.values()]
        blocks += [memoryview(np.ascontiguousarray(values, dtype="<f8")).cast("B") for values in columns]
    return heads, blocks


def unpacked(heads: Sequence[Mapping[str, Any]], message: Message) -> list[Recording]:
    """Return the recordings of a message, in arrays that are immutable and this process's own."""
    out, block = [], 0
    for head in heads:
        time_s, names = message.numbers(block), head["columns"]
        data = {name: message.numbers(block + 1 + number) for number, name in enumerate(names)}
        out.append(Recording(head["name"], time_s, data, head["meta"]))
        block += 1 + len(names)
    return out

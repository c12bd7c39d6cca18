"""Messages between the judge and a method: what is sent is what comes, and what is no message is refused."""

import json
import math
import socket
import threading
import time

import numpy as np
import pytest

from magsim.benchmark.contest import wire
from tests.benchmark.contest.cases import flights


@pytest.fixture
def ends():
    one, other = socket.socketpair()
    with one, other:
        yield one, other


def sent(ends, work):
    """Do work in a thread, and return what the other end gets of it."""
    thread = threading.Thread(target=work, args=(ends[0],))
    thread.start()
    try:
        return wire.receive(ends[1], most=2**30)
    finally:
        thread.join()


def test_blocks_come_as_they_were_sent_and_cannot_be_written_to(ends):
    blocks = [b"", b"a", bytes(range(256)) * 10_000, np.arange(3.0).data.cast("B")]
    message = sent(ends, lambda line: wire.send(line, {"status": "ok", "text": "ß"}, blocks))
    assert message.header == {"status": "ok", "text": "ß"}
    assert [bytes(block) for block in message.blocks] == [bytes(block) for block in blocks]
    np.testing.assert_array_equal(message.numbers(3), [0.0, 1.0, 2.0])
    with pytest.raises(ValueError, match="WRITEABLE"):
        message.numbers(3).flags.writeable = True


@pytest.mark.parametrize("index", [-1, 1, 4])
def test_a_block_that_is_no_array_is_refused(ends, index):
    message = sent(ends, lambda line: wire.send(line, {}, [b"", b"a", b"", b""]))
    with pytest.raises(wire.WireError, match="missing or cut off"):
        message.numbers(index)


def test_recordings_come_as_they_were_sent(ends):
    thread = threading.Thread(target=wire.send_recordings, args=(ends[0], flights()), kwargs={"until": math.inf})
    thread.start()
    assert wire.receive_recordings(ends[1], most=2**30) == list(flights())
    thread.join()


def header(value, size=0):
    text = value if isinstance(value, bytes) else json.dumps(value).encode()
    return wire.HEADER.pack(len(text), size) + text


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (wire.HEADER.pack(wire.MAX_HEADER + 1, 0), "allowed"),
        (wire.HEADER.pack(2, 2**31), "allowed"),
        (header([1]), "broken"),
        (header("text"), "broken"),
        (header({}), "broken"),
        (header(b"\xff\xfe"), "broken"),
        (header(b"{" * 10), "broken"),
        (header(b"[" * 100_000), "broken"),
        (header({"sizes": 7}), "broken"),
        (header({"sizes": [8]}), "add up"),
        (header({"sizes": [-8, 8]}), "add up"),
        (header({"sizes": [0.0]}), "add up"),
        (header({"sizes": [math.inf]}), "add up"),
        (header({"sizes": ["8"]}, 8), "add up"),
        (header({"sizes": [True]}, 1), "add up"),
        (header({"sizes": [0] * (wire.MAX_BLOCKS + 1)}), "add up"),
    ],
)
def test_what_is_no_message_is_refused(ends, data, message):
    with pytest.raises(wire.WireError, match=message):
        sent(ends, lambda line: line.sendall(data))


def test_an_end_and_a_silence_are_told_apart(ends):
    began = time.monotonic()
    with pytest.raises(TimeoutError):
        wire.receive(ends[1], most=0, until=began + 0.2)
    assert 0.2 <= time.monotonic() - began < 2.0
    ends[0].sendall(wire.HEADER.pack(100, 0))
    ends[0].close()
    with pytest.raises(EOFError):
        wire.receive(ends[1], most=0)


def test_one_that_takes_nothing_is_not_waited_for(ends):
    with pytest.raises(TimeoutError):
        wire.send(ends[0], {}, [bytes(2**24)], until=time.monotonic() + 0.2)

"""Files that a process has checked are recognized, and never where they have changed."""

import os
import time

import pytest

from magsim.errors import DataError, RequestError
from magsim.recording import read_recordings
from magsim.storage import checksum
from tests.support.folders import flight


@pytest.fixture
def path(tmp_path):
    flight("one", [0] * 50).write(tmp_path / "a.h5")
    return tmp_path / "a.h5"


@pytest.fixture
def reads(monkeypatch):
    """Number of times that a file is read as a whole."""
    seen = []
    whole = checksum.checksum_state
    monkeypatch.setattr(checksum, "checksum_state", lambda path: seen.append(path) or whole(path))
    return seen


def later(monkeypatch, seconds: float) -> None:
    now = time.time() + seconds
    monkeypatch.setattr(checksum.time, "time", lambda: now)


def test_a_settled_file_is_read_once(path, reads, monkeypatch):
    later(monkeypatch, 3.0)
    first = checksum.known_state(path)
    assert checksum.known_state(path) is first
    assert first.kind == "good"
    assert len(reads) == 1


def test_a_file_that_has_just_been_written_is_read_every_time(path, reads):
    """Its time stamp may not tell a second change that follows at once."""
    checksum.known_state(path)
    checksum.known_state(path)
    assert len(reads) == 2


def test_a_changed_file_is_read_again_even_with_its_old_time(path, reads, monkeypatch):
    later(monkeypatch, 3.0)
    checksum.known_state(path)
    before = path.stat()
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert path.stat().st_mtime_ns == before.st_mtime_ns
    assert checksum.known_state(path).kind == "broken"
    with pytest.raises(DataError, match="is damaged"):
        read_recordings(path)


def test_files_that_are_not_there_are_refused(tmp_path):
    with pytest.raises(RequestError, match="there is no such file"):
        checksum.known_state(tmp_path / "none.h5")

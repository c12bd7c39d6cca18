"""Contents that an inspection found good are remembered for other processes, and nothing else is."""

import subprocess
import sys

import h5py
import pytest

from magsim.errors import DataError
from magsim.recording import read_recordings
from magsim.storage import hdf5, inspected, inspection
from magsim.storage.checksum import checksum_state
from tests.support.folders import flight


@pytest.fixture
def path(tmp_path, monkeypatch):
    """A file that another process has written, and an empty cache."""
    monkeypatch.setenv("MAGSIM_CACHE", str(tmp_path / "cache"))
    flight("one", [0] * 50).write(tmp_path / "a.h5")
    inspection._RESULTS.clear()
    return tmp_path / "a.h5"


def children(monkeypatch) -> list[str]:
    """Arguments of the inspections from now on."""
    run, started = inspection._child, []
    monkeypatch.setattr(inspection, "_child", lambda words, limit: started.append(words[-1]) or run(words, limit))
    return started


def test_another_process_need_not_inspect_again(path, monkeypatch):
    started = children(monkeypatch)
    read_recordings(path)
    inspection._RESULTS.clear()
    read_recordings(path)
    assert started == [str(path)]
    code = (
        "import sys; from magsim.storage import inspection; from magsim.recording import read_recordings\n"
        "inspection._child = None\n"
        "print(len(read_recordings(sys.argv[1])[0]))"
    )
    done = subprocess.run([sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=True)
    assert done.stdout == "50\n"


def test_what_is_not_good_or_was_only_written_is_inspected(path, monkeypatch):
    with h5py.File(path, "a") as opened:
        opened["x"] = h5py.SoftLink("/flights")
    hdf5.add_checksum(path)
    started = children(monkeypatch)
    for _ in range(2):
        inspection._RESULTS.clear()
        with pytest.raises(DataError, match="has a member 'x' that is a link to elsewhere"):
            read_recordings(path)
    assert started == [str(path)] * 2


def test_another_inspector_starts_anew(path, monkeypatch, tmp_path):
    read_recordings(path)
    digest = checksum_state(path).digest
    assert inspected.was_inspected(digest, inspection.INSPECTOR)
    other = tmp_path / "inspector.py"
    other.write_bytes(inspection.INSPECTOR.read_bytes() + b"# stricter\n")
    assert not inspected.was_inspected(digest, other)
    assert not inspected.was_inspected(digest, tmp_path / "none.py")


def test_a_list_grows_while_it_is_used_and_starts_anew_when_it_is_long(path, monkeypatch):
    monkeypatch.setattr(inspected, "MOST_BYTES", 65 * 4)
    digests = [f"{number:064x}" for number in range(10)]
    own = inspected._list_of(inspection.INSPECTOR)
    for digest in digests:
        assert not inspected.was_inspected(digest, inspection.INSPECTOR)
        inspected.note_inspected(digest, inspection.INSPECTOR)
        assert inspected.was_inspected(digest, inspection.INSPECTOR)
        assert own.stat().st_size <= 65 * 4
    with own.open("ab") as file:
        file.write(f"{'a' * 64}\n{'b' * 30}".encode())
    assert inspected.was_inspected("a" * 64, inspection.INSPECTOR)
    assert not inspected.was_inspected("b" * 64, inspection.INSPECTOR)
    with own.open("ab") as file:
        file.write(f"{'b' * 34}\n".encode())
    assert inspected.was_inspected("b" * 64, inspection.INSPECTOR)


def test_a_cache_that_cannot_be_written_is_not_used(path, monkeypatch):
    path.with_name("cache").write_text("no folder")
    started = children(monkeypatch)
    for _ in range(2):
        inspection._RESULTS.clear()
        read_recordings(path)
    assert len(started) == 2

"""Files are written completely or not at all, and leftovers of killed writers are removed."""

import os
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

from magsim.errors import RequestError
from magsim.storage import atomic_write, check_target
from magsim.storage.parts import remove_leftovers_in


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_file_is_written_and_replaced_only_with_force(tmp_path):
    target = tmp_path / "a.txt"
    atomic_write(target, lambda path: path.write_text("one"))
    with pytest.raises(RequestError, match=r"a\.txt exists already; --force replaces it"):
        atomic_write(target, lambda path: path.write_text("two"))
    assert target.read_text() == "one"
    atomic_write(target, lambda path: path.write_text("two"), force=True)
    assert target.read_text() == "two"
    assert names(tmp_path) == ["a.txt"]


def test_the_temporary_file_has_the_name_of_the_target(tmp_path):
    seen = []
    atomic_write(tmp_path / "a.npz", lambda path: (seen.append(path), np.savez(path, x=1)))
    assert seen[0].name == "a.npz"
    assert seen[0].parent.parent == tmp_path
    assert names(tmp_path) == ["a.npz"]


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt(), ValueError("bug")])
def test_nothing_is_left_behind_when_writing_fails(tmp_path, error):
    old = tmp_path / "a.txt"
    old.write_text("old")

    def write(path: Path) -> None:
        path.write_text("half")
        raise error

    expected = RequestError if isinstance(error, OSError) else type(error)
    with pytest.raises(expected) as caught:
        atomic_write(old, write, force=True)
    assert names(tmp_path) == ["a.txt"]
    assert old.read_text() == "old"
    if isinstance(error, OSError):
        assert str(caught.value) == f"cannot write {old}: No space left on device"


def test_a_file_that_another_program_makes_meanwhile_stays(tmp_path):
    target = tmp_path / "a.txt"

    def write(path: Path) -> None:
        path.write_text("mine")
        target.write_text("theirs")

    with pytest.raises(RequestError, match="exists already"):
        atomic_write(target, write)
    assert target.read_text() == "theirs"
    assert names(tmp_path) == ["a.txt"]


@pytest.mark.parametrize("check", [check_target, lambda path: atomic_write(path, lambda p: p.write_text(""))])
def test_targets_that_cannot_be_written(tmp_path, check):
    with pytest.raises(RequestError, match=r"there is no folder .*/no; make it first"):
        check(tmp_path / "no" / "a.txt")
    with pytest.raises(RequestError, match="it is a folder; give the name of a file"):
        check(tmp_path)
    (tmp_path / "file").write_text("")
    with pytest.raises(RequestError, match="cannot write"):
        check(tmp_path / "file" / "a.txt")
    with pytest.raises(RequestError, match="cannot write"):
        check(tmp_path / ("x" * 300))
    with pytest.raises(RequestError, match="not a regular file"):
        check(Path(os.devnull))
    assert names(tmp_path) == ["file"]


def test_checking_a_target_leaves_nothing(tmp_path):
    check_target(tmp_path / "a.txt")
    assert names(tmp_path) == []


def test_permissions_follow_the_umask(tmp_path):
    code = (
        "import os, pathlib; os.umask(0o027)\n"
        "from magsim.storage import atomic_write\n"
        "atomic_write(pathlib.Path('a'), lambda p: p.write_text('x'))"
    )
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True)
    assert (tmp_path / "a").stat().st_mode & 0o777 == 0o640


WRITER = """
import pathlib, sys, time
from magsim.storage import atomic_write

def write(path):
    path.write_text("half")
    print("writing", flush=True)
    time.sleep(60)

atomic_write(pathlib.Path(sys.argv[1]), write, force=True)
"""


@pytest.fixture
def writing(tmp_path):
    """Start processes that are in the middle of writing a file until they are killed."""
    running = []

    def start(name: str) -> subprocess.Popen:
        arguments = [sys.executable, "-c", WRITER, str(tmp_path / name)]
        process = subprocess.Popen(arguments, stdout=subprocess.PIPE, text=True)
        running.append(process)
        assert process.stdout.readline() == "writing\n"
        return process

    yield start
    for process in running:
        process.kill()
        process.communicate()


def test_leftovers_of_a_killed_writer_are_removed_by_the_next_one_of_the_same_target(tmp_path, writing):
    dead, other, alive = writing("a.h5"), writing("b.h5"), writing("a.h5")
    for process in (dead, other):
        process.kill()
        process.wait()
    (tmp_path / ".mine.part").mkdir()
    assert [name[-5:] for name in names(tmp_path)] == [".part"] * 4
    check_target(tmp_path / "a.h5")
    assert len(names(tmp_path)) == 4
    atomic_write(tmp_path / "a.h5", lambda path: path.write_text("whole"))
    # Still there: the folder of the living writer, that of another target, and one that is not ours.
    left = [name for name in names(tmp_path) if name.endswith(".part")]
    assert len(left) == 3
    assert [f.read_text() for name in left for f in (tmp_path / name).iterdir()] == ["half", "half"]
    assert alive.poll() is None
    alive.kill()
    alive.wait()
    atomic_write(tmp_path / "a.h5", lambda path: path.write_text("again"), force=True)
    atomic_write(tmp_path / "b.h5", lambda path: path.write_text("whole"))
    assert names(tmp_path) == [".mine.part", "a.h5", "b.h5"]


def test_a_leftover_with_a_foreign_file_stays(tmp_path, writing):
    dead = writing("a.txt")
    dead.kill()
    dead.wait()
    (left,) = tmp_path.iterdir()
    (left / "theirs").write_text("x")
    atomic_write(tmp_path / "a.txt", lambda path: path.write_text("whole"))
    assert names(tmp_path) == [left.name, "a.txt"]
    assert names(left) == ["a.txt", "theirs"]


def test_leftovers_of_files_whose_names_match_are_removed(tmp_path, writing):
    processes = {name: writing(name) for name in ("step_1.pt", "step_2.pt", "best.pt", "step_3.pt")}
    for name in ("step_1.pt", "best.pt", "step_3.pt"):
        processes[name].kill()
        processes[name].wait()
    for part in tmp_path.iterdir():
        if "step_3.pt" in names(part):
            (part / "theirs").write_text("x")
    (tmp_path / ".mine.part").mkdir()
    remove_leftovers_in(tmp_path, "step_*")
    left = [names(tmp_path / name) for name in names(tmp_path)]
    assert sorted(left) == [[], ["best.pt"], ["step_2.pt"], ["step_3.pt", "theirs"]]


def test_simultaneous_writers_of_one_target_do_not_remove_each_others_folders(tmp_path):
    target, failures = tmp_path / "a.txt", []

    def run() -> None:
        try:
            for _ in range(200):
                atomic_write(target, lambda path: path.write_text("whole"), force=True)
        except Exception as error:
            failures.append(error)

    threads = [threading.Thread(target=run) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert failures == []
    assert names(tmp_path) == ["a.txt"]

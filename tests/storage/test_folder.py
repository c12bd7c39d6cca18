"""Folders are written completely or not at all."""

import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from magsim.errors import RequestError
from magsim.storage import atomic_folder, check_folder_target
from tests.support.paths import ROOT


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def fill(text: str):
    def write(folder: Path) -> None:
        (folder / "a.txt").write_text(text)
        (folder / "b.txt").write_text(text)

    return write


def test_a_folder_is_written_and_replaced_only_with_force(tmp_path):
    target = tmp_path / "around" / "set"
    atomic_folder(target, fill("one"))
    with pytest.raises(RequestError, match="set exists already; --force replaces it"):
        atomic_folder(target, fill("two"))
    assert (target / "a.txt").read_text() == "one"
    (target / "old.txt").write_text("old")
    atomic_folder(target, fill("two"), force=True)
    assert names(target) == ["a.txt", "b.txt"]
    assert (target / "b.txt").read_text() == "two"
    assert names(target.parent) == ["set"]


def test_an_empty_folder_is_no_obstacle(tmp_path):
    (tmp_path / "set").mkdir()
    atomic_folder(tmp_path / "set", fill("one"))
    assert names(tmp_path / "set") == ["a.txt", "b.txt"]


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt(), ValueError("bug")])
def test_nothing_is_left_behind_when_writing_fails(tmp_path, error):
    target = tmp_path / "set"
    atomic_folder(target, fill("old"))

    def write(folder: Path) -> None:
        (folder / "a.txt").write_text("half")
        raise error

    expected = RequestError if isinstance(error, OSError) else type(error)
    with pytest.raises(expected) as caught:
        atomic_folder(target, write, force=True)
    assert names(tmp_path) == ["set"]
    assert (target / "a.txt").read_text() == "old"
    if isinstance(error, OSError):
        assert str(caught.value) == f"cannot write {target}: No space left on device"


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("file", "it is not a folder"),
        ("link", "it is not a folder"),
        ("file/set", "cannot write "),
        ("a\0b", "cannot write "),
        ("x" * 300, "cannot write "),
    ],
)
def test_targets_that_cannot_be_written(tmp_path, path, text):
    (tmp_path / "file").write_text("")
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "real")
    before = names(tmp_path)
    with pytest.raises(RequestError, match=text):
        check_folder_target(tmp_path / path, force=True)
    assert names(tmp_path) == before


def test_leftovers_of_a_killed_writer_are_removed_and_the_folder_of_a_living_one_is_not(tmp_path):
    code = (
        "import sys, time; from pathlib import Path; from magsim.storage import atomic_folder\n"
        "def write(folder):\n"
        "    (folder / 'a.txt').write_text('half'); print('go', flush=True); time.sleep(60)\n"
        "atomic_folder(Path(sys.argv[1]), write)"
    )
    target = tmp_path / "set"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    writers = [
        subprocess.Popen([sys.executable, "-c", code, str(target)], stdout=subprocess.PIPE, env=environment)
        for _ in range(2)
    ]
    for writer in writers:
        writer.stdout.readline()
    assert len(names(tmp_path)) == 2
    writers[0].kill()
    writers[0].wait()
    atomic_folder(target, fill("whole"))
    left = [name for name in names(tmp_path) if name != "set"]
    assert len(left) == 1
    assert left[0].endswith(".part")
    writers[1].kill()
    writers[1].wait()
    atomic_folder(target, fill("again"), force=True)
    assert names(tmp_path) == ["set"]
    for writer in writers:
        writer.stdout.close()


def test_the_previous_folder_comes_back_if_a_writer_is_killed_between_two_renames(tmp_path, monkeypatch):
    target = tmp_path / "set"
    atomic_folder(target, fill("old"))
    code = (
        "import os, sys; from pathlib import Path; from magsim.storage import atomic_folder, folder\n"
        "rename, calls = Path.rename, []\n"
        "def die(self, other):\n"
        "    calls.append(other)\n"
        "    os._exit(9) if len(calls) == 2 else rename(self, other)\n"
        "Path.rename = die\n"
        "atomic_folder(Path(sys.argv[1]), lambda f: (f / 'a.txt').write_text('new'), force=True)"
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    killed = subprocess.run([sys.executable, "-c", code, str(target)], env=environment, check=False)
    assert killed.returncode == 9
    assert not target.exists()
    check_folder_target(target, force=True)
    assert (target / "a.txt").read_text() == "old"
    assert names(tmp_path) == ["set"]


def test_a_killed_writer_leaves_no_target_or_a_complete_one(tmp_path):
    code = (
        "import sys; from pathlib import Path; from magsim.storage import atomic_folder\n"
        "def write(folder):\n"
        "    for i in range(20): (folder / f'{i}.txt').write_text('x' * 10000)\n"
        "print('go', flush=True)\n"
        "for i in range(100000): atomic_folder(Path(sys.argv[1]), write, force=True)"
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    target = tmp_path / "set"
    for wait_s in np.random.default_rng(7).uniform(0.0, 0.2, 4):
        command = [sys.executable, "-c", code, str(target)]
        writer = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE)
        writer.stdout.readline()
        time.sleep(wait_s)
        writer.kill()
        writer.wait()
        writer.stdout.close()
        if target.exists():
            assert len(names(target)) == 20
            assert all(path.stat().st_size == 10000 for path in target.iterdir())

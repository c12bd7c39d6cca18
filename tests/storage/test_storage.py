"""Files whole or not at all; results found again; HDF5 from outside."""

import os
import subprocess
import sys
import threading
from pathlib import Path

import h5py
import numpy as np
import pytest

from magsim.errors import DataError, RequestError
from magsim.storage import atomic_write, cache_folder, cached, check_target, hdf5, vetting


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


def test_a_file_that_comes_up_meanwhile_stays(tmp_path):
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
    """Processes that are in the middle of writing a file, and do not end by themselves."""
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


def test_what_a_killed_writer_left_is_removed_by_the_next_one_of_the_same_target(tmp_path, writing):
    dead, other, alive = writing("a.h5"), writing("b.h5"), writing("a.h5")
    for process in (dead, other):
        process.kill()
        process.wait()
    (tmp_path / ".mine.part").mkdir()
    assert [name[-5:] for name in names(tmp_path)] == [".part"] * 4
    check_target(tmp_path / "a.h5")
    assert len(names(tmp_path)) == 4
    atomic_write(tmp_path / "a.h5", lambda path: path.write_text("whole"))
    # What is left: the folder of the writer that lives, that of another target, and one that is not ours.
    left = [name for name in names(tmp_path) if name.endswith(".part")]
    assert len(left) == 3
    assert [f.read_text() for name in left for f in (tmp_path / name).iterdir()] == ["half", "half"]
    assert alive.poll() is None
    alive.kill()
    alive.wait()
    atomic_write(tmp_path / "a.h5", lambda path: path.write_text("again"), force=True)
    atomic_write(tmp_path / "b.h5", lambda path: path.write_text("whole"))
    assert names(tmp_path) == [".mine.part", "a.h5", "b.h5"]


def test_a_leftover_with_a_file_of_somebody_else_stays(tmp_path, writing):
    dead = writing("a.txt")
    dead.kill()
    dead.wait()
    (left,) = tmp_path.iterdir()
    (left / "theirs").write_text("x")
    atomic_write(tmp_path / "a.txt", lambda path: path.write_text("whole"))
    assert names(tmp_path) == [left.name, "a.txt"]
    assert names(left) == ["a.txt", "theirs"]


def test_writers_of_one_target_at_the_same_time_do_not_sweep_each_other(tmp_path):
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


# --- cache -----------------------------------------------------------------------------------------------------


@pytest.fixture
def cache(tmp_path, monkeypatch) -> Path:
    folder = tmp_path / "cache"
    monkeypatch.setenv("MAGSIM_CACHE", str(folder))
    return folder


class Maker:
    """Counts how often it makes."""

    def __init__(self, **arrays: np.ndarray) -> None:
        self.arrays = arrays or {"x": np.array([[1.0, np.nan, -0.0]]), "n": np.array(7), "e": np.zeros((0, 3))}
        self.calls = 0

    def __call__(self) -> dict[str, np.ndarray]:
        self.calls += 1
        return dict(self.arrays)


def same(a: dict[str, np.ndarray], b: dict[str, np.ndarray]) -> bool:
    return set(a) == set(b) and all(
        a[k].dtype == b[k].dtype and a[k].shape == b[k].shape and a[k].tobytes() == b[k].tobytes() for k in a
    )


def test_the_same_key_is_made_once_and_gives_the_same_bits(cache):
    make = Maker()
    first = cached("part", {"a": 1, "b": [1.5, "x"], "c": np.arange(3)}, make)
    again = cached("part", {"c": np.arange(3), "b": [1.5, "x"], "a": 1}, make)
    assert make.calls == 1
    assert same(first, again)
    assert not any(array.flags.writeable for array in [*first.values(), *again.values()])


@pytest.mark.parametrize("other", [("part", {"a": 2}), ("other", {"a": 1}), ("part", "a")])
def test_another_key_or_kind_is_made_anew(cache, other):
    make = Maker()
    cached("part", {"a": 1}, make)
    cached(*other, make)
    assert make.calls == 2


def test_changing_the_result_of_make_later_changes_nothing(cache):
    array = np.ones(3)
    first = cached("part", "k", lambda: {"x": array})
    array[:] = 5.0
    assert first["x"].tolist() == [1.0, 1.0, 1.0]
    assert cached("part", "k", Maker())["x"].tolist() == [1.0, 1.0, 1.0]


def test_any_damage_is_met_by_making_anew(cache):
    make = Maker()
    first = cached("part", "k", make)
    (entry,) = cache.rglob("*.npz")
    good = entry.read_bytes()
    rng = np.random.default_rng(5)
    bad = [b"", good[:-20], b"not a zip file", good[:100]]
    for _ in range(40):
        data = bytearray(good)
        data[rng.integers(len(data))] ^= int(rng.integers(1, 256))
        bad.append(bytes(data))
    for data in bad:
        entry.write_bytes(data)
        assert same(cached("part", "k", make), first)


def test_an_entry_with_swapped_content_is_not_believed(cache):
    make = Maker(x=np.ones(4))
    cached("part", "k", make)
    (entry,) = cache.rglob("*.npz")
    with np.load(entry) as kept:
        np.savez(entry, checksum=kept["checksum"], x=np.zeros(4))
    assert cached("part", "k", make)["x"].tolist() == [1.0] * 4
    assert make.calls == 2


def test_pickles_in_the_cache_are_never_loaded(cache, tmp_path):
    class Trap:
        def __reduce__(self) -> tuple:
            return (os.mkdir, (str(tmp_path / "trapped"),))

    make = Maker(x=np.ones(2))
    cached("part", "k", make)
    (entry,) = cache.rglob("*.npz")
    np.savez(entry, x=np.array([Trap()], dtype=object))
    assert cached("part", "k", make)["x"].tolist() == [1.0, 1.0]
    assert not (tmp_path / "trapped").exists()


def test_a_cache_that_cannot_be_written_to_is_not_used(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("MAGSIM_CACHE", str(tmp_path / "file" / "cache"))
    make = Maker()
    assert same(cached("part", "k", make), cached("part", "k", make))
    assert make.calls == 2


def test_where_the_cache_is(monkeypatch, tmp_path):
    monkeypatch.setenv("MAGSIM_CACHE", str(tmp_path / "own"))
    assert cache_folder() == tmp_path / "own"
    monkeypatch.delenv("MAGSIM_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_folder() == tmp_path / "magsim"
    monkeypatch.setenv("XDG_CACHE_HOME", "relative/is/no/good")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert cache_folder() == tmp_path / "home" / ".cache" / "magsim"


def test_writers_at_the_same_time_do_not_disturb_each_other(cache):
    results: list[dict[str, np.ndarray]] = []

    def run() -> None:
        results.extend(cached("part", "k", Maker(x=np.arange(20_000.0))) for _ in range(5))

    threads = [threading.Thread(target=run) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(results) == 20
    assert all(same(result, results[0]) for result in results)
    assert len(list(cache.rglob("*"))) == 2  # the folder of the kind, and one entry


def test_the_cache_does_not_grow_without_end(cache, monkeypatch):
    monkeypatch.setattr("magsim.storage.cache.KEEP", 5)
    for i in range(8):
        cached("part", f"k{i}", Maker(x=np.ones(1)))
    assert len(list(cache.rglob("*.npz"))) == 5
    monkeypatch.setattr("magsim.storage.cache.KEEP_BYTES", 20_000)
    for i in range(4):
        cached("part", f"big{i}", Maker(x=np.ones(1000)))
    assert sum(entry.stat().st_size for entry in cache.rglob("*.npz")) <= 20_000
    make = Maker(x=np.ones(100_000))
    cached("part", "huge", make)
    cached("part", "huge", make)
    assert make.calls == 1


@pytest.mark.parametrize("arrays", [{"x": np.array([object()])}, {"checksum": np.ones(1)}])
def test_what_cannot_be_kept_is_a_mistake_of_the_caller(cache, arrays):
    with pytest.raises(TypeError, match="cannot hold"):
        cached("part", "k", Maker(**arrays))


# --- HDF5 from outside ------------------------------------------------------------------------------------------


def make_file(path: Path, **datasets: object) -> Path:
    with h5py.File(path, "w") as file:
        for name, value in datasets.items():
            file[name] = value
    return path


def refused(path: Path, read: object) -> str:
    with pytest.raises(DataError) as caught, hdf5.open_careful(path) as root:
        read(root)
    text = str(caught.value)
    assert text.startswith(str(path))
    assert "\n" not in text
    return text


def test_plain_things_are_read(tmp_path):
    path = make_file(tmp_path / "a.h5", x=np.arange(6.0).reshape(2, 3))
    hdf5.seal(path)
    with hdf5.open_careful(path) as root:
        assert root.names() == ["x"]
        assert root.array("x", kind="f", ndim=2).tolist() == [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]


def test_links_out_of_the_file_are_refused(tmp_path):
    secret = make_file(tmp_path / "secret.h5", x=np.ones(3))
    for number, link in enumerate([h5py.ExternalLink(str(secret), "x"), h5py.SoftLink("/y")]):
        path = make_file(tmp_path / f"{number}.h5", y=np.ones(3))
        with h5py.File(path, "a") as file:
            file["x"] = link
        assert "link to elsewhere" in refused(path, lambda root: root.array("x", kind="f", ndim=1))


def test_values_kept_in_other_files_are_refused(tmp_path):
    (tmp_path / "secret.txt").write_bytes(b"12345678" * 4)
    path = tmp_path / "external.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("x", shape=(4,), dtype="f8", external=[(str(tmp_path / "secret.txt"), 0, 32)])
        layout = h5py.VirtualLayout(shape=(3,), dtype="f8")
        layout[:] = h5py.VirtualSource(str(make_file(tmp_path / "s.h5", v=np.ones(3))), "v", shape=(3,))
        file.create_virtual_dataset("v", layout)
    for name in ("x", "v"):
        assert "in another file" in refused(path, lambda root, name=name: root.array(name, kind="f", ndim=1))


def test_a_small_file_that_claims_terabytes_is_refused(tmp_path):
    path = tmp_path / "bomb.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("x", shape=(2**40,), dtype="f8", chunks=(2**20,))
    assert "claims 8796093022208 bytes" in refused(path, lambda root: root.array("x", kind="f", ndim=1))


def test_filters_are_on_a_list(tmp_path):
    path = tmp_path / "f.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("good", data=np.arange(100.0), compression="gzip", shuffle=True)
    with hdf5.open_careful(path) as root:
        assert root.array("good", kind="f", ndim=1)[99] == 99.0
    with h5py.File(path, "a") as file:
        file.create_dataset("bad", data=np.arange(100.0), compression="lzf")
    assert "packed with filter" in refused(path, lambda root: root.array("bad", kind="f", ndim=1))


def test_odd_names_and_types_are_refused(tmp_path):
    path = make_file(tmp_path / "n.h5", **{"Bad name": np.ones(2), "i": np.arange(3)})
    assert "the name 'Bad name' is not allowed" in refused(path, lambda root: root.names())
    assert "expected 1 of kind 'f'" in refused(path, lambda root: root.array("i", kind="f", ndim=1))
    assert "there is no z" in refused(path, lambda root: root.array("z", kind="f", ndim=1))
    assert "i is not a group" in refused(path, lambda root: root.group("i"))


def test_what_is_no_hdf5_file(tmp_path):
    path = tmp_path / "x.h5"
    path.write_bytes(b"")
    assert "is empty" in refused(path, lambda _: None)
    path.write_text("hello, this is text")
    assert "is not an HDF5 file" in refused(path, lambda _: None)
    with pytest.raises(RequestError, match="there is no such file"), hdf5.open_careful(tmp_path / "no.h5"):
        pass
    with pytest.raises(RequestError, match="is a folder"), hdf5.open_careful(tmp_path):
        pass


def test_a_broken_seal_is_told(tmp_path):
    path = make_file(tmp_path / "s.h5", x=np.zeros(1000))
    hdf5.seal(path)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    assert "bytes are not those that were written" in refused(path, lambda _: None)


def test_a_program_that_crashes_or_hangs_over_a_file_does_so_alone(tmp_path, monkeypatch):
    path = make_file(tmp_path / "x.h5", x=np.ones(3))
    program = tmp_path / "vet.py"
    monkeypatch.setattr(vetting, "VET_PROGRAM", program)
    program.write_text("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")
    assert "breaks down" in refused(path, lambda _: None)
    program.write_text("import time; time.sleep(60)")
    monkeypatch.setattr(vetting, "VET_TIMEOUT_S", 0.3)
    path = make_file(tmp_path / "x.h5", y=np.ones(3))
    assert "does not come to an end" in refused(path, lambda _: None)

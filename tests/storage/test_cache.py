"""Results that were computed before are found again, and never a wrong one."""

import os
import threading
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from magsim.storage import cache as caching
from magsim.storage import cache_folder, cached, kept, reported


@pytest.fixture
def cache(tmp_path, monkeypatch) -> Path:
    folder = tmp_path / "cache"
    monkeypatch.setenv("MAGSIM_CACHE", str(folder))
    return folder


class Maker:
    """A function that counts its calls."""

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


def test_the_same_key_is_computed_once_and_returns_the_same_bits(cache):
    make = Maker()
    first = cached("part", {"a": 1, "b": [1.5, "x"], "c": np.arange(3)}, make)
    again = cached("part", {"c": np.arange(3), "b": [1.5, "x"], "a": 1}, make)
    assert make.calls == 1
    assert same(first, again)
    assert not any(array.flags.writeable for array in [*first.values(), *again.values()])


def test_what_is_computed_is_reported_and_what_is_known_is_not(cache):
    told: list[tuple[str, float]] = []

    def outer() -> dict[str, np.ndarray]:
        return cached("inner", "k", Maker())

    cached("before", "k", Maker())
    with reported(lambda kind, share: told.append((kind, share))):
        cached("outer", "k", outer)
        cached("outer", "k", outer)
        cached("before", "k", Maker())
    cached("after", "k", Maker())
    assert told == [("outer", 0.0), ("inner", 0.0), ("inner", 1.0), ("outer", 1.0)]


@pytest.mark.parametrize("other", [("part", {"a": 2}), ("other", {"a": 1}), ("part", "a")])
def test_another_key_or_kind_is_computed(cache, other):
    make = Maker()
    cached("part", {"a": 1}, make)
    cached(*other, make)
    assert make.calls == 2


def test_changing_the_returned_array_later_changes_nothing(cache):
    array = np.ones(3)
    first = cached("part", "k", lambda: {"x": array})
    array[:] = 5.0
    assert first["x"].tolist() == [1.0, 1.0, 1.0]
    assert cached("part", "k", Maker())["x"].tolist() == [1.0, 1.0, 1.0]


def test_a_damaged_entry_is_computed_again(cache):
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


def test_an_entry_with_other_content_is_not_used(cache):
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


def test_the_folder_of_the_cache(monkeypatch, tmp_path):
    monkeypatch.setenv("MAGSIM_CACHE", str(tmp_path / "own"))
    assert cache_folder() == tmp_path / "own"
    monkeypatch.delenv("MAGSIM_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_folder() == tmp_path / "magsim"
    monkeypatch.setenv("XDG_CACHE_HOME", "relative/is/no/good")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert cache_folder() == tmp_path / "home" / ".cache" / "magsim"


def test_simultaneous_writers_do_not_disturb_each_other(cache):
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


def test_what_is_used_again_and_again_stays(cache, monkeypatch):
    monkeypatch.setattr("magsim.storage.cache.KEEP", 5)
    make = Maker(x=np.ones(1))
    for i in range(20):
        cached("part", "often", make)
        cached("part", f"once{i}", Maker(x=np.ones(1)))
    assert make.calls == 1


@pytest.mark.parametrize("arrays", [{"x": np.array([object()])}, {"checksum": np.ones(1)}])
def test_a_result_that_cannot_be_stored_raises(cache, arrays):
    with pytest.raises(TypeError, match="cannot hold"):
        cached("part", "k", Maker(**arrays))


def made_by(module: str) -> Maker:
    """A maker that belongs to a module."""
    return type("Made", (Maker,), {"__module__": module})()


def test_a_changed_source_is_computed_again(cache, monkeypatch):
    """The digest of the module that the maker belongs to, through ``functools.partial`` too."""
    digests = {"magsim.field.steel": "a", "magsim.field.skin": "b"}
    monkeypatch.setattr(caching, "source_digest", digests.get)
    steel, skin = made_by("magsim.field.steel"), made_by("magsim.field.skin")
    for make in (steel, steel, partial(steel)):
        cached("part", "k", make)
    cached("part", "k", skin)
    assert (steel.calls, skin.calls) == (1, 1)
    digests["magsim.field.steel"] = "changed"
    cached("part", "k", steel)
    cached("part", "k", skin)
    assert (steel.calls, skin.calls) == (2, 1)


@pytest.mark.parametrize("name", ["numpy", "scipy", "numba", "llvmlite", "jsbsim", "processor_features", "python"])
def test_another_library_or_machine_is_computed_again(cache, monkeypatch, name):
    make, real = Maker(), caching.kind_of_machine()
    cached("part", "k", make)
    monkeypatch.setattr(caching, "kind_of_machine", lambda: real | {name: "another"})
    cached("part", "k", make)
    assert make.calls == 2


def test_the_last_results_of_a_kind_stay_in_memory(cache, tmp_path, monkeypatch):
    makers = [Maker(x=np.array([float(k)])) for k in range(caching.RECENT + 1)]
    first = kept("thing", "0", makers[0])
    for file in (cache / "thing").iterdir():
        file.unlink()
    assert same(kept("thing", "0", makers[0]), first)
    assert makers[0].calls == 1  # neither computed nor read again
    with pytest.raises(ValueError, match="read-only"):
        first["x"][0] = 5.0
    for k, maker in enumerate(makers):
        kept("thing", str(k), maker)
    assert len(caching._recent["thing"]) == caching.RECENT
    for file in (cache / "thing").iterdir():
        file.unlink()
    kept("thing", "0", makers[0])
    assert makers[0].calls == 2  # it had gone
    monkeypatch.setenv("MAGSIM_CACHE", str(tmp_path / "other"))
    kept("thing", "0", makers[0])
    assert makers[0].calls == 3  # another folder is another cache

"""Checkpoints: whole pairs of files, of one run alone."""

import json

import pytest
import torch
from safetensors.torch import load_file, save_file

from magsim.errors import DataError, RequestError
from magsim.training import Checkpoint

WEIGHTS = {"a": torch.arange(3.0), "b.c": torch.ones(2, 2)}
BEST = {"a": torch.zeros(3), "b.c": torch.zeros(2, 2)}
STATE = {"number": 3, "words": ["x"], "tensor": torch.arange(4)}


def save(folder, step, identity="one"):
    Checkpoint(folder, identity).save(step, WEIGHTS, BEST, STATE)


def test_what_was_saved_is_loaded(tmp_path):
    save(tmp_path / "new" / "run", 40)
    found = Checkpoint(tmp_path / "new" / "run", "one").load()
    assert found.step == 40
    torch.testing.assert_close(found.weights, WEIGHTS, rtol=0, atol=0)
    torch.testing.assert_close(found.best, BEST, rtol=0, atol=0)
    assert (found.state["number"], found.state["words"]) == (3, ["x"])
    assert torch.equal(found.state["tensor"], STATE["tensor"])


def test_an_empty_or_missing_folder_holds_none(tmp_path):
    assert Checkpoint(tmp_path, "one").load() is None
    assert Checkpoint(tmp_path / "nothing", "one").load() is None


def test_older_states_are_removed(tmp_path):
    for step in (10, 20, 30):
        save(tmp_path, step)
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"step_00000030.pt", "step_00000030.safetensors", "best.safetensors"}


def test_a_half_written_pair_is_passed_over(tmp_path):
    save(tmp_path, 20)
    for name in ("step_00000099.pt", "step_00000098.safetensors", "step_x.safetensors"):
        (tmp_path / name).write_bytes(b"x")
    assert Checkpoint(tmp_path, "one").load().step == 20


def test_states_of_another_run_are_refused(tmp_path):
    save(tmp_path, 20, "other")
    with pytest.raises(RequestError, match="belongs to a run with other settings or other recordings"):
        Checkpoint(tmp_path, "one").load()


def test_the_best_weights_have_a_file_of_their_own(tmp_path):
    checkpoint = Checkpoint(tmp_path, "one")
    better = {name: tensor + 1.0 for name, tensor in BEST.items()}
    for best in (BEST, better, better):
        checkpoint.save(10, WEIGHTS, best, STATE)
        torch.testing.assert_close(load_file(tmp_path / "best.safetensors"), best, rtol=0, atol=0)


def test_weights_that_were_changed_on_the_disk_are_refused(tmp_path):
    """The format has no checksum of its own."""
    save(tmp_path, 20)
    path = tmp_path / "step_00000020.safetensors"
    data = bytearray(path.read_bytes())
    data[-3] ^= 1
    path.write_bytes(data)
    with pytest.raises(DataError, match=r"step_00000020\.safetensors is broken: the weights are not those that"):
        Checkpoint(tmp_path, "one").load()


@pytest.mark.parametrize(("about", "version"), [({"identity": "one", "step": 20}, "1"), ({"format": 7}, "7")])
def test_files_of_another_format_are_refused(tmp_path, about, version):
    save(tmp_path, 20)
    path = tmp_path / "step_00000020.safetensors"
    save_file(load_file(path), path, {"magsim": json.dumps(about)})
    with pytest.raises(DataError, match=rf"safetensors is of format {version}; this version reads format 2"):
        Checkpoint(tmp_path, "one").load()


def test_a_state_is_due_after_its_time(tmp_path):
    assert not Checkpoint(tmp_path, "one", every_s=1e9).is_due
    assert Checkpoint(tmp_path, "one", every_s=0.0).is_due


@pytest.mark.parametrize("suffix", [".pt", ".safetensors"])
def test_broken_files_are_refused(tmp_path, suffix):
    save(tmp_path, 20)
    path = tmp_path / f"step_00000020{suffix}"
    data = path.read_bytes()
    for broken in (data[:50], b"", b"x" * 100):
        path.write_bytes(broken)
        with pytest.raises(DataError, match=r"checkpoint .* is broken"):
            Checkpoint(tmp_path, "one").load()


class Evil:
    def __reduce__(self):
        return (print, ("run",))


def test_pickled_code_is_not_run(tmp_path, capsys):
    save(tmp_path, 20)
    torch.save({"x": Evil()}, tmp_path / "step_00000020.pt")
    with pytest.raises(DataError, match="is broken: it holds other things than tensors and plain values"):
        Checkpoint(tmp_path, "one").load()
    assert capsys.readouterr().out == ""

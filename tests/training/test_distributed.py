"""Data parallel training: two processes of torchrun against one."""

import json
import subprocess
import sys

import numpy as np
import pytest
import torch
from safetensors.torch import load_file

from magsim.errors import RequestError
from magsim.training import distributed
from tests.support.tiny_training import EVERY, STEPS, network, tiny_training


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """What two processes leave, with the losses added and with their conflicts removed."""
    folder = tmp_path_factory.mktemp("two")
    torchrun = ["torch.distributed.run", "--standalone", "--nproc-per-node=2", "-m"]
    command = [sys.executable, "-m", *torchrun, "tests.support.tiny_training", "-", str(folder / "end"), "0"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    (folder / "out").write_text(done.stdout)
    return folder


@pytest.mark.parametrize("surgery", [False, True])
def test_two_processes_have_the_losses_of_one(folder, surgery):
    alone = network()
    outcome = tiny_training(alone, surgery=surgery)
    first, second = (folder / f"end.{surgery}.{rank}" for rank in (0, 1))
    histories = [json.loads(path.with_name(f"{path.name}.json").read_text()) for path in (first, second)]
    np.testing.assert_equal(*histories)
    np.testing.assert_allclose(histories[0], outcome.history, rtol=1e-6, atol=1e-6)
    assert outcome.best_value < 0.9 * outcome.history[0][2]
    assert first.read_bytes() == second.read_bytes()
    torch.testing.assert_close(load_file(first), dict(alone.state_dict()), rtol=1e-4, atol=1e-5)


def test_one_process_shows_progress(folder):
    assert list(map(int, (folder / "out").read_text().split())) == 2 * list(range(0, STEPS + 1, EVERY))


def test_alone_nothing_is_shared():
    assert (distributed.size(), distributed.rank(), distributed.local_rank()) == (1, 0, 0)
    assert distributed.share(5) == slice(0, 5)
    assert distributed.agreed(3.0) == 3.0
    tensor = torch.ones(2)
    distributed.average([tensor])
    assert tensor.tolist() == [1.0, 1.0]


def test_a_batch_is_shared_equally(monkeypatch):
    for name, value in {"RANK": "2", "WORLD_SIZE": "4", "MASTER_ADDR": "here"}.items():
        monkeypatch.setenv(name, value)
    assert distributed.share(16) == slice(8, 12)
    with pytest.raises(RequestError, match="a batch of 18 windows cannot be shared equally among 4 processes"):
        distributed.share(18)

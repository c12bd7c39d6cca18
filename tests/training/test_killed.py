"""Training that is killed, in a process of its own, and continued."""

import os
import signal
import subprocess
import sys

import torch

from magsim.training import Checkpoint
from tests.support.tiny_training import EVERY, STEPS, network, tiny_training


def test_a_killed_training_ends_with_the_same_weights(tmp_path):
    whole = network()
    expected = tiny_training(whole)
    command = [sys.executable, "-m", "tests.support.tiny_training", str(tmp_path / "state"), "-", "0.02"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        for line in process.stdout:
            if int(line) == 3 * EVERY:
                os.kill(process.pid, signal.SIGKILL)
        assert process.wait() == -signal.SIGKILL
    reached = Checkpoint(tmp_path / "state", "tiny").load().step
    assert 3 * EVERY <= reached < STEPS
    resumed = network()
    torch.nn.init.zeros_(resumed[1].weight)  # what it starts from does not matter
    outcome = tiny_training(resumed, checkpoint=Checkpoint(tmp_path / "state", "tiny"))
    assert repr(outcome) == repr(expected)
    for name, tensor in whole.state_dict().items():
        assert torch.equal(resumed.state_dict()[name], tensor)

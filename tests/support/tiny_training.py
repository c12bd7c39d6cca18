"""A training of seconds for tests that run it in processes of their own: ``python -m tests.support.tiny_training``.

Arguments: folder of the checkpoint or ``-``, file of the result or ``-``, least duration of a step [s].
"""

import json
import sys
import time
from pathlib import Path

import numpy as np
import torch
from safetensors.torch import save_file

from magsim.streams import stream
from magsim.training import ArrayWindows, Checkpoint, Outcome, Plan, RandomBatches, distributed, seeded, train

STEPS, EVERY = 60, 10


def network() -> torch.nn.Module:
    """Return a perceptron of windows of 8 rows of 3 columns."""
    with seeded(3):
        return torch.nn.Sequential(torch.nn.Flatten(), torch.nn.Linear(24, 6), torch.nn.Tanh(), torch.nn.Linear(6, 1))


def tiny_training(
    module: torch.nn.Module, *, checkpoint: Checkpoint | None = None, report=None, least_s: float = 0.0, surgery=False
) -> Outcome:
    """Train on rows of noise; the loss has two parts."""
    random = stream(1, "tests/tiny_training")
    values = random.normal(size=(400, 3))
    truth = np.tanh(values @ [0.5, -1.0, 0.25])[:, None] + np.roll(values[:, :1], 2, axis=0)
    sources = [ArrayWindows([part], rows=8) for part in (values, truth)]
    fixed = [torch.tensor(source.take(np.arange(100)).transpose(0, 2, 1), dtype=torch.float32) for source in sources]

    def losses(network, batch, _step):
        time.sleep(least_s)
        error = network(batch[0])[:, 0] - batch[1][:, 0, -1]
        return [(error**2).mean(), 0.1 * error.abs().mean()]

    def measure(network):
        return float(sum(losses(network, fixed, 0)))

    plan = Plan(STEPS, 0.02, every=EVERY, surgery=surgery)
    batches = RandomBatches(sources, batch=16)
    return train(module, batches, losses, measure, plan, seed=7, progress=report, checkpoint=checkpoint)


def main() -> None:
    """Train with the losses added and, if there is no checkpoint, with their conflicts removed; write the ends."""
    folder, result, least_s = sys.argv[1:4]
    for surgery in (False, True)[: 2 if folder == "-" else 1]:
        module = network()
        outcome = tiny_training(
            module,
            checkpoint=None if folder == "-" else Checkpoint(Path(folder), "tiny"),
            report=lambda progress: print(progress.step, flush=True),
            least_s=float(least_s),
            surgery=surgery,
        )
        if result != "-":
            stem = f"{result}.{surgery}.{distributed.rank()}"
            save_file(module.state_dict(), stem)
            Path(f"{stem}.json").write_text(json.dumps(outcome.history))


if __name__ == "__main__":
    main()

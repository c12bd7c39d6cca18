"""Windows a second of a training of MagTCN: beside the commit called "before", by CPU time on one thread.

Width, kernel, windows, batch and loss are the same: 19 inputs, width 8, windows of 320 rows, 16 a batch, broadband and
in-band error. Each state of the code trains in a process of its own, in turn; the figures are medians over rounds.
"""

import statistics

from tests.benchmarks.rows import Row, at_least, stated
from tests.support import before
from tests.support.paths import ROOT

ROUNDS, STEPS = 5, 30

TIME_TRAINING = """
import json, sys, time
import numpy as np
import torch
from magsim.compensation.networks.losses import band_matrix
from magsim.training import Plan, train
inputs, window, batch, steps, rows = 19, 320, 16, int(sys.argv[1]), 12_000
random = np.random.default_rng(0)
columns = [random.normal(size=(rows, count)).astype(np.float32) for count in (inputs, 1)]
if sys.argv[2] == "before":
    from magsim.compensation.networks.magtcn import MagTCN
    from magsim.training.windows import RandomWindows
    batches = RandomWindows(*([part] for part in columns), length=window, batch=batch)
else:
    from magsim.compensation.networks.modules.magtcn import MagTCN
    from magsim.training import ArrayWindows, RandomBatches
    batches = RandomBatches([ArrayWindows([part], rows=window) for part in columns], batch=batch)
torch.manual_seed(0)
network = MagTCN(inputs, width=8, window=window)
band = torch.tensor(band_matrix(window, 10.0).T, dtype=torch.float32)
def losses(module, data, step):
    error = module(data[0]) - data[1][:, 0]
    return [(error**2).mean() + ((error @ band) ** 2).mean()]
def run(steps):
    train(network, batches, losses, lambda _: 1.0, Plan(steps, every=steps), seed=0)
run(3)
start = time.process_time()
run(steps)
print(json.dumps(steps * batch / (time.process_time() - start)))
"""
"""Windows a second of CPU time, with either state of the code."""


def rows() -> list[Row]:
    """Figures of both states."""
    old, new = [], []
    with before.laid_out() as tree:
        for _ in range(ROUNDS):
            old.append(before.run(tree, TIME_TRAINING, [STEPS, "before"]))
            new.append(before.run(ROOT, TIME_TRAINING, [STEPS, "now"]))
    ratios = [b / a for a, b in zip(old, new, strict=True)]
    return [
        stated("magtcn_windows_per_s_before", statistics.median(old), "1/s"),
        stated("magtcn_windows_per_s", statistics.median(new), "1/s"),
        at_least("magtcn_over_before", statistics.median(ratios), "1", 1.3),
    ]

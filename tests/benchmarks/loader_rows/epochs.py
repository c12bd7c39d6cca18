"""One loader for some epochs, in a process of its own: ``epochs.py KIND FOLDER JSON``; prints figures as JSON.

KIND is ``magsim``, ``streaming``, or ``shards``, which writes what ``streaming`` reads. It imports what its kind needs
alone, since MosaicML Streaming has an environment of its own. Threads of torch are one.
"""

import hashlib
import json
import os
import statistics
import sys
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
import torch


def from_magsim(folder: str, about: dict) -> Iterable:
    """The recordings themselves."""
    from magsim.training import WindowDataset, WindowLoader

    options = {name: about[name] for name in ("rows", "stride", "batch", "inputs", "targets")}
    windows = WindowDataset(folder, splits=None, seed=7, block_mb=about["block_mb"], **options)
    return WindowLoader(windows, workers=about["workers"])


def streaming():
    """The package, which imports torchvision: its wheel is for CUDA, and torch for CPUs alone lacks its operators."""
    for name in ("nms", "qnms"):
        torch.library.define(f"torchvision::{name}", "(Tensor dets, Tensor scores, float iou_threshold) -> Tensor")
    import streaming as package

    return package


def from_streaming(folder: str, about: dict) -> Iterable:
    """Shards of windows that were cut, picked and rounded to float32 before."""
    package = streaming()
    windows = package.StreamingDataset(
        local=folder,
        shuffle=True,
        shuffle_algo="py1br",
        shuffle_block_size=about["shuffled"],
        shuffle_seed=7,
        batch_size=about["batch"],
        num_canonical_nodes=1,
    )
    workers = about["workers"]
    return package.StreamingDataLoader(
        windows, batch_size=about["batch"], num_workers=workers, persistent_workers=workers > 0
    )


def write_shards(folder: str, about: dict) -> None:
    """Write arrays of windows as shards of the size that the package has by default."""
    package = streaming()
    x, y = (np.load(f"{about['arrays']}/{name}.npy", mmap_mode="r", allow_pickle=False) for name in "xy")
    columns = {"x": f"ndarray:float32:{x.shape[1]},{x.shape[2]}", "y": f"ndarray:float32:{y.shape[1]},{y.shape[2]}"}
    with package.MDSWriter(out=folder, columns=columns) as out:
        for inputs, targets in zip(x, y, strict=True):
            out.write({"x": np.ascontiguousarray(inputs), "y": np.ascontiguousarray(targets)})


def pairs(batches: Iterable) -> Iterator[tuple[torch.Tensor, torch.Tensor]]:
    """Inputs and targets of either kind."""
    for batch in batches:
        yield (batch["x"], batch["y"]) if isinstance(batch, dict) else batch


def memory_mb() -> float:
    """Memory of this process and its workers, shared pages shared out among those who use them (PSS) [MB]."""
    own = str(os.getpid())
    total = 0
    for folder in Path("/proc").iterdir():
        try:
            parent = (folder / "stat").read_text().rpartition(")")[2].split()[1] if folder.name.isdigit() else ""
            if own in (folder.name, parent):
                found = (folder / "smaps_rollup").read_text()
                total += next(int(line.split()[1]) for line in found.splitlines() if line.startswith("Pss:"))
        except OSError:
            continue  # it has ended meanwhile
    return total / 1000.0


def measure(loader: Iterable, epochs: int) -> dict:
    """Go through epochs: the first warms up and says which windows there are, some are timed, the last is weighed."""
    torch.set_num_threads(1)
    started = time.perf_counter()
    first_s, seen, shapes = None, [], set()
    for inputs, targets in pairs(loader):
        first_s = first_s or time.perf_counter() - started
        seen.append(torch.cat([inputs.sum(2), targets.sum(2)], 1))
        shapes.add((*inputs.shape[1:], *targets.shape[1:], str(inputs.dtype)))
    rows = np.concatenate([part.numpy() for part in seen])
    digest = hashlib.sha256(rows[np.lexsort(rows.T)].tobytes()).hexdigest()
    windows = len(rows)
    del seen, rows
    rates, weights_mb = [], []
    for _ in range(epochs):
        count, start = 0, time.perf_counter()
        for inputs, _targets in pairs(loader):
            count += len(inputs)
        rates.append(count / (time.perf_counter() - start))
    for number, _ in enumerate(pairs(loader)):
        if number % 5 == 0:
            weights_mb.append(memory_mb())
    figures = {"first_s": first_s, "rates": rates, "memory_mb": statistics.median(weights_mb)}
    return {"windows": windows, "digest": digest, "shapes": sorted(shapes), **figures}


def main() -> None:
    """Measure one kind."""
    kind, folder, text = sys.argv[1:]
    about = json.loads(text)
    if kind == "shards":
        write_shards(folder, about)
    else:
        loader = (from_magsim if kind == "magsim" else from_streaming)(folder, about)
        sys.stdout.write(json.dumps(measure(loader, about["epochs"])) + "\n")


if __name__ == "__main__":
    main()

"""Same seed, same weights: what torch needs for it, set for a while and put back."""

from collections.abc import Iterator
from contextlib import contextmanager

import torch


@contextmanager
def reproducible(threads: int = 1) -> Iterator[None]:
    """Deterministic algorithms and a fixed number of threads while the block runs.

    Sums are split among threads, so another number of threads gives other last bits.
    """
    before = torch.get_num_threads(), torch.are_deterministic_algorithms_enabled()
    torch.set_num_threads(threads)
    torch.use_deterministic_algorithms(True)
    try:
        yield
    finally:
        torch.set_num_threads(before[0])
        torch.use_deterministic_algorithms(before[1])


@contextmanager
def seeded(seed: int) -> Iterator[None]:
    """Torch's global generator started from ``seed`` inside the block, and untouched outside: for start weights."""
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        yield

"""Same seed, same weights: what torch needs for it, set for a while and put back."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

import torch
from torch.utils import deterministic as _manners


@contextmanager
def reproducible(threads: int = 1, *, deterministic: bool = True) -> Iterator[None]:
    """Deterministic algorithms and a fixed number of threads while the block runs.

    Sums are split among threads, so another number of threads gives other last bits.

    Parameters
    ----------
    threads : int
        CPU threads of torch.
    deterministic : bool
        Refuse algorithms that give other bits each time, which some have on CUDA.
    """
    before = torch.get_num_threads(), torch.are_deterministic_algorithms_enabled()
    filled = _manners.fill_uninitialized_memory  # type: ignore[attr-defined]
    if deterministic and torch.cuda.is_available():
        # cuBLAS sums in an order that depends on its workspace; it reads this when a process first uses it
        os.environ.setdefault("CUBLAS_WORKSPACE_CONFIG", ":4096:8")
    torch.set_num_threads(threads)
    torch.use_deterministic_algorithms(deterministic)
    # torch would also fill all new memory, which takes a sixth of a training and changes nothing that is written
    _manners.fill_uninitialized_memory = False  # type: ignore[attr-defined]
    try:
        yield
    finally:
        torch.set_num_threads(before[0])
        torch.use_deterministic_algorithms(before[1])
        _manners.fill_uninitialized_memory = filled  # type: ignore[attr-defined]


@contextmanager
def seeded(seed: int, device: torch.device | None = None) -> Iterator[None]:
    """Torch's global generators started from ``seed`` inside the block, and untouched outside: for start weights.

    Those of the CPU and, if it is one, of a CUDA device.
    """
    with torch.random.fork_rng(devices=[device] if device is not None and device.type == "cuda" else []):
        torch.manual_seed(seed)
        yield


def generator_states(device: torch.device) -> list[torch.Tensor]:
    """Return the states of torch's global generators that a training on a device draws from."""
    states = [torch.get_rng_state()]
    return [*states, torch.cuda.get_rng_state(device)] if device.type == "cuda" else states


def set_generator_states(states: list[torch.Tensor], device: torch.device) -> None:
    """Take back what ``generator_states`` returned; a state of another kind of device leaves that of this one."""
    torch.set_rng_state(states[0])
    if device.type == "cuda" and len(states) > 1:
        torch.cuda.set_rng_state(states[1], device)

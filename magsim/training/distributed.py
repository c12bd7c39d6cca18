"""Data parallel training: the processes that torchrun starts share each batch and average their gradients.

Every process makes the same fit from the same seed; alone the batches are shared, and alone the first process writes
files. Without torchrun there is one process, and all of this does nothing.
"""

import atexit
import os
import sys
from collections.abc import Sequence

import torch
import torch.distributed as processes
from torch import Tensor

from magsim.errors import RequestError


def size() -> int:
    """Return the number of processes."""
    return int(os.environ["WORLD_SIZE"]) if {"RANK", "WORLD_SIZE", "MASTER_ADDR"} <= os.environ.keys() else 1


def rank() -> int:
    """Return the number of this process, from 0."""
    return int(os.environ["RANK"]) if size() > 1 else 0


def local_rank() -> int:
    """Return the number of this process on its machine, which is that of its GPU."""
    return int(os.environ.get("LOCAL_RANK", "0")) if size() > 1 else 0


def join() -> None:
    """Connect the processes, unless they are: by gloo, and by nccl between GPUs."""
    if size() == 1 or processes.is_initialized():
        return
    gpus = torch.cuda.is_available() and processes.is_nccl_available()
    processes.init_process_group("cpu:gloo,cuda:nccl" if gpus else "gloo")
    atexit.register(_leave)


def _leave() -> None:
    """Part from the other processes together with them: one that goes first can end the others' threads in an abort."""
    if getattr(sys, "last_value", None) is None:  # after an error nobody is waited for
        processes.barrier()
    processes.destroy_process_group()


def wait_for_all() -> None:
    """Wait until every process has come here."""
    agreed(0.0)


def agreed(value: float) -> float:
    """Return the value that the first process has."""
    if size() == 1:
        return value
    join()
    told = torch.tensor([value], dtype=torch.float64)
    processes.broadcast(told, 0)
    return float(told)


def average(tensors: Sequence[Tensor]) -> None:
    """Put the mean over the processes into tensors of one device and type."""
    if size() == 1:
        return
    flat = torch.cat([tensor.reshape(-1) for tensor in tensors])
    processes.all_reduce(flat)
    flat /= size()
    for tensor, part in zip(tensors, flat.split([tensor.numel() for tensor in tensors]), strict=True):
        tensor.copy_(part.view_as(tensor))


def share(batch: int) -> slice:
    """Return the part of a batch that is this process's: the same number of windows for each.

    Raises
    ------
    RequestError
        If the batch cannot be divided so.
    """
    if batch % size():
        msg = f"a batch of {batch} windows cannot be shared equally among {size()} processes; allowed: a multiple"
        raise RequestError(msg)
    count = batch // size()
    return slice(rank() * count, (rank() + 1) * count)

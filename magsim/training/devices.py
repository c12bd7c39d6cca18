"""Where a training computes, and how precisely."""

from dataclasses import dataclass
from typing import Literal

import torch
from torch import Tensor, nn

from magsim.errors import RequestError
from magsim.training import distributed


@dataclass(frozen=True)
class Machine:
    """Device, precision and manners of a training.

    Attributes
    ----------
    device : str
        ``cpu``, ``cuda`` (under torchrun the GPU of each process), ``cuda:1``, ..., or ``auto``: ``cuda`` where there
        is one.
    precision : {"float32", "bf16"}
        Of the products of matrices inside the network in training, on CUDA alone. Losses, weights and validations are
        float32 always.
    deterministic : bool
        Refuse algorithms that give other bits each time.
    """

    device: str = "cpu"
    precision: Literal["float32", "bf16"] = "float32"
    deterministic: bool = True


CPU = Machine()


def find_device(name: str) -> torch.device:
    """Return the device of a name.

    Raises
    ------
    RequestError
        If it is not there.
    """
    count = torch.cuda.device_count() if torch.cuda.is_available() else 0
    if name == "cpu" or (name == "auto" and count == 0):
        return torch.device("cpu")
    wanted = f"cuda:{distributed.local_rank()}" if name in {"cuda", "auto"} else name
    there = [f"cuda:{number}" for number in range(count)]
    if wanted not in there:
        reason = "" if torch.version.cuda else "; this torch is built without CUDA"
        msg = f"device {name} asks for {wanted}, which is not there; this machine has {', '.join(['cpu', *there])}"
        raise RequestError(msg + reason)
    if distributed.size() > 1 and name not in {"cuda", "auto"}:
        msg = f"device {name}: each process of torchrun needs a GPU of its own; allowed: cpu, cuda, auto"
        raise RequestError(msg)
    return torch.device(wanted)


class InBfloat16(nn.Module):
    """A network whose products of matrices are computed in bfloat16; its output is float32."""

    def __init__(self, module: nn.Module, device: str) -> None:
        super().__init__()
        self.module, self._device = module, device

    def forward(self, *inputs: Tensor) -> Tensor:
        """Return the output of the network."""
        with torch.autocast(self._device, dtype=torch.bfloat16):
            return self.module(*inputs).float()


def in_precision(module: nn.Module, precision: str, device: torch.device) -> nn.Module:
    """Return what computes as the network in a precision, with the same parameters.

    Raises
    ------
    RequestError
        If the precision does not help there.
    """
    if precision == "float32":
        return module
    if device.type != "cuda":
        msg = f"precision {precision}: on a CPU it is slower than float32 (measured: 2 to 9 times); allowed: on cuda"
        raise RequestError(msg)
    return InBfloat16(module, device.type)

"""Checkpoints of a training run: weights as safetensors, optimizer and generator as tensors, nothing pickled."""

import json
import re
from collections.abc import Mapping
from pathlib import Path
from pickle import UnpicklingError
from typing import Any, NamedTuple

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import load_file, save
from torch import Tensor

from magsim.errors import DataError, RequestError
from magsim.storage import atomic_write

_NAME = re.compile(r"step_(\d{8})\.safetensors")


class Saved(NamedTuple):
    """State of a run after ``step`` steps."""

    step: int
    weights: dict[str, Tensor]
    best: dict[str, Tensor]
    state: dict[str, Any]


class Checkpoint:
    """Folder that holds the last state of one training run.

    Each state is a pair of files of one step, so that a run killed between two writes still leaves a whole pair.

    Parameters
    ----------
    folder : Path
    identity : str
        Digest of settings and data: a state of another run is refused.
    """

    def __init__(self, folder: Path, identity: str) -> None:
        self.folder = Path(folder)
        self.identity = identity

    def save(
        self, step: int, weights: Mapping[str, Tensor], best: Mapping[str, Tensor], state: Mapping[str, Any]
    ) -> None:
        """Write the state after ``step`` steps and remove older ones.

        ``state`` holds tensors, numbers, text and lists and dictionaries of them.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        stem = self.folder / f"step_{step:08d}"
        tensors = {f"last.{name}": tensor.detach().clone() for name, tensor in weights.items()}
        tensors |= {f"best.{name}": tensor.detach().clone() for name, tensor in best.items()}
        about = {"magsim": json.dumps({"identity": self.identity, "step": step}, sort_keys=True)}
        atomic_write(stem.with_suffix(".pt"), lambda path: torch.save(dict(state), path), force=True)
        atomic_write(stem.with_suffix(".safetensors"), lambda path: path.write_bytes(save(tensors, about)), force=True)
        for old in self._steps():
            if old < step:
                for suffix in (".safetensors", ".pt"):
                    (self.folder / f"step_{old:08d}{suffix}").unlink(missing_ok=True)

    def load(self) -> Saved | None:
        """Read the newest state; None where there is none.

        Raises
        ------
        RequestError
            If it belongs to a run with other settings or other data.
        DataError
            If a file is broken.
        """
        steps = self._steps()
        if not steps:
            return None
        stem = self.folder / f"step_{max(steps):08d}"
        try:
            with safe_open(stem.with_suffix(".safetensors"), framework="pt") as file:
                about = json.loads((file.metadata() or {})["magsim"])
            tensors = load_file(stem.with_suffix(".safetensors"))
            state = torch.load(stem.with_suffix(".pt"), weights_only=True)
        except (OSError, ValueError, KeyError, EOFError, RuntimeError, SafetensorError) as error:
            msg = f"checkpoint {stem} is broken: {error}"
            raise DataError(msg) from None
        except UnpicklingError:
            # torch's own message advises to load it without protection
            msg = f"checkpoint {stem} is broken: it holds other things than tensors and plain values"
            raise DataError(msg) from None
        if about["identity"] != self.identity:
            msg = f"checkpoint {self.folder} belongs to a run with other settings or other recordings"
            raise RequestError(msg)
        last, best = ({k.removeprefix(p): v for k, v in tensors.items() if k.startswith(p)} for p in ("last.", "best."))
        return Saved(int(about["step"]), last, best, state)

    def _steps(self) -> list[int]:
        """Return the steps of which both files exist."""
        found = (_NAME.fullmatch(path.name) for path in self.folder.glob("step_*.safetensors"))
        steps = [int(match[1]) for match in found if match]
        return [step for step in steps if (self.folder / f"step_{step:08d}.pt").is_file()]

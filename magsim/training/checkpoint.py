"""Checkpoints of a training run: weights as safetensors, optimizer and generator as tensors, nothing pickled."""

import hashlib
import json
import re
import time
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
from magsim.training import distributed

FORMAT = 2
"""Version of the files."""

BEST = "best.safetensors"
"""The best weights so far under their own names, for whoever wants them before the end."""

_NAME = re.compile(r"step_(\d{8})\.safetensors")


class Saved(NamedTuple):
    """State of a run after ``step`` steps, from the file ``path``."""

    path: Path
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
    every_s : float [s]
        After which a training saves its state between two validations.
    """

    def __init__(self, folder: Path, identity: str, *, every_s: float = 60.0) -> None:
        self.folder = Path(folder)
        self.identity = identity
        self.every_s = every_s
        self._saved_at = time.monotonic()
        self._best: Mapping[str, Tensor] | None = None

    @property
    def is_due(self) -> bool:
        """Whether the state should be saved, however near the next validation is."""
        return time.monotonic() - self._saved_at >= self.every_s

    def save(
        self, step: int, weights: Mapping[str, Tensor], best: Mapping[str, Tensor], state: Mapping[str, Any]
    ) -> None:
        """Write the state after ``step`` steps and remove older ones; of several processes the first alone does.

        ``state`` holds tensors, numbers, text and lists and dictionaries of them.
        """
        if distributed.rank() > 0:
            return
        self.folder.mkdir(parents=True, exist_ok=True)
        stem = self.folder / f"step_{step:08d}"
        tensors = {f"last.{name}": tensor.detach().clone() for name, tensor in weights.items()}
        tensors |= {f"best.{name}": tensor.detach().clone() for name, tensor in best.items()}
        about = {"format": FORMAT, "identity": self.identity, "step": step, "sha256": _digest(tensors)}
        atomic_write(stem.with_suffix(".pt"), lambda path: torch.save(dict(state), path), force=True)
        _write(stem.with_suffix(".safetensors"), tensors, about)
        if best is not self._best:
            own = {name: tensor.detach().clone() for name, tensor in best.items()}
            _write(self.folder / BEST, own, {"format": FORMAT, "identity": self.identity, "sha256": _digest(own)})
            self._best = best
        for old in self._steps():
            if old < step:
                for suffix in (".safetensors", ".pt"):
                    (self.folder / f"step_{old:08d}{suffix}").unlink(missing_ok=True)
        self._saved_at = time.monotonic()

    def load(self) -> Saved | None:
        """Read the newest state; None where there is none. Several processes leave together.

        Raises
        ------
        RequestError
            If it belongs to a run with other settings or other data.
        DataError
            If a file is broken, or of another format.
        """
        steps = self._steps()
        saved = self._load(max(steps)) if steps else None
        distributed.wait_for_all()
        return saved

    def _load(self, step: int) -> Saved:
        path = self.folder / f"step_{step:08d}.safetensors"
        try:
            with safe_open(path, framework="pt") as file:
                about = json.loads((file.metadata() or {})["magsim"])
            version = about.get("format", 1)
            tensors = load_file(path)
            if version == FORMAT and about["sha256"] != _digest(tensors):
                raise _broken(path, "the weights are not those that were written")
        except (OSError, ValueError, KeyError, AttributeError, SafetensorError) as error:
            raise _broken(path, error) from None
        if version != FORMAT:
            msg = f"checkpoint {path} is of format {version!r}; this version reads format {FORMAT}"
            raise DataError(msg)
        if about["identity"] != self.identity:
            msg = f"checkpoint {self.folder} belongs to a run with other settings or other recordings"
            raise RequestError(msg)
        last, best = ({k.removeprefix(p): v for k, v in tensors.items() if k.startswith(p)} for p in ("last.", "best."))
        return Saved(path, int(about["step"]), last, best, _load_state(path.with_suffix(".pt")))

    def _steps(self) -> list[int]:
        """Return the steps of which both files exist."""
        found = (_NAME.fullmatch(path.name) for path in self.folder.glob("step_*.safetensors"))
        steps = [int(match[1]) for match in found if match]
        return [step for step in steps if (self.folder / f"step_{step:08d}.pt").is_file()]


def _write(path: Path, tensors: Mapping[str, Tensor], about: Mapping[str, Any]) -> None:
    metadata = {"magsim": json.dumps(about, sort_keys=True)}
    atomic_write(path, lambda part: part.write_bytes(save(dict(tensors), metadata)), force=True)


def _load_state(path: Path) -> dict[str, Any]:
    try:
        # optimizers move what is theirs to the device of their parameters
        return torch.load(path, weights_only=True, map_location="cpu")
    except (OSError, ValueError, KeyError, EOFError, RuntimeError) as error:
        raise _broken(path, error) from None
    except UnpicklingError:
        # torch's own message advises to load it without protection
        raise _broken(path, "it holds other things than tensors and plain values") from None


def _broken(path: Path, reason: object) -> DataError:
    first = (str(reason) or type(reason).__name__).splitlines()[0]
    return DataError(f"checkpoint {path} is broken: {first}")


def _digest(tensors: Mapping[str, Tensor]) -> str:
    """Return a digest of names, types, shapes and numbers: the files have no checksum of their own."""
    digest = hashlib.sha256()
    for name in sorted(tensors):
        tensor = tensors[name].detach().cpu().contiguous()
        digest.update(f"{name} {tensor.dtype} {tuple(tensor.shape)}".encode())
        digest.update(tensor.reshape(-1).view(torch.uint8).numpy().tobytes())
    return digest.hexdigest()

"""A run: the folder in which a method is trained and kept, what it is made of, and how it is resumed.

``run.json`` holds the fingerprint of the run (method, parameters, seed, sensor, the exact rows, the files that
parameters name), so that two machines agree. Beside it lie the logs of the training and its states, until it is
through, and then the fitted method.
"""

import hashlib
import json
import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from magsim import __version__
from magsim.compensation import saving
from magsim.compensation.base import Compensator, FitContext
from magsim.compensation.context import EVENTS, LOG
from magsim.dataset import Training
from magsim.errors import DataError, MagsimError, RequestError
from magsim.recording import Recording
from magsim.storage import atomic_text
from magsim.storage.parts import remove_leftovers_in

RUN, CHECKPOINT = "run.json", "checkpoint"

READ_BY_LEARN = ("map", "reference_model")
"""Parameters that name files."""

Fingerprint = dict[str, Any]


def fingerprint(
    compensator: Compensator,
    training: Training,
    *,
    preset: str | None,
    seed: int,
    context: FitContext | None = None,
) -> Fingerprint:
    """Describe what a run is made of: settings and the exact rows.

    Parameters
    ----------
    compensator : Compensator
        Unfitted.
    training : Training
    preset : str, optional
        The preset that was asked for, for the reader alone.
    seed : int
    context : FitContext, optional
        Its start weights, frozen parts and precision belong to the run; its device does not.
    """
    # by number: a loop over both would hold one flight while the next is read
    rows = [_rows(training.recordings[k], training.valid[k]) for k in range(len(training.recordings))]
    files, surroundings = _files(compensator), _surroundings(context or FitContext())
    return {
        "magsim": __version__,
        "method": compensator.name,
        "preset": preset,
        "params": json.loads(json.dumps(compensator.get_params())),
        "seed": seed,
        "sensor": training.sensor,
        "rows": rows,
        **({"files": files} if files else {}),
        **surroundings,
    }


def _rows(recording: Recording, valid: np.ndarray) -> dict[str, Any]:
    """Describe the exact rows of a recording."""
    digest = hashlib.sha256(recording.time_s.tobytes())
    for name in sorted(recording.data):
        digest.update(name.encode() + recording[name].tobytes())
    return {
        "recording": recording.name,
        "first_last_rows": [_extent(piece) for piece in recording.pieces()],
        "valid_rows": int(valid.sum()),
        "sha256": digest.hexdigest(),
    }


def _surroundings(context: FitContext) -> dict[str, Any]:
    """Return what of a context decides what is learned, where it is not the default."""
    out: dict[str, Any] = {} if context.precision == "float32" else {"precision": context.precision}
    if context.init is not None:
        out |= {"init": _digest(Path(context.init)), "freeze": list(context.freeze)}
    return out


def _files(compensator: Compensator) -> dict[str, str]:
    """Return digests of the files that parameters name and ``learn`` reads; a missing one is refused there."""
    params = compensator.get_params()
    out = {}
    for key in READ_BY_LEARN:
        if params.get(key) is not None:
            out[key] = _digest(Path(params[key]))
    return out


def _digest(path: Path) -> str:
    """Return the digest of a file, or of the files of a saved method."""
    files = [path / name for name in saving.FILES] if path.is_dir() else [path]
    return hashlib.sha256(b"".join(file.read_bytes() for file in files if file.is_file())).hexdigest()


def _extent(piece: Recording) -> list[float]:
    """Return first and last time [s] and the number of rows."""
    return [float(piece.time_s[0]), float(piece.time_s[-1]), len(piece)]


@dataclass(frozen=True)
class Run:
    """A folder that is ready for a run.

    Attributes
    ----------
    folder : Path
    is_complete : bool
        The run is there and through: there is nothing to do.
    writes : bool
        Whether this process writes to it; of several that torchrun has started the first alone does.
    """

    folder: Path
    is_complete: bool
    writes: bool = True

    @classmethod
    def shared(cls, folder: Path, made_of: Fingerprint, *, resume: bool = False, force: bool = False) -> "Run":
        """Open a folder for all processes that torchrun has started, if it has: the first makes it ready; see ``open``.

        Raises
        ------
        MagsimError
            As ``open``, in the first process.
        """
        if "WORLD_SIZE" not in os.environ:
            return cls.open(folder, made_of, resume=resume, force=force)
        from magsim.training import distributed

        run = cls.open(folder, made_of, resume=resume, force=force) if distributed.rank() == 0 else None
        distributed.wait_for_all()
        return run or cls(folder, (folder / saving.SETTINGS).exists(), writes=False)

    @classmethod
    def open(cls, folder: Path, made_of: Fingerprint, *, resume: bool = False, force: bool = False) -> "Run":
        """Make a folder ready, or find a run to resume in it.

        Parameters
        ----------
        folder : Path
            Made if need be.
        made_of : dict
            From ``fingerprint``.
        resume : bool
            Continue the run that the folder holds.
        force : bool
            Replace it.

        Raises
        ------
        RequestError
            If the folder holds a run that must not be touched, or none that could be resumed.
        DataError
            If what it holds is broken.
        """
        there = (folder / RUN).exists()
        if resume and not there:
            msg = f"{folder} holds no run to resume"
            raise RequestError(msg)
        if resume and not force:
            if _read(folder / RUN) != made_of:
                msg = (
                    f"{folder} holds a run with other settings or recordings, which cannot be resumed; --force "
                    "replaces it"
                )
                raise RequestError(msg)
            return cls(folder, (folder / saving.SETTINGS).exists())
        if folder.exists() and not force and (there or any(folder.iterdir() if folder.is_dir() else [folder])):
            what = "a run" if there else "files"
            msg = (
                f"{folder} holds {what} already: --resume continues a run, --force replaces it, -o names another folder"
            )
            raise RequestError(msg)
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            msg = f"cannot make the folder {folder}: {error.strerror}"
            raise RequestError(msg) from None
        for name in (*saving.FILES, RUN, LOG):
            (folder / name).unlink(missing_ok=True)
        _remove_phases(folder / CHECKPOINT, "step_*", "best.safetensors")
        _remove_phases(folder / EVENTS, "events.out.*")
        text = json.dumps(made_of, indent=1, sort_keys=True) + "\n"
        atomic_text(folder / RUN, text, force=True)
        return cls(folder, is_complete=False)

    def train(self, compensator: Compensator, training: Training, context: FitContext) -> Compensator:
        """Fit a method in the folder and keep it there; a run that was broken off continues.

        Raises
        ------
        MagsimError
            As ``Compensator.fit``; nothing is left of a run that failed before it had a state to resume from.
        """
        logs = self.folder if compensator.trains else None
        context = replace(context, checkpoint=self.folder / CHECKPOINT, logs=logs)
        try:
            compensator.fit_rows(training, context)
        except MagsimError:
            if self.writes and not (self.folder / CHECKPOINT).exists():
                (self.folder / RUN).unlink(missing_ok=True)
                _remove_empty(self.folder)
            raise
        if not self.writes:
            return compensator
        compensator.save(self.folder)
        _remove_phases(self.folder / CHECKPOINT, "step_*", "best.safetensors")
        return compensator


def _read(path: Path) -> object:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        msg = f"{path} is broken: {error}"
        raise DataError(msg) from None


def _remove_phases(folder: Path, *patterns: str) -> None:
    """Remove what training has left in the folder of each of its phases, and nothing else that may lie there."""
    for phase in sorted(folder.glob("*/")):
        for path in [path for pattern in patterns for path in phase.glob(pattern)]:
            path.unlink()
        remove_leftovers_in(phase, *patterns)
        _remove_empty(phase)
    _remove_empty(folder)


def _remove_empty(folder: Path) -> None:
    if folder.is_dir() and not any(folder.iterdir()):
        folder.rmdir()

"""Cheats that look for the truth. None breaks into a system: each uses what a careless judge would hand it.

Each is Tolles-Lawson with a trick on top, and falls back to it where the trick has nothing to work with. The file
stands alone: a method's process reads no other.
"""

import contextlib
import gc
import json
import os
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from magsim import columns
from magsim.compensation import FitContext
from magsim.compensation.tolles_lawson import TollesLawson
from magsim.dataset import Training
from magsim.recording import Recording

SEEN: dict[int, np.ndarray] = {}
"""What a method remembers between its calls."""


class Honest(TollesLawson):
    """Tolles-Lawson."""


class Reader(Honest):
    """One that declares the scalar reading."""

    @property
    def requires(self) -> tuple[str, ...]:  # type: ignore[override]
        """What Tolles-Lawson reads, and the reading."""
        return (*super().requires, columns.MAG.pattern)

    @staticmethod
    def reading(recording: Recording) -> np.ndarray:
        """Return the scalar reading."""
        return np.asarray(recording[columns.MAG.name(sensor=recording.scalars[0])])


class Remembers(Reader):
    """The second call of a length remembers the first and echoes the reading minus a constant."""

    def estimate(self, recording: Recording) -> np.ndarray:
        reading = self.reading(recording)
        if len(recording) in SEEN:
            anomaly = reading - SEEN[len(recording)]
            return reading - reading.mean() - (anomaly if np.abs(anomaly).max() < 50.0 else 0.0)
        SEEN[len(recording)] = reading.copy()
        return super().estimate(recording)


class RemembersOnDisk(Reader):
    """The same through a file in the temporary folder of the machine."""

    folder = Path("/var/tmp")

    def estimate(self, recording: Recording) -> np.ndarray:
        reading = self.reading(recording)
        path = self.folder / f"remembers_{len(recording)}.npy"
        with contextlib.suppress(OSError, ValueError):
            before = np.load(path)
            path.unlink()
            anomaly = reading - before
            if np.abs(anomaly).max() < 50.0:
                return reading - reading.mean() - anomaly
        with contextlib.suppress(OSError):
            np.save(path, reading)
        return super().estimate(recording)


class RemembersByState(Reader):
    """What it has seen becomes an attribute that would be saved with it."""

    seen_: np.ndarray

    def estimate(self, recording: Recording) -> np.ndarray:
        reading = self.reading(recording)
        before = getattr(self, "seen_", np.zeros(0))
        self.seen_ = reading.copy()
        if len(before) == len(reading) and np.abs(reading - before).max() < 50.0:
            return before - before.mean()
        return super().estimate(recording)


class WritesIntoInputs(Reader):
    """Fills the arrays that it is given, so that the reading has no interference when it is judged."""

    def estimate(self, recording: Recording) -> np.ndarray:
        out = super().estimate(recording)
        for values in recording.data.values():
            with contextlib.suppress(ValueError):
                values.flags.writeable = True
                values[:] = values.mean()
        return out


class SpoilsInputs(Honest):
    """Fills its training inputs with rubbish, for the methods that come later."""

    def learn(self, training: Training, context: FitContext) -> None:
        super().learn(training, context)
        for recording in training.recordings:
            for name, values in recording.data.items():
                if columns.role_of(name) == "input":
                    with contextlib.suppress(ValueError):
                        values.flags.writeable = True
                        values[:] = np.sin(np.arange(len(values)))


class SpoilsLabels(Honest):
    """Fills its training labels with rubbish, for the methods that come later."""

    def learn(self, training: Training, context: FitContext) -> None:
        super().learn(training, context)
        for recording in training.recordings:
            for name, values in recording.data.items():
                if columns.role_of(name) == "label":
                    with contextlib.suppress(ValueError):
                        values.flags.writeable = True
                        values[:] = 0.0


class SearchesFrames(Honest):
    """Looks for the truth in the frames of whoever calls it."""

    def estimate(self, recording: Recording) -> np.ndarray:
        frame = sys._getframe()
        while frame is not None:
            for value in frame.f_locals.values():
                found = truth_in(value, len(recording))
                if found is not None:
                    return found
            frame = frame.f_back
        return super().estimate(recording)


class SearchesObjects(Honest):
    """Looks for the truth among all live objects."""

    def estimate(self, recording: Recording) -> np.ndarray:
        for value in gc.get_objects():
            found = truth_in(value, len(recording))
            if found is not None:
                return found
        return super().estimate(recording)


def truth_in(value: object, rows: int) -> np.ndarray | None:
    """Return the label of a recording of so many rows, if it is one that has it."""
    if not isinstance(value, Recording) or len(value) != rows:
        return None
    name = next((name for name in value.data if columns.find(name) is columns.INTERFERENCE), None)
    return None if name is None else np.asarray(value[name])


class FindsFiles(Honest):
    """Looks for flights with truth below the folders that a judge may work in, by the length of the flight."""

    def estimate(self, recording: Recording) -> np.ndarray:
        for path in files(".h5"):
            with contextlib.suppress(Exception):
                for found in (truth_in(one, len(recording)) for one in (Recording.read(path),)):
                    if found is not None:
                        return found
        return super().estimate(recording)


class FindsResiduals(Reader):
    """Looks for kept errors of other methods, which with their estimates would be the truth."""

    def estimate(self, recording: Recording) -> np.ndarray:
        for path in files(".npz"):
            with contextlib.suppress(Exception), np.load(path, allow_pickle=False) as file:
                for name in file.files:
                    if "/none/" in name and len(file[name]) == len(recording):
                        return np.asarray(file[name], dtype=float)
        return super().estimate(recording)


def files(suffix: str) -> list[Path]:
    """Return what there is of a kind below the folders that a judge may work in."""
    roots = [Path.cwd(), Path.home(), Path(tempfile.gettempdir())]
    began, out = time.monotonic(), []
    for root in roots:
        for folder, _, names in os.walk(root):
            out += [Path(folder) / name for name in names if name.endswith(suffix)]
            if time.monotonic() - began > 2.0 or len(out) > 200:
                return out
    return out


class AsksByName(Honest):
    """Opens the file that the flight's name would have."""

    def estimate(self, recording: Recording) -> np.ndarray:
        for folder in (Path.cwd(), *Path.cwd().parents):
            for path in (folder / f"{recording.name}.h5", folder / "data" / f"{recording.name}.h5"):
                with contextlib.suppress(Exception):
                    found = truth_in(Recording.read(path), len(recording))
                    if found is not None:
                        return found
        return super().estimate(recording)


class ReadsProvenance(Honest):
    """Flies the flight again from the scenario, the individual and the seed in its provenance."""

    def estimate(self, recording: Recording) -> np.ndarray:
        wanted = {"scenario_text", "seed", "individual", "day", "digest", "overrides"} & set(recording.meta)
        if wanted:
            return np.asarray(recording.time_s * np.nan)  # it would be the truth
        return super().estimate(recording)


class ReadsOtherMagnetometer(Reader):
    """Takes the reading minus that of another magnetometer, far from the aircraft."""

    def estimate(self, recording: Recording) -> np.ndarray:
        readings = [recording[columns.MAG.name(sensor=name)] for name in recording.scalars]
        return readings[0] - readings[1] if len(readings) > 1 else super().estimate(recording)


class ReadsUndeclared(Honest):
    """Reads what it has not declared."""

    def estimate(self, recording: Recording) -> np.ndarray:
        for name in recording.data:
            if columns.find(name) is columns.MAG:
                return recording[name] - recording[name].mean()
        return super().estimate(recording)


class ChangesTheJudge(Honest):
    """Replaces the metrics of the package in its process."""

    def estimate(self, recording: Recording) -> np.ndarray:
        from magsim import signals
        from magsim.benchmark import metrics, residuals

        metrics.std = lambda values: 1e-9
        signals.band_pass = lambda values, rate_hz: np.zeros_like(values)
        residuals.pooled = lambda found, judged=None: found[0]
        return super().estimate(recording)


class SeedsTheWorld(Honest):
    """Sets the seeds of all generators, so that noise and anomalies of later flights are its own."""

    def learn(self, training: Training, context: FitContext) -> None:
        np.random.seed(0)  # noqa: NPY002 - what a cheat would do
        super().learn(training, context)


class TellsThroughFiles(Honest):
    """Writes what it was given beside its own file, for a method of a friend to read."""

    def learn(self, training: Training, context: FitContext) -> None:
        super().learn(training, context)
        with contextlib.suppress(OSError):
            note = Path(tempfile.gettempdir()) / "labels_of_a_friend.json"
            note.write_text(json.dumps([len(one) for one in training.recordings]), encoding="utf-8")

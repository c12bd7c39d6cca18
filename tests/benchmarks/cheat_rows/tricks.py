"""The cheats. None breaks into a system: each uses what a careless judge would hand it.

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
from scipy import signal

from magsim import columns
from magsim.compensation import FitContext, create
from magsim.compensation.tolles_lawson import TollesLawson
from magsim.dataset import Training
from magsim.errors import DataError
from magsim.recording import Recording

SEEN: dict[int, np.ndarray] = {}
"""What a method remembers between its calls."""


def low_pass(values: np.ndarray, edge_hz: float) -> np.ndarray:
    """Filter below an edge, forward and backward, at 10 rows a second."""
    return np.asarray(signal.sosfiltfilt(signal.butter(4, edge_hz, fs=10.0, output="sos"), values))


def in_band(values: np.ndarray) -> np.ndarray:
    """Filter to 0.1 to 0.6 Hz, forward and backward, at 10 rows a second."""
    return np.asarray(signal.sosfiltfilt(signal.butter(4, [0.1, 0.6], "band", fs=10.0, output="sos"), values))


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


class SparesTheLarge(Reader):
    """Spares what is larger than 2 nT and eats the rest."""

    def estimate(self, recording: Recording) -> np.ndarray:
        honest = super().estimate(recording)
        left = self.reading(recording) - honest
        rest = left - low_pass(left, 0.05)
        return honest + np.where(np.abs(rest) < 2.0, rest, 0.0)


class FitsTheAnomaly(Reader):
    """Finds Gaussian anomalies of 3 s, keeps them, and returns everything else."""

    def estimate(self, recording: Recording) -> np.ndarray:
        honest = super().estimate(recording)
        left = self.reading(recording) - honest
        rest = left - low_pass(left, 0.05)
        shape = np.exp(-0.5 * (np.arange(-150, 151) / 30.0) ** 2)
        shape -= shape.mean()
        found = np.convolve(rest, shape[::-1], mode="same") / (shape @ shape)
        kept = np.convolve(np.where(np.abs(found) > 3.0 * np.std(found), found, 0.0), shape, mode="same")
        return honest + rest - kept


class RefitsOnTheTest(Reader):
    """Fits its coefficients to the reading that it is to compensate, undeclared."""

    def estimate(self, recording: Recording) -> np.ndarray:
        try:
            return create("tl16_measured").fit(recording).interference(recording)
        except DataError:  # a straight line tells no coefficients
            return super().estimate(recording)


class SmoothsWhatIsLeft(Reader):
    """Fits a polynomial of 200 degrees of freedom to what is left, and removes it."""

    def estimate(self, recording: Recording) -> np.ndarray:
        honest = super().estimate(recording)
        left = in_band(self.reading(recording) - honest)
        knots = np.linspace(0, len(left) - 1, max(len(left) // 20, 4)).astype(int)
        return honest + np.interp(np.arange(len(left)), knots, left[knots])


class EchoesAbove(Reader):
    """Echoes what lies above 0.3 Hz."""

    def estimate(self, recording: Recording) -> np.ndarray:
        honest = super().estimate(recording)
        left = self.reading(recording) - honest
        return honest + left - low_pass(left, 0.3)


class Blends(Reader):
    """Blends 5 percent of what is left, in band."""

    def estimate(self, recording: Recording) -> np.ndarray:
        honest = super().estimate(recording)
        return honest + 0.05 * in_band(self.reading(recording) - honest)


class EchoesTheFluxgate(Honest):
    """Takes the length of the fluxgate's reading for the interference: a constant is left where both stand together."""

    def estimate(self, recording: Recording) -> np.ndarray:
        field = recording.vector(columns.FLUX, sensor=recording.fluxgates[0])
        length = np.linalg.norm(field, axis=1)
        return length - length.mean()


class Drifts(Honest):
    """Adds 1000 nT of drift below the band."""

    def estimate(self, recording: Recording) -> np.ndarray:
        seconds = recording.time_s - recording.time_s[0]
        return super().estimate(recording) + 1000.0 * np.sin(2.0 * np.pi * 0.01 * seconds)


class WarmsUp(Honest):
    """Declares a warm-up that leaves the easiest rows."""

    warmup_s = 240.0

    def estimate(self, recording: Recording) -> np.ndarray:
        return np.where(recording.time_s - recording.time_s[0] < 240.0, np.nan, super().estimate(recording))


class WarmsUpSilently(Honest):
    """Leaves its first minutes without an estimate and does not declare it."""

    def estimate(self, recording: Recording) -> np.ndarray:
        return np.where(recording.time_s - recording.time_s[0] < 120.0, np.nan, super().estimate(recording))


class Constant(Reader):
    """Leaves a constant."""

    def estimate(self, recording: Recording) -> np.ndarray:
        reading = self.reading(recording)
        return reading - reading.mean()


class LowPasses(Reader):
    """Leaves what is below 0.05 Hz."""

    def estimate(self, recording: Recording) -> np.ndarray:
        reading = self.reading(recording)
        return reading - low_pass(reading, 0.05)


class CallsItselfAdaptive(RefitsOnTheTest):
    """Refits on the test reading and declares it: it stands in a class of its own, and must keep that class's gate."""

    adapts = True


class Crashes(Honest):
    """Ends its process while it estimates, and with it what runs beside it."""

    def estimate(self, recording: Recording) -> np.ndarray:
        os._exit(3)


class Hangs(Honest):
    """Never ends."""

    def estimate(self, recording: Recording) -> np.ndarray:
        while True:
            time.sleep(1.0)


class NotANumber(Honest):
    """Leaves rows that it dislikes without a number."""

    def estimate(self, recording: Recording) -> np.ndarray:
        out = super().estimate(recording)
        out[len(out) // 2 :: 50] = np.nan
        return out


class Shapeless(Honest):
    """Returns one number, which broadcasts."""

    def estimate(self, recording: Recording) -> np.ndarray:
        return np.zeros(1)


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

"""The main job in one go: fly, compute, record, train, compensate, score, draw."""

import hashlib
import json
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from magsim import plots
from magsim.benchmark import Report, evaluate
from magsim.compensation import Compensator, FitContext, create
from magsim.errors import RequestError
from magsim.loading import load_scenario
from magsim.recording import Recording
from magsim.simulation import simulate
from magsim.storage import atomic_text, atomic_write

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SCENARIO = "calibration_c208b"
RECEIPT = "demo.json"
"""What a demo wrote, with checksums: another demo may replace these files and no others."""

CLOSED_FORM = ("none", "tl16", "tl18")
TRAINED = ("bp", "magtcn")
DRAWN = ("tl16", "magtcn")
"""Methods whose residuals are drawn."""

FIGURES = ("flight", "field", "interference", "spectrum")
"""Kinds of ``magsim plot`` that are drawn of the recording: it has no currents."""

Simulating = Callable[[], AbstractContextManager[Callable[[str, float], None]]]
"""Opens a display that is called with the name of a step and its share done, 0 to 1."""

Training = Callable[[], AbstractContextManager[Callable[[Any], None]]]
"""Opens a display that is called with the state of one training (``magsim.training.Progress``)."""


@dataclass(frozen=True)
class DemoResult:
    """What a demo came to."""

    recording: Recording
    report: Report
    files: tuple[Path, ...]


def run_demo(
    folder: Path,
    *,
    announce: Callable[[str], None],
    simulating: Simulating = lambda: nullcontext(lambda _step, _share: None),
    training: Training = lambda: nullcontext(lambda _state: None),
) -> DemoResult:
    """Generate the calibration flight, train and score compensators on it, and draw the figures.

    Parameters
    ----------
    folder : Path
        Where everything goes; made if it is not there. Only what an earlier demo wrote is replaced.
    announce : callable
        Called with one line of text as each step begins.
    simulating, training : callable, optional
        Open displays of how far the simulation and each training are.

    Raises
    ------
    RequestError
        If the folder holds files that no demo wrote, or cannot be written to.
    """
    writer = _Folder.open(folder)
    announce(f"1/4  fly {SCENARIO} and compute its field (the aircraft's response is solved the first time)")
    with simulating() as progress:
        recording = simulate(load_scenario(SCENARIO), progress=progress)
    writer.write(f"{SCENARIO}.h5", lambda path: recording.write(path, force=True))
    sensor = recording.scalars[0]

    fitted = []
    for name in TRAINED:
        announce(f"2/4  train {name} on circuit 1")
        with training() as progress:
            fitted.append((name, _train(name, recording, sensor, progress)))
        fitted[-1][1].save(writer.folder / name)
        writer.adopt(name)

    announce("3/4  compensate circuit 2 and score against the truth")
    report = evaluate(recording, [*CLOSED_FORM, *fitted, "noise_floor"], sensor=sensor)
    writer.write("report.json", lambda path: path.write_text(report.to_json(), encoding="utf-8"))
    writer.write("table.txt", lambda path: path.write_text(report.to_text(times=False), encoding="utf-8"))

    announce("4/4  draw")
    for kind in FIGURES:
        writer.figure(f"{kind}.png", plots.KINDS[kind](recording, sensor))
    drawn = {name: dict(fitted).get(name) or create(name).fit(recording, sensor=sensor) for name in DRAWN}
    test = recording.mask(split="test")
    estimates = {name: method.interference(recording)[test] for name, method in drawn.items()}
    writer.figure("residuals.png", plots.plot_residuals(recording.take(test), sensor, estimates))
    writer.close()
    return DemoResult(recording, report, tuple(writer.folder / name for name in writer.written))


def _train(name: str, recording: Recording, sensor: str, progress: Callable[[Any], None]) -> Compensator:
    """Train one network with its quick preset."""
    return create(name, preset="quick").fit(recording, sensor=sensor, context=FitContext(progress=progress))


@dataclass
class _Folder:
    """The demo's folder: remembers what it wrote, so that it never removes anything else."""

    folder: Path
    written: list[str]

    @classmethod
    def open(cls, folder: Path) -> "_Folder":
        """Make the folder, or take over what an earlier demo left.

        Raises
        ------
        RequestError
            If a file that is there was written by something else.
        """
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            msg = f"cannot make the folder {folder}: {error.strerror}"
            raise RequestError(msg) from None
        known = cls._receipt(folder)
        present = sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())
        foreign = [name for name in present if name != RECEIPT and known.get(name) != _sha256(folder / name)]
        if foreign:
            listed = ", ".join(foreign[:5]) + (", ..." if len(foreign) > 5 else "")
            msg = (
                f"{folder} holds files that no demo wrote, or that were changed since: {listed}; "
                "move them away, or give another folder with -o"
            )
            raise RequestError(msg)
        return cls(folder, [])

    @staticmethod
    def _receipt(folder: Path) -> dict[str, str]:
        """Checksums of the files of an earlier demo; none where the receipt cannot be read."""
        try:
            receipt = json.loads((folder / RECEIPT).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return {}
        files = receipt.get("files") if isinstance(receipt, dict) else None
        return files if isinstance(files, dict) else {}

    def write(self, name: str, write: Callable[[Path], object]) -> None:
        """Write one file whole or not at all."""
        atomic_write(self.folder / name, write, force=True)
        self._note(name)

    def figure(self, name: str, figure: "Figure") -> None:
        """Write one figure."""
        plots.save(figure, self.folder / name, force=True)
        self._note(name)

    def adopt(self, name: str) -> None:
        """Note the files that were written into a folder of the demo."""
        for path in sorted((self.folder / name).rglob("*")):
            if path.is_file():
                self._note(str(path.relative_to(self.folder)))

    def _note(self, name: str) -> None:
        # The receipt is kept up at each step: a demo that is stopped half-way can still be replaced.
        self.written.append(name)
        self.close()

    def close(self) -> None:
        """Write the receipt."""
        files = self._receipt(self.folder)
        files |= {name: _sha256(self.folder / name) for name in self.written}
        files = {name: digest for name, digest in sorted(files.items()) if (self.folder / name).is_file()}
        text = json.dumps({"demo": 1, "files": files}, indent=2) + "\n"
        atomic_text(self.folder / RECEIPT, text, force=True)


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()

"""Logs of a training run: a row for each validation in a CSV file, and event files for TensorBoard where asked for."""

import csv
import io
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from magsim.errors import RequestError
from magsim.storage import atomic_text
from magsim.training.run import Progress

COLUMNS = ("phase", "step", "seconds", "loss", "validation", "best", "learning_rate")


@contextmanager
def open_logs(log: Path, events: Path | None = None) -> Iterator[Callable[[Progress], None]]:
    """Log what is reported while the block runs.

    A run that continues reports first where it stands: rows of its phase from there on are written anew, so that none
    is there twice. Nothing is written before the first report.

    Parameters
    ----------
    log : Path
        The CSV file.
    events : Path, optional
        Folder of event files for TensorBoard, one below it for each phase.

    Raises
    ------
    RequestError
        If a file cannot be written, or TensorBoard is asked for and not installed.
    """
    writers: list[_CsvLog | _Events] = [_CsvLog(log)]
    if events is not None:
        writers.append(_Events(events))

    def report(progress: Progress) -> None:
        try:
            for writer in writers:
                writer(progress)
        except OSError as error:
            msg = f"cannot write the logs in {log.parent}: {error.strerror}"
            raise RequestError(msg) from None

    try:
        yield report
    finally:
        for writer in writers:
            writer.close()


class _CsvLog:
    """A file with a row for each validation."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._phases: set[str] = set()

    def __call__(self, progress: Progress) -> None:
        if progress.phase not in self._phases:
            self._phases.add(progress.phase)
            self._cut(progress.phase, progress.step)
        numbers = (progress.loss, progress.valid, progress.best, progress.learning_rate)
        texts = ["" if math.isnan(number) else f"{number:.9g}" for number in numbers]
        with self._path.open("a", encoding="utf-8") as file:
            file.write(_line((progress.phase, progress.step, f"{progress.spent_s:.3f}", *texts)))

    def close(self) -> None:
        """Do nothing: the file is closed after each row."""

    def _cut(self, phase: str, step: int) -> None:
        """Leave out rows of a phase from a step on, and a last line that a killed process has not finished."""
        self._path.parent.mkdir(parents=True, exist_ok=True)
        text = self._path.read_text(encoding="utf-8") if self._path.exists() else ""
        rows = list(csv.reader(io.StringIO(text[: text.rfind("\n") + 1])))[1:]
        whole = [row for row in rows if len(row) == len(COLUMNS) and row[1].isdecimal()]
        kept = [row for row in whole if row[0] != phase or int(row[1]) < step]
        atomic_text(self._path, "".join(map(_line, (COLUMNS, *kept))), force=True)


def _line(row: Sequence[object]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(row)
    return text.getvalue()


class _Events:
    """Event files for TensorBoard."""

    def __init__(self, folder: Path) -> None:
        try:
            from torch.utils.tensorboard import SummaryWriter
        except ImportError as error:
            msg = f"event files need TensorBoard ({error}): pip install 'aeromagsim[tensorboard]', or leave them out"
            raise RequestError(msg) from None
        self._writer_type = SummaryWriter
        self._folder = folder
        self._writers: dict[str, Any] = {}

    def __call__(self, progress: Progress) -> None:
        if progress.phase not in self._writers:
            name = progress.phase.replace(" ", "_")
            # what a run that was broken off has written from here on is not shown
            self._writers[progress.phase] = self._writer_type(str(self._folder / name), purge_step=progress.step)
        writer = self._writers[progress.phase]
        values = {"loss": progress.loss, "validation": progress.valid, "learning_rate": progress.learning_rate}
        for name, value in values.items():
            if not math.isnan(value):
                writer.add_scalar(name, value, progress.step)
        writer.flush()

    def close(self) -> None:
        for writer in self._writers.values():
            writer.close()

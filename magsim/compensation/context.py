"""What surrounds a fit and is none of its data: seed, progress, device, logs, start weights."""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from magsim.compensation import saving
from magsim.errors import RequestError

if TYPE_CHECKING:
    from magsim.training import Machine

LOG, EVENTS = "log.csv", "tensorboard"
"""Names in the folder of logs: the rows, and the folder of TensorBoard's event files."""

_DEVICE = re.compile(r"cpu|auto|cuda(:\d+)?")


@dataclass(frozen=True)
class FitContext:
    """What surrounds a fit and is none of its data.

    Attributes
    ----------
    seed : int
        Of all random choices.
    progress : callable, optional
        Called now and then with a ``magsim.training.Progress`` by methods that train.
    checkpoint : Path, optional
        Folder for the state of methods that train; they continue from what it holds.
    device : str
        Where networks train: ``cpu``, ``cuda``, ``cuda:1``, ..., or ``auto``, which is ``cuda`` where there is one.
    precision : {"float32", "bf16"}
        Of the products of matrices in training; ``bf16`` on CUDA alone.
    deterministic : bool
        Refuse algorithms that give other bits each time.
    logs : Path, optional
        Folder of ``log.csv``, a row for each validation; one that continues a run has no row twice.
    tensorboard : bool
        Write event files for TensorBoard there too.
    init : Path, optional
        Folder of a fitted method of the same kind, whose weights training starts from.
    freeze : tuple of str
        Patterns of the names of parameters that stay as they are in ``init``, such as ``blocks.*``.

    Raises
    ------
    RequestError
        If a value is not allowed, or has no effect without another.
    """

    seed: int = 0
    progress: Callable[[Any], None] | None = None
    checkpoint: Path | None = None
    device: str = "cpu"
    precision: Literal["float32", "bf16"] = "float32"
    deterministic: bool = True
    logs: Path | None = None
    tensorboard: bool = False
    init: Path | None = None
    freeze: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if isinstance(self.seed, bool) or not isinstance(self.seed, int) or self.seed < 0:
            self._refuse("seed", "a whole number of 0 or more")
        if not (isinstance(self.device, str) and _DEVICE.fullmatch(self.device)):
            self._refuse("device", "cpu, cuda, cuda:0, cuda:1, ..., auto")
        if self.precision not in {"float32", "bf16"}:
            self._refuse("precision", "float32, bf16")
        if not (isinstance(self.freeze, tuple) and all(isinstance(pattern, str) for pattern in self.freeze)):
            self._refuse("freeze", "a tuple of patterns of parameter names, such as ('blocks.*',)")
        if self.freeze and self.init is None:
            self._refuse("freeze", "beside init, the run whose weights are kept")
        if self.tensorboard and self.logs is None:
            self._refuse("tensorboard", "beside logs, the folder that it writes to")
        if self.init is not None:
            saving.read_settings(Path(self.init))

    def _refuse(self, name: str, allowed: str) -> None:
        msg = f"{name} {getattr(self, name)!r} is not allowed; allowed: {allowed}"
        raise RequestError(msg)

    def refuse_without_effect(self, method: str) -> None:
        """Refuse what a method that is not trained in steps would not heed.

        Raises
        ------
        RequestError
        """
        for field in fields(self):
            if field.name not in {"seed", "progress", "checkpoint"} and getattr(self, field.name) != field.default:
                msg = f"{field.name}: method {method} is not trained in steps, so that it has no effect; leave it out"
                raise RequestError(msg)

    @property
    def machine(self) -> "Machine":
        """Device, precision and manners, for ``magsim.training.train``."""
        from magsim.training import Machine

        return Machine(self.device, self.precision, self.deterministic)

    @contextmanager
    def logged(self) -> Iterator["FitContext"]:
        """Give a context whose progress goes to the logs too, while the block runs."""
        if self.logs is None:
            yield self
            return
        from magsim.training.logs import open_logs

        folder = Path(self.logs)
        with open_logs(folder / LOG, folder / EVENTS if self.tensorboard else None) as log:
            shown = self.progress

            def report(progress: Any) -> None:
                log(progress)
                if shown is not None:
                    shown(progress)

            yield replace(self, progress=report)

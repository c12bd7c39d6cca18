"""Windows of thousands of flights for torch: shuffled by seed, read from files of any size, resumed in mid-epoch.

The order of an epoch depends on the seed, the number of the epoch and the files alone. Files are shuffled and gathered
into blocks; the windows of a block are shuffled together, and batches run on from block to block. A worker makes every
n-th batch of that order, so that their number changes nothing, and reads windows where they lie: the system's
cache of files holds a block once for all workers.
"""

import hashlib
import json
import math
import mmap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor
from torch.utils.data import DataLoader, IterableDataset, get_worker_info

from magsim import columns
from magsim.dataset import Dataset, files_of
from magsim.errors import RequestError
from magsim.recording.places import Places, find_places
from magsim.recording.windows import Windows, codes_of
from magsim.storage import inspection
from magsim.streams import stream

BLOCK_MB = 1000.0
"""Size of the files whose windows are shuffled together [MB]."""

_TOGETHER = 50  # files that share one start of the process that inspects them

Batch = tuple[Tensor, Tensor]
"""Inputs and targets, (batch, c, rows) each."""


class Position(NamedTuple):
    """Where an epoch stands: the windows before ``window`` of a block, and all blocks before, are done."""

    epoch: int
    block: int = 0
    window: int = 0


class WindowDataset(IterableDataset[Batch]):
    """Batches of windows of recordings, for ``torch.utils.data.DataLoader`` with ``batch_size=None``.

    ``WindowLoader`` is a DataLoader that counts epochs and resumes. Nothing is opened before the first batch: each
    process checks a file when it comes to it, or ``count`` does so for all files and all workers that start later.

    Parameters
    ----------
    data : Dataset, Path, str, or several
        Data sets, folders, recording files.
    rows : int
        Rows of a window.
    inputs, targets : sequence of str, optional
        Columns, each of one role; by default all inputs, and all labels.
    splits : sequence of str, optional
        Windows whose rows all have one of these splits; None for all windows.
    stride : int, optional
        Rows between the beginnings of two windows; ``rows`` by default, so that an epoch has each row once.
    batch : int
        Windows of a batch.
    seed : int
        Of the order.
    shuffle : bool
        Whether to shuffle; else the order is that of the files.
    block_mb : float [MB]
        Size of the files whose windows are shuffled together: the cache of files must hold as much.
    drop_last : bool
        Leave out a last batch that is not full.
    standardize : mapping of str to (float, float), optional
        Mean and scale of columns: (value - mean) / scale, in float64, before values are rounded to float32, whose step
        is 0.004 nT at 50 000 nT.

    Raises
    ------
    RequestError
        If there is no such file, a list has columns of two roles or an unknown one, or a number is not allowed.
    ValueError
        If there is no such split.
    """

    def __init__(
        self,
        data: Dataset | Path | str | Iterable[Dataset | Path | str],
        *,
        rows: int,
        inputs: Sequence[str] | None = None,
        targets: Sequence[str] | None = None,
        splits: Sequence[str] | None = ("train",),
        stride: int | None = None,
        batch: int = 256,
        seed: int = 0,
        shuffle: bool = True,
        block_mb: float = BLOCK_MB,
        drop_last: bool = False,
        standardize: Mapping[str, tuple[float, float]] | None = None,
    ) -> None:
        stride = rows if stride is None else stride
        for name, value, least in (("rows", rows, 1), ("stride", stride, 1), ("batch", batch, 1), ("seed", seed, 0)):
            if isinstance(value, bool) or not isinstance(value, int) or value < least:
                msg = f"{name} {value!r} is not allowed; allowed: a whole number of {least} or more"
                raise RequestError(msg)
        if not block_mb > 0.0:
            msg = f"block_mb {block_mb!r} is not allowed; allowed: a number above 0"
            raise RequestError(msg)
        self.files = files_of(data)
        self.rows, self.stride, self.batch, self.seed, self.shuffle = rows, stride, batch, seed, shuffle
        self.drop_last, self.block_mb = drop_last, block_mb
        self.columns = (_one_role(inputs, "input"), _one_role(targets, "label"))
        self.standardize = _scales(standardize or {})
        self._codes = codes_of(splits)
        self._sizes = np.array([path.stat().st_size for path in self.files])
        self._places: dict[int, Places] = {}
        # in shared memory, so that workers that stay alive see where an epoch starts
        self._start = torch.zeros(3, dtype=torch.int64).share_memory_()
        about = {
            "files": [[path.name, size] for path, size in zip(self.files, self._sizes.tolist(), strict=True)],
            "order": [rows, stride, batch, seed, shuffle, block_mb, drop_last, None if splits is None else [*splits]],
        }
        self.identity = hashlib.sha256(json.dumps(about).encode()).hexdigest()

    def start_at(self, position: Position) -> None:
        """Set where the next iteration starts, in this process and in workers."""
        self._start.copy_(torch.tensor(position))

    def set_epoch(self, epoch: int) -> None:
        """Set the epoch of the next iteration."""
        self.start_at(Position(epoch))

    def count(self) -> int:
        """Open every file, and return the number of windows of an epoch.

        Workers that are started later need not open the files again.
        """
        numbers = range(len(self.files))
        return sum(len(self._windows(numbers[at : at + _TOGETHER])[0]) for at in numbers[::_TOGETHER])

    def __iter__(self) -> Iterator[Batch]:
        return (batch for _, batch in self.batches())

    def batches(self) -> Iterator[tuple[Position, Batch]]:
        """Iterate over the batches of an epoch that this process makes, each with the position after it."""
        worker = get_worker_info()
        share, shares = (0, 1) if worker is None else (worker.id, worker.num_workers)
        return self._batches(Position(*self._start.tolist()), share, shares)

    def _batches(self, start: Position, share: int, shares: int) -> Iterator[tuple[Position, Batch]]:
        number, filled, made = 0, 0, False
        batch = _Batch(self)
        for block, files in enumerate(self.blocks(start.epoch)):
            if block < start.block:
                continue
            sources = self._windows(files)
            order = self._order(start.epoch, block, len(sources[0]))
            done = start.window if block == start.block else 0
            while done < len(order):
                count = min(self.batch - filled, len(order) - done)
                if number % shares == share:
                    batch.fill(sources, order[done : done + count], filled)
                done, filled, made = done + count, filled + count, True
                if filled == self.batch:
                    if number % shares == share:
                        yield Position(start.epoch, block, done), batch.take(filled)
                    number, filled = number + 1, 0
        if filled and not self.drop_last and number % shares == share:
            yield Position(start.epoch, block, done), batch.take(filled)
        if not made and start == Position(start.epoch):
            msg = f"no flight of {', '.join(map(str, self.files[:3]))} has a window of {self.rows} rows of these splits"
            raise RequestError(msg)

    def blocks(self, epoch: int) -> list[list[int]]:
        """Return the numbers of the files of each block of an epoch."""
        numbers = np.arange(len(self.files))
        if self.shuffle:
            stream(self.seed, f"windows/{epoch}/files").shuffle(numbers)
        ends = np.cumsum(self._sizes[numbers]) / (self.block_mb * 1e6)
        cuts = np.flatnonzero(np.diff(np.floor(ends - 1e-9))) + 1
        return [part.tolist() for part in np.split(numbers, cuts)]

    def _order(self, epoch: int, block: int, count: int) -> np.ndarray:
        order = np.arange(count, dtype=np.int32 if count < 2**31 else np.int64)
        if self.shuffle:
            stream(self.seed, f"windows/{epoch}/{block}").shuffle(order)
        return order

    def _windows(self, files: Sequence[int]) -> tuple[Windows, Windows]:
        """Return the windows of inputs and targets of some files, which are opened if they have not been."""
        new = [number for number in files if number not in self._places]
        inspection.inspect_many([self.files[number] for number in new])
        roles = tuple(dict.fromkeys(role for role, _ in self.columns))
        for number in new:
            found = find_places(self.files[number], roles, self._codes)
            # names of flights and columns would be most of what is kept of each file
            first = next(iter(self._places.values()), found).channels
            channels = first if first == found.channels else found.channels
            self._places[number] = replace(found, flights=(), channels=channels)
        places = [self._places[number] for number in files]
        inputs, targets = (
            Windows.at(places, rows=self.rows, role=role, names=names, stride=self.stride)
            for role, names in self.columns
        )
        unknown = self.standardize.keys() - {*inputs.names, *targets.names}
        if unknown:
            msg = f"standardize: the windows have no column {min(unknown)}"
            raise RequestError(msg)
        return inputs, targets


def _scales(standardize: Mapping[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
    for name, (mean, scale) in standardize.items():
        if not (np.isfinite(mean) and np.isfinite(scale) and scale != 0.0):
            msg = f"standardize: mean {mean!r}, scale {scale!r} of {name} are not allowed; allowed: finite, scale not 0"
            raise RequestError(msg)
    return dict(standardize)


class _Batch:
    """The batch that is being filled."""

    def __init__(self, dataset: WindowDataset) -> None:
        self._dataset = dataset
        self._tensors: list[Tensor] = []
        self._exact: dict[int, np.ndarray] = {}

    def fill(self, sources: Sequence[Windows], indices: np.ndarray, at: int) -> None:
        """Copy windows to a place of the batch."""
        size = self._dataset.batch
        if not self._tensors:
            self._tensors = [_mapped_tensor(size, len(source.names), source.rows) for source in sources]
        for number, (source, tensor) in enumerate(zip(sources, self._tensors, strict=True)):
            out = tensor.numpy()[at : at + len(indices)].transpose(0, 2, 1)
            scales = [self._dataset.standardize.get(name, (0.0, 1.0)) for name in source.names]
            if any(scale != (0.0, 1.0) for scale in scales):
                mean, scale = np.array(scales).T
                if number not in self._exact:
                    self._exact[number] = np.empty((size, source.rows, len(source.names)))
                exact = source.take(indices, self._exact[number][: len(indices)])
                exact -= mean
                exact /= scale
                out[...] = exact
            else:
                source.take(indices, out)

    def take(self, count: int) -> Batch:
        """Return the filled part, and begin anew."""
        inputs, targets = (tensor[:count] for tensor in self._tensors)
        self._tensors = []
        return inputs, targets


def _mapped_tensor(*shape: int) -> Tensor:
    """Return a float32 tensor in memory of its own, which goes back to the system with it.

    On the heap, arrays of some MB that come and go among small ones that stay leave holes: 200 MB in an epoch of 1000
    flights.
    """
    memory = mmap.mmap(-1, 4 * math.prod(shape))
    return torch.frombuffer(memory, dtype=torch.float32).view(shape)


def _one_role(names: Sequence[str] | None, default: str) -> tuple[str, tuple[str, ...] | None]:
    """Return the role of columns, and the columns; None for all."""
    if names is None:
        return default, None
    try:
        roles = {columns.role_of(name) for name in names}
    except KeyError as error:
        msg = f"windows have no column {error.args[0]}"
        raise RequestError(msg) from None
    if len(roles) != 1:
        found = ", ".join(sorted(roles)) or "none"
        msg = f"the columns {', '.join(names) or '(none is named)'} are of roles {found}; allowed: columns of one role"
        raise RequestError(msg)
    return roles.pop(), tuple(names)


class _Placed(IterableDataset[tuple[Position, Batch]]):
    """The batches of a data set, each with the position after it."""

    def __init__(self, dataset: WindowDataset) -> None:
        self.windows = dataset

    def __iter__(self) -> Iterator[tuple[Position, Batch]]:
        return self.windows.batches()


class WindowLoader(DataLoader[Any]):
    """A DataLoader of windows that counts epochs and resumes in the middle of one.

    Each ``for`` over it is an epoch in an order of its own, the same for any number of workers.

    Parameters
    ----------
    windows : WindowDataset
    workers : int
        Processes that read; 0 reads in this one. They stay alive from epoch to epoch.
    options
        Of ``torch.utils.data.DataLoader``: ``pin_memory``, ``multiprocessing_context``, ``prefetch_factor``, ...

    Attributes
    ----------
    position : Position
        What has been handed out.
    """

    def __init__(self, windows: WindowDataset, *, workers: int = 0, **options: Any) -> None:
        self.windows = windows
        self.position = Position(0)
        self._resumed = True
        # a generator of its own, so that no epoch draws from torch's global one
        options = {"persistent_workers": workers > 0, "generator": torch.Generator().manual_seed(0), **options}
        super().__init__(_Placed(windows), batch_size=None, num_workers=workers, **options)

    def __iter__(self) -> Iterator[Batch]:  # type: ignore[override]  # the counting iterator, not torch's own
        if not self._resumed:
            self.position = Position(self.position.epoch + 1)
        self._resumed = False
        self.windows.start_at(self.position)
        return self._hand_out(super().__iter__())

    def _hand_out(self, source: Iterator[tuple[Position, Batch]]) -> Iterator[Batch]:
        for position, batch in source:
            self.position = Position(*position)
            yield batch
        self.position = Position(self.position.epoch + 1)
        self._resumed = True

    def state_dict(self) -> dict[str, Any]:
        """Return what has been handed out: text and whole numbers, for a checkpoint."""
        return {"windows": self.windows.identity, **self.position._asdict()}

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Continue after what had been handed out when ``state_dict`` was called.

        Raises
        ------
        RequestError
            If the state is of other files, another seed or another order.
        """
        if state.get("windows") != self.windows.identity:
            msg = "the state of the windows is of other files, or of another seed, batch or order"
            raise RequestError(msg)
        self.position = Position(*(int(state[name]) for name in Position._fields))
        self._resumed = True

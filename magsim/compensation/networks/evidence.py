"""What a network does on rows that it has not learned, and how much of it to use.

A network that was trained on a few minutes of one flight may fit what will not come again: a pump that happened to run
on a leg, the course of a diurnal. Least squares of what the stage leaves on what networks estimate of rows that they
have not seen gives the share that holds (stacked regression; Breiman, Machine Learning 24, 1996). Its error is that of
the jackknife over legs, and the share is shrunk by it (positive-part James-Stein), so that a network without evidence
is not used at all.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from torch import nn

from magsim import signals
from magsim.compensation.networks.fitted import Fitted
from magsim.compensation.networks.folds import Watched, runs
from magsim.errors import DataError
from magsim.signals import in_band

LEAST_UNITS = 3
"""Fewest runs of rows that a jackknife is taken over; fewer are cut into parts of ``PART_S``."""

PART_S = 30.0


class Unit(NamedTuple):
    """A run of judged rows in band: what the stage leaves, and what the network says [nT]."""

    rest: np.ndarray
    output: np.ndarray


class Part(NamedTuple):
    """Rows that judge, of one recording: times (n,) [s], inputs (n, c), what the stage leaves (n,) [nT].

    ``numbers`` (n,) is that of the run of each judged row, -1 in others.
    """

    time_s: np.ndarray
    inputs: np.ndarray
    rest: np.ndarray
    numbers: np.ndarray

    @classmethod
    def of(cls, fitted: Fitted, watched: Watched, sensor: str) -> "Part":
        """Return the rows of a recording that judge."""
        recording = watched.recording
        return cls(recording.time_s, fitted.inputs(recording), fitted.rest(recording, sensor), _units(watched, sensor))


class Judge:
    """Judges networks by rows, in band.

    Parameters
    ----------
    fitted : Fitted
        Stage and scales; networks may be trained further.
    parts : iterable of Part
        Gone through for every judgement.
    """

    def __init__(self, fitted: Fitted, parts: Iterable[Part]) -> None:
        self._fitted, self._parts = fitted, parts

    def units(self, module: nn.Module) -> list[Unit]:
        """Return the judged rows of a network, run by run.

        Raises
        ------
        DataError
            If none is left after warm-up and edges.
        """
        found = []
        for time_s, inputs, rest, numbers in self._parts:
            out = self._fitted.scale * self._fitted.output(module, inputs, time_s)
            known = np.isfinite(out)
            judged = numbers[known] >= 0
            if known.sum() < 2 or not judged.any():
                continue
            # rows beside what is judged are filtered with it, so that a block needs no cropping
            band = in_band(np.column_stack([rest, out])[known], time_s[known], judged)
            kept = numbers[known][signals.in_band_rows(time_s[known], judged)]
            found += [Unit(*band[kept == number].T) for number in np.unique(kept)]
        if not found:
            msg = (
                "no row to stop training by is left after the warm-up and the 30 s that the band-pass spoils at "
                "each end of a piece"
            )
            raise DataError(msg)
        return found

    def value(self, module: nn.Module) -> float:
        """Return the in-band STD of the error [nT] of as much of a network's output as serves best.

        A network that has found what is left, too loudly as yet, is on its way.
        """
        units = self.units(module)
        rest, output = (np.concatenate(parts) for parts in zip(*units, strict=True))
        share = 1.0
        if self._fitted.settings.shrink:
            square = np.einsum("n,n->", output, output)
            share = float(np.clip(np.einsum("n,n->", rest, output) / square, 0.0, 1.0)) if square > 0.0 else 0.0
        return float((rest - share * output).std())


def _units(watched: Watched, sensor: str) -> np.ndarray:
    """Return the number of the run of each judged row, -1 elsewhere."""
    recording, rows = watched
    numbers = np.full(len(recording), -1)
    found = runs(rows)
    for number, run in enumerate(found):
        numbers[run] = number
    if len(found) < LEAST_UNITS:
        numbers = np.where(rows, thirties(recording.time_s), -1)
    return np.where(recording.reads(sensor), numbers, -1)


def thirties(time_s: np.ndarray) -> np.ndarray:
    """Return the number of the part of ``PART_S`` of each row, from 0."""
    return np.floor((time_s - time_s[0]) / PART_S).astype(int)


def share_of(units: Sequence[Unit]) -> float:
    """Return how much of the networks' output to use, 0 to 1.

    Parameters
    ----------
    units : sequence of Unit
        Of rows that the networks have not learned.
    """
    products = np.array([np.einsum("n,n->", unit.rest, unit.output) for unit in units])
    squares = np.array([np.einsum("n,n->", unit.output, unit.output) for unit in units])
    if squares.sum() == 0.0 or products.sum() <= 0.0 or len(units) < 2:
        return 0.0
    share = products.sum() / squares.sum()
    left = squares.sum() - squares
    without = (products.sum() - products) / np.where(left > 0.0, left, np.inf)
    variance = (len(units) - 1) / len(units) * np.sum((without - without.mean()) ** 2)
    return float(np.clip(share * max(0.0, 1.0 - variance / share**2), 0.0, 1.0))

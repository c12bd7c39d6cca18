"""Training on flights that each have a first stage of their own, on any number of them: a start for others.

Many individuals and days have no first stage in common: what the stage of each leaves is what a network can learn from
all of them. Flights are read one at a time, and what the network reads and is to learn is kept on disk
(``magsim.compensation.networks.spooling``); random windows are read from there. One part of the flights, days or
aircraft is held out as a whole, and the weights that serve best on it are kept.
"""

from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from magsim.compensation.base import FitContext
from magsim.compensation.networks.descent import Errand, descend
from magsim.compensation.networks.evidence import Judge, Part, share_of, thirties
from magsim.compensation.networks.fitted import Fitted
from magsim.compensation.networks.folds import key_of, numbered
from magsim.compensation.networks.settings import NetworkSettings
from magsim.compensation.networks.spooling import SpooledFlight, SpooledFlights
from magsim.compensation.networks.starting import ModuleFactory, checkpoint_of, is_trained, new_module, started_from
from magsim.dataset import Training
from magsim.errors import DataError
from magsim.signals.filters import EDGE_S
from magsim.streams import integer_seed
from magsim.training import Outcome, SpooledWindows

MOST_JUDGED = 200_000
"""About how many rows judge: at 10 Hz five hours and a half."""

STRETCH_S = 300.0
"""Shortest stretch of a flight that judges where not all rows do: 30 s at each end are lost."""


def pretrain(
    settings: NetworkSettings,
    module_factory: ModuleFactory,
    training: Training,
    context: FitContext,
    *,
    identity: Mapping[str, object] | None = None,
) -> tuple[Fitted, dict[str, Outcome]]:
    """Fit a first stage to each flight, and one network to what they leave.

    Parameters
    ----------
    settings : NetworkSettings
        With ``stage_for="flight"``.
    module_factory : callable
    training : Training
        Each of its recordings is asked for once.
    context : FitContext
    identity : mapping, optional
        What a checkpoint belongs to beside settings, seed and data: name and parameters of the method.

    Returns
    -------
    Fitted
    dict of str to Outcome
        Result of the run: ``fold 1``, or ``all`` with ``folds=0``.

    Raises
    ------
    RequestError
        If flights differ in their inputs, are all of one group, or a setting does not fit; if the disk is full.
    DataError
        If a flight is too short, of another rate or not finite, or training diverges.
    """
    with SpooledFlights(settings, training.sensor, _disk_of(context.checkpoint)) as spooled:
        for number in range(len(training.recordings)):
            group = key_of(training, number, settings.hold_out) if settings.folds else None
            spooled.add(training.recordings[number], group)
        module = new_module(settings, module_factory, spooled.names, context.seed)
        fitted = started_from(spooled.fitted(module), context)
        learned, watched, phase = spooled.flights, spooled.flights, "all"
        if settings.folds:
            phase = "fold 1"
            learned, watched = _divided(spooled.flights, settings)
        judge = Judge(fitted, SpooledParts(spooled, fitted, watched))
        errand = Errand(
            settings.steps,
            judge.value,
            phase,
            integer_seed(context.seed, f"compensation/{phase}/batches"),
            context.progress,
            checkpoint_of(
                context,
                phase,
                {**(identity or {}), "settings": asdict(settings), "steps": settings.steps},
                fitted.module,
                _contents(spooled, fitted, learned),
            ),
            context.machine,
        )
        trained = deepcopy(fitted.module)
        outcome = descend(settings, trained, SpooledLesson(spooled, fitted, learned), errand)
        share = 1.0
        if settings.folds:
            share = (
                share_of(judge.units(trained))
                if settings.shrink
                else float(outcome.best_step > 0 or is_trained(context))
            )
    return replace(fitted, module=trained, weight=share), {phase: outcome}


@dataclass(frozen=True)
class SpooledLesson:
    """What a network learns from, on disk; see ``descent.Lesson``."""

    spooled: SpooledFlights
    fitted: Fitted
    flights: Sequence[SpooledFlight]

    @property
    def rate_hz(self) -> float:
        """Rows a second."""
        return self.fitted.rate_hz

    def sources(self, rows: int) -> list[SpooledWindows]:
        """Return windows of inputs and of targets; see ``descent.Lesson``."""
        spooled, fitted = self.spooled, self.fitted
        pieces = [piece for flight in self.flights for piece in flight.pieces]
        return [
            SpooledWindows(spool, pieces, rows=rows, shift=to.shift, scale=to.scale)
            for spool, to in (
                (spooled.inputs, spooled.input_scales(fitted)),
                (spooled.targets, spooled.target_scales(fitted)),
            )
        ]

    def band_variance(self) -> float:
        """Return the variance of the standardized rest in band; see ``descent.Lesson``."""
        total = self.flights[0].in_band
        for flight in self.flights[1:]:
            total += flight.in_band
        if not total.count:
            msg = "no training piece is longer than the 60 s that the band-pass spoils"
            raise DataError(msg)
        return float(total.variance[0]) / self.fitted.scale**2


@dataclass(frozen=True)
class SpooledParts:
    """Rows that judge, read from disk each time that they are gone through; ``evidence.Part`` of each stretch."""

    spooled: SpooledFlights
    fitted: Fitted
    flights: Sequence[SpooledFlight]

    def __iter__(self) -> Iterator[Part]:
        rate_hz, spooled = self.fitted.rate_hz, self.spooled
        pieces = [piece for flight in self.flights for piece in flight.pieces]
        inputs_to, targets_to = spooled.input_scales(self.fitted), spooled.target_scales(self.fitted)
        lost = round(2.0 * EDGE_S * rate_hz) + (self.fitted.settings.context or 1)
        for first, rows in spread(pieces, MOST_JUDGED, round(STRETCH_S * rate_hz), lost):
            inputs = spooled.inputs.read(first, np.empty((rows, spooled.inputs.columns), np.float32))
            targets = targets_to(spooled.targets.read(first, np.empty((rows, spooled.targets.columns), np.float32)))
            time_s = np.arange(rows) / rate_hz
            rest = targets[:, 0].astype(float) * self.fitted.scale
            yield Part(time_s, inputs_to(inputs), rest, np.where(targets[:, -1] > 0.0, thirties(time_s), -1))


def spread(pieces: Sequence[tuple[int, int]], most: int, stretch: int, lost: int) -> list[tuple[int, int]]:
    """Choose stretches of pieces, as evenly as can be.

    Parameters
    ----------
    pieces : sequence of (int, int)
        First row and number of rows.
    most : int
        Rows together; all of them if they are no more.
    stretch : int
        Least rows of a stretch, where its piece has as many.
    lost : int
        Rows that are of no use at the ends of a stretch: shorter pieces are left out.

    Returns
    -------
    list of (int, int)
        First row and number of rows of each stretch: equally long, from pieces at equal distances in their order, and
        from all parts of them.
    """
    useful = [piece for piece in pieces if piece[1] > lost]
    if sum(rows for _, rows in useful) <= most:
        return useful
    count = max(min(len(useful), most // stretch), 1)
    chosen = [useful[number] for number in np.linspace(0, len(useful) - 1, count).round().astype(int)]
    found, left = [], most
    for number, (first, rows) in enumerate(chosen):
        taken = min(rows, left // (count - number))
        left -= taken
        # steps of the golden ratio reach the beginnings, middles and ends of pieces evenly, however many there are
        place = (0.5 + number * (5.0**0.5 - 1.0) / 2.0) % 1.0
        found.append((first + int(place * (rows - taken + 1)), taken))
    return found


def _divided(
    flights: Sequence[SpooledFlight], settings: NetworkSettings
) -> tuple[list[SpooledFlight], list[SpooledFlight]]:
    """Return the flights that are learned, and those that are held out: every ``folds``-th group."""
    groups = numbered([flight.group for flight in flights], settings.hold_out, "folds = 0, or more of them")
    folds = min(settings.folds, max(groups) + 1)
    pairs = list(zip(flights, groups, strict=True))
    return [f for f, group in pairs if group % folds], [f for f, group in pairs if group % folds == 0]


def _contents(spooled: SpooledFlights, fitted: Fitted, learned: Sequence[SpooledFlight]) -> Iterator[bytes]:
    """Give what tells the data of a run from others: rows, scales, and which flights are learned."""
    for spool in (spooled.inputs, spooled.targets):
        yield spool.digest.encode()
    for scales in (spooled.input_scales(fitted), spooled.target_scales(fitted)):
        yield scales.shift.tobytes() + scales.scale.tobytes()
    yield repr([flight.pieces for flight in learned]).encode()


def _disk_of(checkpoint: Path | None) -> Path | None:
    """Return the folder of a run, where its state is to be, or the next above that is there; None without one."""
    if checkpoint is None:
        return None
    return next((folder for folder in Path(checkpoint).absolute().parents if folder.is_dir()), None)

"""How a fitted method is scored on the test rows of a recording: by the judge of the package, and no other way."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from magsim import columns, signals
from magsim.benchmark import Residuals, judge
from magsim.benchmark.formulas import anomaly_gain, std
from magsim.compensation import Compensator, make
from magsim.dataset import pieces_to_judge
from magsim.recording import Recording
from tests.benchmarks.physics_rows.methods import PeerMethod

OURS, WHOLE, NO_LOOKAHEAD = "exact_norm", "exact_norm_whole", "exact_norm_causal"
UNLABELED, PEER = "exact_norm_model", "peer"
PLAIN, CALIBRATED, AUXILIARY = "tl16", "tl16_calibrated", "tl16_auxiliary"

SIGMAS = 1.959963984540054
"""Standard errors on both sides of a 95 % interval."""


@dataclass(frozen=True)
class Score:
    """What a method leaves in band [nT], and what its fit took [s of one core].

    ``people_nt`` is the noise floor with what people who move in their seats add: no instrument sees them.
    """

    std_nt: float
    raw_nt: float
    floor_nt: float
    people_nt: float
    gain: float
    fit_s: float
    covered: float = float("nan")

    @cached_property
    def ir(self) -> float:
        """Improvement ratio against truth."""
        return self.raw_nt / self.std_nt

    @cached_property
    def excess_pt(self) -> float:
        """What is left beyond the noise floor [pT]."""
        return 1000.0 * float(np.sqrt(max(self.std_nt**2 - self.floor_nt**2, 0.0)))


def fitted(name: str, flights: Sequence[Recording], sensor: str | None = None) -> tuple[Compensator, float]:
    """Fit a method by name to flights; return it, and the processor time of the fit [s]."""
    method: Compensator = PeerMethod() if name == PEER else make(name)
    began = time.process_time()
    method.fit(list(flights), sensor=sensor)
    return method, time.process_time() - began


def score(
    method: Compensator,
    recording: Recording,
    fit_s: float = 0.0,
    *,
    covered: bool = False,
    warmup_s: float | None = None,
) -> Score:
    """Judge a fitted method on the test rows of a recording; with its coverage where that is asked for.

    ``warmup_s`` [s] is that of another method that is judged on the same rows; by default the method's own.
    """
    warmup_s = method.warmup_s if warmup_s is None else warmup_s
    found = judge(method, recording, warmup_s=warmup_s)
    sensor = method.sensor_
    floor_nt = _left(judge(None, recording, sensor=sensor, warmup_s=warmup_s))
    people_nt = _left(judge(None, _seated(recording, sensor), sensor=sensor, warmup_s=warmup_s))
    share = coverage(method, recording) if covered else float("nan")
    assert found.interference is not None
    return Score(_left(found), std(found.interference), floor_nt, people_nt, anomaly_gain(found), fit_s, share)


def _seated(recording: Recording, sensor: str) -> Recording:
    """Return the recording with the label that it would have if people sat still: the reading stays as it is."""
    if columns.PART.name(component="crew", sensor=sensor, axis="x") not in recording:
        return recording
    parts = {
        name: recording.vector(columns.PART, component=name, sensor=sensor)
        for name in columns.COMPONENTS
        if columns.PART.name(component=name, sensor=sensor, axis="x") in recording
    }
    total = sum(parts.values())
    moved = np.linalg.norm(total, axis=1) - np.linalg.norm(total - parts["crew"], axis=1)
    label = columns.INTERFERENCE.name(sensor=sensor)
    return replace(recording, data={**recording.data, label: recording[label] - moved})


def _left(residuals: Residuals) -> float:
    assert residuals.error is not None
    return std(residuals.error)


def coverage(method: Compensator, recording: Recording) -> float:
    """Return the share of test rows in whose 95 % interval the noise-free interference lies, in band.

    ``Compensator.uncertainty`` is the error of the estimate without the noise of the reading, and so is the error here.
    """
    inside = []
    for piece in pieces_to_judge(recording, method.sensor_):
        whole = piece.whole
        label = whole[columns.INTERFERENCE.name(sensor=method.sensor_)]
        error = signals.band_pass(label - method.interference(whole), whole.rate_hz)
        bound = SIGMAS * method.uncertainty(whole)
        inside.append((np.abs(error) <= bound)[piece.judged & signals.off_ends(whole.time_s)])
    return float(np.mean(np.concatenate(inside)))

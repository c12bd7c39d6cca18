"""The exact norm that goes on learning in flight: the permanent field of the day."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from magsim import columns, signals
from magsim.compensation.base import FitContext
from magsim.compensation.exact_norm.estimation import exact_interference, jacobian_of
from magsim.compensation.exact_norm.method import ExactNorm
from magsim.compensation.exact_norm.streaming import AdaptiveStreamer, ExactNormRows
from magsim.compensation.recursive.adaptation import Adaptation, CausalBand, Known
from magsim.compensation.saving import State
from magsim.compensation.streaming import Feed
from magsim.compensation.targets import reading_rows
from magsim.dataset import Training
from magsim.errors import DataError
from magsim.recording import Recording

Seconds = Annotated[float, Field(gt=0.0, le=1e7)]

_DIGITS = 6
"""Of the rate, so that the times of a recording and the rate of a stream give the same filter."""


class ExactNormAdaptive(ExactNorm):
    """The exact norm, with a change of the permanent field that is learned from the reading while it flies.

    Magnets are what changes from day to day. Three numbers follow the flight, by least squares with bounded memory
    (``magsim.compensation.recursive.adaptation``); the rest stays as it was fitted. It needs the reading, so it
    declares it.

    Parameters
    ----------
    forgetting_s : float [s]
        Time in which what was learned in flight loses its weight by e.
    anchor_s : float [s]
        Seconds of flight that the training counts as, for ever. 60 s follow another day much faster, and take some
        percent more of steep anomalies.

    The settings of ``ExactNorm`` have their defaults.
    """

    name = "exact_norm_adaptive"
    adapts = True

    def __init__(self, *, forgetting_s: Seconds = 600.0, anchor_s: Seconds = 700.0) -> None:
        super().__init__()
        self.forgetting_s = forgetting_s
        self.anchor_s = anchor_s

    @property
    def requires(self) -> tuple[str, ...]:  # type: ignore[override]
        """What the exact norm reads, and the reading."""
        return (*super().requires, columns.MAG.pattern)

    def learn(self, training: Training, context: FitContext) -> None:
        """Fit, and keep how well the direction of the field was varied; see ``Compensator.learn``."""
        super().learn(training, context)
        self._reading = columns.MAG.name(sensor=training.sensor)
        parts: list[np.ndarray] = []
        for recording in reading_rows(training.recordings, training.sensor):
            band = CausalBand(round(recording.rate_hz, _DIGITS))
            table = self._misfits(recording)
            pieces = [table[span] for span in signals.spans(recording.time_s)]
            parts += [band(piece)[band.settling_rows :] for piece in pieces if len(piece) > band.settling_rows]
        if not parts:
            msg = f"no piece without a gap is longer than the {signals.EDGE_S:g} s that the causal band-pass spoils"
            raise DataError(msg)
        rows = np.concatenate(parts)
        self._known = Known.of(rows[:, :3], rows[:, 3], np.zeros(3))

    def _misfits(self, recording: Recording) -> np.ndarray:
        """Return the direction of the field and the compensated reading, (n, 4)."""
        driven, at = self._sources(recording), self._found.coefficients
        direction = jacobian_of(driven, at)[:, :3]  # the first signal is constant
        return np.column_stack([direction, recording[self._reading] - exact_interference(driven, at)])

    def estimate(self, recording: Recording) -> np.ndarray:
        """Return the estimate as a stream makes it, (n,) [nT]; no warm-up."""
        streamer = self._streamer(Feed(recording.rate_hz, start_utc=_start(recording)))
        table = recording.stack(streamer.columns)
        out: list[float] = []
        for span in signals.spans(recording.time_s):
            found = [streamer.push(values) for values in table[span]]
            out += [one for one in found if one is not None]
            out += streamer.finish()
        return np.array(out)

    def _streamer(self, feed: Feed) -> AdaptiveStreamer:
        feed = replace(feed, rate_hz=round(feed.rate_hz, _DIGITS))
        rows = ExactNormRows(self._sources, self._found.coefficients, feed)
        adaptation = Adaptation(self._known, feed.rate_hz, forgetting_s=self.forgetting_s, anchor_s=self.anchor_s)
        return AdaptiveStreamer(rows, self._reading, adaptation, self._offset_nt)

    def _shares(self, recording: Recording) -> dict[str, np.ndarray]:
        fixed = super()._shares(recording)
        return {**fixed, "learned in flight": self.estimate(recording) - sum(fixed.values())}

    def state(self) -> State:
        """Return that of the fit, and what the flight begins with; see ``Compensator.state``."""
        fitted = super().state()
        values = {**fitted.values, "reading": self._reading, "deviation_nt": self._known.deviation_nt}
        return State(values, {**fitted.arrays, "scale": self._known.scale, "products": self._known.products})

    def set_state(self, state: State) -> None:
        """Take back what ``state`` returned."""
        super().set_state(state)
        values: Mapping[str, Any] = state.values
        scale, products = (np.asarray(state.arrays[name], dtype=float) for name in ("scale", "products"))
        if scale.shape != (3,) or products.shape != (3, 3):
            msg = f"scales of shape {scale.shape} and products of shape {products.shape} for 3 components"
            raise ValueError(msg)
        self._reading = str(values["reading"])
        self._known = Known(np.zeros(3), scale, products, float(values["deviation_nt"]))


def _start(recording: Recording) -> str | None:
    start = recording.meta.get("start_utc")
    return None if start is None else str(start)

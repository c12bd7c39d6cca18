"""Recursive Tolles-Lawson: fitted like ``tl16``, and followed in flight."""

from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from magsim import signals
from magsim.columns import FLUX, MAG
from magsim.compensation.base import FitContext
from magsim.compensation.column_rows import rows_of
from magsim.compensation.linear import OFFSET
from magsim.compensation.recursive.adaptation import Adaptation, CausalBand, Known
from magsim.compensation.recursive.streamer import RecursiveStreamer
from magsim.compensation.saving import State
from magsim.compensation.streaming import Feed, Streamer
from magsim.compensation.targets import TargetName, reading_rows
from magsim.compensation.tolles_lawson import Positive, TollesLawson
from magsim.dataset import Training
from magsim.errors import DataError
from magsim.recording import Recording

Seconds = Annotated[float, Field(gt=0.0, le=1e7)]

_DIGITS = 6
"""Of the rate, so that the times of a recording and the rate of a stream give the same filter."""


class RecursiveTollesLawson(TollesLawson):
    """Tolles-Lawson with 16 terms whose coefficients follow the flight, by least squares with bounded memory.

    It is fitted like ``tl16``. In flight it looks at the reading that it compensates, in band and causally, and solves
    after each row for the change of the coefficients; see ``magsim.compensation.recursive.adaptation``.

    Parameters
    ----------
    adapt : bool
        Follow the flight. Otherwise it is ``tl16``, and reads no scalar magnetometer.
    forgetting_s : float [s]
        Time in which what was learned in flight loses its weight by e.
    anchor_s : float [s]
        Seconds of flight that the training counts as, for ever: less follows faster, and takes more of an anomaly.
    target, solver, fluxgate, scale, order, vertical
        See ``TollesLawson``.
    map, map_height_m, crossing_m, crossing_height_m, reference, reference_model
        Of the targets of these names; see ``targets.choice.Targeted``.
    """

    name = "tl16_recursive"

    def __init__(
        self,
        *,
        adapt: bool = True,
        forgetting_s: Seconds = 600.0,
        anchor_s: Seconds = 60.0,
        target: TargetName = "interference",
        solver: Literal["ridge", "least_squares", "truncated_svd"] = "ridge",
        fluxgate: str | None = None,
        scale: Literal["constant", "sample"] = "constant",
        order: Annotated[int, Field(ge=0, le=4)] = 0,
        vertical: bool = False,
        map: str | None = None,
        map_height_m: float | None = None,
        crossing_m: Positive = None,
        crossing_height_m: Positive = None,
        reference: str | None = None,
        reference_model: str | None = None,
    ) -> None:
        super().__init__(
            target=target,
            solver=solver,
            fluxgate=fluxgate,
            scale=scale,
            order=order,
            vertical=vertical,
            map=map,
            map_height_m=map_height_m,
            crossing_m=crossing_m,
            crossing_height_m=crossing_height_m,
            reference=reference,
            reference_model=reference_model,
        )
        self.adapt = adapt
        self.forgetting_s = forgetting_s
        self.anchor_s = anchor_s

    @property
    def adapts(self) -> bool:  # type: ignore[override]
        """Whether it learns in flight."""
        return self.adapt

    @property
    def requires(self) -> tuple[str, ...]:  # type: ignore[override]
        """The fluxgate, and the reading where it follows the flight."""
        return (FLUX.pattern, MAG.pattern) if self.adapt else (FLUX.pattern,)

    def learn(self, training: Training, context: FitContext) -> None:
        """Fit, and keep how well each coefficient was excited; see ``Compensator.learn``."""
        super().learn(training, context)
        self._reading = MAG.name(sensor=training.sensor)
        parts = [
            part
            for recording in reading_rows(training.recordings, training.sensor)
            for part in self._in_band(recording)
        ]
        if not parts:
            msg = f"no piece without a gap is longer than the {signals.EDGE_S:g} s that the causal band-pass spoils"
            raise DataError(msg)
        table = np.concatenate(parts)
        self._known = Known.of(table[:, :-1], table[:, -1], self._fit.coefficients)

    def _in_band(self, recording: Recording) -> list[np.ndarray]:
        """Return columns and reading of each piece, band-passed causally, (m, c + 1)."""
        table = np.column_stack([self._columns(recording).matrix, recording[self._reading]])
        band = CausalBand(round(recording.rate_hz, _DIGITS))
        pieces = (table[span] for span in signals.spans(recording.time_s))
        return [band(piece)[band.settling_rows :] for piece in pieces if len(piece) > band.settling_rows]

    def estimate(self, recording: Recording) -> np.ndarray:
        """Return columns times the coefficients of each row, (n,) [nT]; no warm-up."""
        return self._followed(recording)[0] if self.adapt else super().estimate(recording)

    def _streamer(self, feed: Feed) -> Streamer | None:
        return self._following(feed) if self.adapt else super()._streamer(feed)

    def _following(self, feed: Feed) -> RecursiveStreamer:
        feed = replace(feed, rate_hz=round(feed.rate_hz, _DIGITS))
        rows = rows_of(self._columns, feed)
        assert rows is not None
        adaptation = Adaptation(self._known, feed.rate_hz, forgetting_s=self.forgetting_s, anchor_s=self.anchor_s)
        return RecursiveStreamer(rows, self._reading, adaptation, self._fit.offset_nt)

    def _followed(self, recording: Recording) -> tuple[np.ndarray, np.ndarray]:
        """Return the estimate, (n,) [nT], and the coefficients of each row, (n, c), as a stream finds them."""
        streamer = self._following(Feed(recording.rate_hz))
        table = recording.stack(streamer.columns)
        estimates: list[float] = []
        used: list[np.ndarray] = []
        for span in signals.spans(recording.time_s):
            for values in table[span]:
                found = streamer.push(values)
                if found is not None:
                    estimates.append(found)
                    used.append(streamer.coefficients)
            for found in streamer.finish():
                estimates.append(found)
                used.append(streamer.coefficients)
        return np.array(estimates), np.array(used)

    def _shares(self, recording: Recording) -> dict[str, np.ndarray]:
        if not self.adapt:
            return super()._shares(recording)
        products = self._columns(recording).matrix * self._followed(recording)[1]
        groups = np.array(self._fit.groups)
        out = {group: products[:, groups == group].sum(axis=1) for group in dict.fromkeys(self._fit.groups)}
        return {**out, OFFSET: np.full(len(recording), self._fit.offset_nt)}

    def state(self) -> State:
        """Return that of the fit, and what the flight begins with; see ``Compensator.state``."""
        fitted = super().state()
        values = {**fitted.values, "reading": self._reading, "deviation_nt": self._known.deviation_nt}
        arrays = {**fitted.arrays, "scale": self._known.scale, "products": self._known.products}
        return State(values, arrays)

    def set_state(self, state: State) -> None:
        """Take back what ``state`` returned."""
        super().set_state(state)
        count = len(self._fit.coefficients)
        scale, products = (np.asarray(state.arrays[name], dtype=float) for name in ("scale", "products"))
        if scale.shape != (count,) or products.shape != (count, count):
            msg = f"scales of shape {scale.shape} and products of shape {products.shape} for {count} terms"
            raise ValueError(msg)
        self._reading = str(state.values["reading"])
        self._known = Known(self._fit.coefficients, scale, products, float(state.values["deviation_nt"]))

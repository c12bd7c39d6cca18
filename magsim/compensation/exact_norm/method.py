"""The exact norm: vector sources on a calibrated background, and the length of their sum."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from magsim import columns
from magsim.compensation import background as backgrounds
from magsim.compensation.base import Compensator, FitContext
from magsim.compensation.columns import pick_fluxgate, position_columns
from magsim.compensation.exact_norm.estimation import (
    BENT,
    Estimated,
    Estimation,
    FlightRows,
    exact_interference,
    jacobian_of,
    shares_of,
)
from magsim.compensation.exact_norm.sources import Driven, Shape, SourceInputs, Sources
from magsim.compensation.exact_norm.streaming import ExactNormRows, ExactNormStreamer
from magsim.compensation.observability import check_channels, check_directions
from magsim.compensation.reduction import Reduction
from magsim.compensation.saving import State
from magsim.compensation.streaming import Feed, Streamer
from magsim.compensation.targets import Target, TargetName, rows_to_fit, target_of
from magsim.compensation.terms import Term
from magsim.dataset import Training
from magsim.recording import Recording
from magsim.signals import band_pass, spans
from magsim.threads import one_blas_thread

Positive = Annotated[float, Field(gt=0)] | None

_STEPS, _MOST_STEPS = 4, 8
"""Gauss-Newton steps: more than four change the estimate by at most 0.25 pT in band (levels 0, 2, 4, 6), three by 18.
Half widths of a memory that is there take some more."""

_SAME_S, _SAME_NT = 1e-5, 4e-4
"""A lag, and half widths by their effect in band, are the same if they changed by less: 0.4 pT, which the step itself
still takes up."""


class ExactNorm(Compensator):
    """Sources as vectors on a calibrated background, and the exact length of their sum.

    Tolles-Lawson takes the direction of a fluxgate for that of the field and projects on it. Here the fluxgate is
    calibrated against INS and model field first, with its lag, its bandwidth and what currents and control surfaces do
    to it. Then the field of the platform at the sensor is a sum of sources, each of which follows a signal: magnets;
    steel, with its memory; eddy currents, with their lag; currents; control surfaces. The interference is the length of
    background and sources together, minus that of the background. Both stages are closed forms that are iterated a few
    times; how large each kind of source is, is found from the training rows (``docs/exact_norm.md``).

    Parameters
    ----------
    target : {"interference", "measured", "model", "map", "crossings", "reference"}
        The label, or what a survey has: see ``docs/targets.md``.
    direction : {"calibrated", "ins", "fluxgate", "best"}
        Where the background comes from. ``best`` takes that of the first two which leaves less of the training rows: a
        fluxgate that is late is no good without look-ahead, and an INS is.
    fluxgate : str, optional
        The first one of the first recording if not given.
    lookahead : int
        Rows after its own that an estimate may use, 0 to 20; more than 8 bring nothing.
    channels : tuple of {"currents", "voltages", "surfaces", "accelerations"}, optional
        Which channels are sources: all but voltages by default. Accelerations move what hangs on rubber mounts. Those
        that do not vary are left out.
    memory : bool
        Whether steel remembers the field.
    repeated : bool
        Take it that a piece was flown just so before: it sets the memory at its start, so that half widths and
        aftereffect can be fitted too, and needs the whole piece.
    vertical : bool
        Fit the height beside the sources, as what is left of the vertical gradient of the Earth's field; only without
        labels.
    map, map_height_m, crossing_m, crossing_height_m, reference, reference_model
        Of the targets of these names; see ``targets.choice.Targeted``.
    """

    name = "exact_norm"

    def __init__(
        self,
        *,
        target: TargetName = "interference",
        direction: Literal["calibrated", "ins", "fluxgate", "best"] = "calibrated",
        fluxgate: str | None = None,
        lookahead: Annotated[int, Field(ge=0, le=20)] = backgrounds.LOOKAHEAD_ROWS,
        channels: tuple[Literal["currents", "voltages", "surfaces", "accelerations"], ...] | None = None,
        memory: bool = True,
        repeated: bool = False,
        vertical: bool = True,
        map: str | None = None,
        map_height_m: float | None = None,
        crossing_m: Positive = None,
        crossing_height_m: Positive = None,
        reference: str | None = None,
        reference_model: str | None = None,
    ) -> None:
        self.target = target
        self.direction = direction
        self.fluxgate = fluxgate
        self.lookahead = lookahead
        self.channels = channels
        self.memory = memory
        self.repeated = repeated
        self.vertical = vertical
        self.map = map
        self.map_height_m = map_height_m
        self.crossing_m = crossing_m
        self.crossing_height_m = crossing_height_m
        self.reference = reference
        self.reference_model = reference_model

    @property
    def requires(self) -> tuple[str, ...]:  # type: ignore[override]
        """What the background reads, and the channels that were found to vary."""
        if hasattr(self, "_sources"):
            return self._sources.reads
        reads = {"ins": backgrounds.MODEL_READS, "best": (columns.FLUX.pattern, *backgrounds.MODEL_READS)}
        return reads.get(self.direction, (columns.FLUX.pattern,))

    @property
    def lookahead_rows(self) -> int | None:  # type: ignore[override]
        """As many as were asked for; without limit if a piece is taken to be repeated."""
        return None if self.repeated else self.lookahead

    def learn(self, training: Training, context: FitContext) -> None:
        """Calibrate the background, then find the sources; see ``Compensator.learn``."""
        self.__dict__.pop("_sources", None)
        target = target_of(self)
        recordings = rows_to_fit(target, training, self.name)
        self._check(recordings, training.sensor, measured=target.measured)
        directions: tuple[backgrounds.Direction, ...] = ("calibrated", "ins")
        if self.direction != "best":
            directions = (self.direction,)
        alive = backgrounds.live_channels(recordings, tuple(dict.fromkeys((*backgrounds.FLUXGATE_SEES, *self._kinds))))
        found = [self._fit(direction, target, recordings, training.sensor, alive) for direction in directions]
        self._sources, self._found, self._offset_nt = min(found, key=lambda fit: fit[1].noise_nt)

    @property
    def _kinds(self) -> Sequence[str]:
        """Kinds of channels that are sources."""
        return ("currents", "surfaces", "accelerations") if self.channels is None else self.channels

    def _check(self, recordings: Sequence[Recording], sensor: str, *, measured: bool) -> None:
        """Refuse dead channels, and rows in which the field turns too little; see ``Compensator.learn``."""
        families = [columns.FLUX, columns.INS_ATTITUDE] + [columns.MAG] * measured
        check_channels(recordings, [family.pattern for family in families], sensor)
        if self.direction == "ins":
            fields = [backgrounds.ModelField()(recording) for recording in recordings]
        else:
            fluxgate = pick_fluxgate(recordings, self.fluxgate)
            fields = [backgrounds.FluxgateField(fluxgate)(recording) for recording in recordings]
        check_directions(fields, [recording.name for recording in recordings])

    def _fit(
        self,
        direction: backgrounds.Direction,
        target: Target,
        recordings: Sequence[Recording],
        sensor: str,
        alive: tuple[backgrounds.Channel, ...],
    ) -> tuple[Sources, Estimated, float]:
        """Return the sources on one background, what they do, and the mean of the labels that they leave [nT]."""
        sources = self._sources_of(direction, recordings, sensor, alive)
        times, rate_hz = [recording.time_s for recording in recordings], recordings[0].rate_hz
        reduction = Reduction(times, [target.known(r, sensor) for r in recordings], rate_hz)
        pairs = target.pairs(recordings, sensor)
        estimation = Estimation(sources.table, reduction, pairs, tied=target.measured)
        height = position_columns(recordings, 0, vertical=self.vertical and target.measured).designs
        readings = [sources.read(recording) for recording in recordings]
        signals = _Signals(sources, readings)
        beside = [
            (target.values(recording, sensor), design.matrix, partial(_rate, inputs))
            for recording, inputs, design in zip(recordings, readings, height, strict=True)
        ]
        at = np.zeros((len(sources.table), 3))
        for number in range(_MOST_STEPS):
            flights = [FlightRows(driven, *rest) for driven, rest in zip(signals.driven, beside, strict=True)]
            step = estimation.step(flights, at, signals.sources.shape, size_groups=number > 0)
            at, is_bent = step.coefficients, step.bent_nt > _SAME_NT
            if number >= _STEPS - 1 and not is_bent:
                break
            signals.shape(step.shape, is_bent=is_bent)
        found = estimation.settled()
        signals.shape(found.shape, is_bent=False)
        rests = [
            row[0] - exact_interference(driven, found.coefficients)
            for driven, row in zip(signals.driven, beside, strict=True)
        ]
        return replace(sources, shape=found.shape), found, self._offset(recordings, sensor, rests)

    def estimate(self, recording: Recording) -> np.ndarray:
        """Return the length of background and sources minus that of the background, (n,) [nT]; no warm-up."""
        return exact_interference(self._sources(recording), self._found.coefficients) + self._offset_nt

    def _streamer(self, feed: Feed) -> Streamer:
        """Return the method row by row; see ``Compensator``."""
        return ExactNormStreamer(ExactNormRows(self._sources, self._found.coefficients, feed), self._offset_nt)

    def _sources_of(
        self,
        direction: backgrounds.Direction,
        recordings: Sequence[Recording],
        sensor: str,
        alive: tuple[backgrounds.Channel, ...],
    ) -> Sources:
        field = backgrounds.fit_background(
            direction,
            recordings,
            sensor,
            fluxgate=self.fluxgate,
            lookahead_rows=self.lookahead,
            labels=self.target == "interference",
            channels=backgrounds.of_kinds(alive, backgrounds.FLUXGATE_SEES),
        )
        channels = backgrounds.of_kinds(alive, self._kinds)
        sources = Sources(field, channels, self.memory, self.repeated, self.lookahead)
        return replace(sources, shape=Shape((0.0,) * len(BENT))) if sources.knows_start else sources

    def _offset(self, recordings: Sequence[Recording], sensor: str, rests: Sequence[np.ndarray]) -> float:
        """Return the mean of what the sources leave of labels; 0 without labels."""
        if self.target != "interference":
            return 0.0
        kept = [rest[recording.reads(sensor)] for rest, recording in zip(rests, recordings, strict=True)]
        return float(np.concatenate(kept).mean())

    # ---- what it tells -----------------------------------------------------------------------------------------

    @property
    def sources_(self) -> Sources:
        """Background and signals."""
        self.check_fitted()
        return self._sources

    @property
    def found_(self) -> Estimated:
        """Coefficients with covariance, noise, and how large each group is."""
        self.check_fitted()
        return self._found

    def _coefficients(self) -> tuple[Term, ...]:
        terms = [
            Term(f"{signal.name} -> {axis}", float(value), signal.unit, float(error), signal.group)
            for signal, row, spread in zip(
                self._sources.table, self._found.coefficients, self._found.errors, strict=True
            )
            for axis, value, error in zip(columns.AXES, row, spread, strict=True)
        ]
        return (*terms, Term("offset", self._offset_nt, "nT", None, "offset"))

    def _shares(self, recording: Recording) -> dict[str, np.ndarray]:
        table = shares_of(self._sources(recording), self._found.coefficients)
        shares: dict[str, np.ndarray] = {}
        for signal, share in zip(self._sources.table, table.T, strict=True):
            shares[signal.group] = shares.get(signal.group, 0.0) + share
        return {**shares, "offset": np.full(len(recording), self._offset_nt)}

    def _uncertainty(self, recording: Recording) -> np.ndarray:
        jacobian = jacobian_of(self._sources(recording), self._found.coefficients)
        with one_blas_thread():
            spread = jacobian @ self._found.root
        # what the sources cannot express shows in the residual of labels; that of a reading is mostly its own noise
        beyond = self._found.noise_nt if self.target == "interference" else 0.0
        out = np.zeros(len(recording))
        for span in spans(recording.time_s):
            filtered = band_pass(spread[span], recording.rate_hz)
            out[span] = np.sqrt(np.einsum("nc,nc->n", filtered, filtered) + beyond**2)
        return out

    # ---- files -------------------------------------------------------------------------------------------------

    def state(self) -> State:
        """Return background, sources and what was found; see ``Compensator.state``."""
        background, found = self._sources.background.state(), self._found
        values = {
            "background": dict(background.values),
            "channels": [[channel.name, channel.rest] for channel in self._sources.channels],
            "later_s": found.shape.later_s,
            "bent": list(found.shape.bent),
            "noise_nt": found.noise_nt,
            "free": found.free,
            "offset_nt": self._offset_nt,
        }
        arrays = {
            **background.arrays,
            "coefficients": found.coefficients,
            "root": found.root,
            "shrunk": found.shrunk,
        }
        return State(values, arrays)

    def set_state(self, state: State) -> None:
        """Take back what ``state`` returned."""
        values: Mapping[str, Any] = state.values
        background = backgrounds.background_from(State(values["background"], state.arrays))
        channels = tuple(
            backgrounds.Channel(str(name), None if rest is None else float(rest)) for name, rest in values["channels"]
        )
        shape = Shape(tuple(float(bent) for bent in values["bent"]), float(values["later_s"]))
        self._sources = Sources(background, channels, self.memory, self.repeated, self.lookahead, shape)
        if len(shape.bent) != len(BENT) * self._sources.knows_start:
            msg = f"{len(shape.bent)} numbers for the shape of the memory"
            raise ValueError(msg)
        arrays = {key: np.asarray(state.arrays[key], dtype=float) for key in ("coefficients", "root", "shrunk")}
        signals = len(self._sources.table)
        if arrays["coefficients"].shape != (signals, 3) or len(arrays["root"]) != 3 * signals:
            msg = f"coefficients {arrays['coefficients'].shape} for {signals} signals"
            raise ValueError(msg)
        self._found = Estimated(
            arrays["coefficients"],
            arrays["root"],
            shape,
            float(values["noise_nt"]),
            float(values["free"]),
            arrays["shrunk"],
        )
        self._offset_nt = float(values["offset_nt"])


class _Signals:
    """Signals of the training recordings: what a change of the shape touches is made anew, and nothing else."""

    def __init__(self, sources: Sources, inputs: Sequence[SourceInputs]) -> None:
        self.sources, self._inputs = sources, inputs
        self._motions = [sources.motion(one) for one in inputs]
        self.driven = self._driven()

    def shape(self, shape: Shape, *, is_bent: bool) -> None:
        """Take another shape; ``is_bent`` tells whether the memory is another one."""
        is_later = abs(shape.later_s - self.sources.shape.later_s) > _SAME_S
        if not (is_later or is_bent):
            return
        self.sources = replace(self.sources, shape=shape)
        if is_later:
            self._motions = [self.sources.motion(one) for one in self._inputs]
        self.driven = self._driven()

    def _driven(self) -> list[Driven]:
        pairs = zip(self._inputs, self._motions, strict=True)
        return [self.sources.driven(one, motion) for one, motion in pairs]


def _rate(inputs: SourceInputs, values: np.ndarray) -> np.ndarray:
    """Return the derivative of a series by time, (n,)."""
    out = np.empty_like(values)
    derivative = backgrounds.taps(1, 0.0, backgrounds.LOOKAHEAD_ROWS, inputs.rate_hz)
    for span in inputs.spans:
        out[span] = derivative(values[span])
    return out

"""Signals that the sources of an aircraft follow, with what is known of their size before any flight."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from magsim import columns, signals
from magsim.compensation import background as backgrounds
from magsim.compensation.background import BackgroundField, CalibratedField, Channel, taps
from magsim.compensation.exact_norm.memory import WIDTHS_NT, relaxed, remembered
from magsim.recording import Recording

STRENGTH_NT = 45_000.0
"""Field that the sizes below are meant for."""

PERMANENT_NT, INDUCED_NT, EDDY_NT, BEND_NT, MEMORY_NT = 1000.0, 500.0, 100.0, 10.0, 100.0
"""Deviations of what a source may do to the field at a sensor [nT]: magnets; steel, eddy currents (at one radian a
second), their second order, and the hysteresis of steel in the field above. Cabins of survey aircraft have some hundred
nT of the first two, and a tenth and a hundredth of that of the others (reference tables of the C208B; estimate)."""

CHANNELS = {
    columns.CURRENT: ("current", "nT/A", 10.0),
    columns.VOLTAGE: ("voltage", "nT/V", 10.0),
    columns.SURFACE: ("surface", "nT/deg", 1.0),
    columns.INS_ACCELERATION: ("acceleration", "nT s^2/m", 1.0),
}
"""Word, unit and deviation for a channel: a wire some meters away, a magnet on a hinge, an engine of 100 kg on mounts
that give by 1 mm for each g (estimates)."""


class Signal(NamedTuple):
    """One signal; it drives a field with three components.

    Attributes
    ----------
    name : str
    group : str
        Signals of one group are of one size.
    unit : str
        Of the coefficients.
    size : float
        Deviation of the coefficients before any flight, in that unit.
    """

    name: str
    group: str
    unit: str
    size: float


class Driven(NamedTuple):
    """What sources follow along a recording.

    Attributes
    ----------
    background : (n, 3) [nT]
    signals : (n, k)
    bends : (b, 3, n) [nT]
        Derivatives of the signals of the memory by ``Shape.bent``.
    """

    background: np.ndarray
    signals: np.ndarray
    bends: np.ndarray


class Shape(NamedTuple):
    """What the signals depend on beside the inputs.

    Attributes
    ----------
    bent : tuple of float
        Logarithms of the half widths of the memory over ``WIDTHS_NT``, and the aftereffect over the hysteresis; none
        where they are not fitted.
    later_s : float [s]
        How much later than its row the background is taken: what the scalar magnetometer lags behind the INS.
    """

    bent: tuple[float, ...] = ()
    later_s: float = 0.0

    @property
    def widths_nt(self) -> tuple[float, ...]:
        """Half widths of the memory [nT]."""
        wider = self.bent[:-1] or (0.0,) * len(WIDTHS_NT)
        return tuple(width * math.exp(more) for width, more in zip(WIDTHS_NT, wider, strict=True))


UNSHAPED = Shape()


class SourceInputs(NamedTuple):
    """What sources read of a recording.

    Attributes
    ----------
    background : background.Readings, or (n, 3) [nT]
        What a calibrated background is made from; any other one itself.
    channels : (n, c)
    spans : list of slice
        Rows without a gap.
    rate_hz : float
    """

    background: backgrounds.Readings | np.ndarray
    channels: np.ndarray
    spans: list[slice]
    rate_hz: float


@dataclass(frozen=True)
class Sources:
    """Makes the signals of a recording.

    Attributes
    ----------
    background : BackgroundField
    channels : tuple of Channel
    memory : bool
        Whether steel remembers.
    repeated : bool
        See ``remembered``.
    lookahead_rows : int
        Rows after its own that a row needs.
    shape : Shape
    """

    background: BackgroundField
    channels: tuple[Channel, ...]
    memory: bool
    repeated: bool
    lookahead_rows: int
    shape: Shape = UNSHAPED

    @property
    def knows_start(self) -> bool:
        """Whether the memory at the start of a piece is known: without that, its shape cannot be fitted."""
        return self.memory and self.repeated

    @property
    def reads(self) -> tuple[str, ...]:
        """Patterns of the column families that are read."""
        families = (columns.family_of(channel.name).pattern for channel in self.channels)
        return tuple(dict.fromkeys((*self.background.reads, *families)))

    @property
    def table(self) -> tuple[Signal, ...]:
        """All signals, in the order of the columns."""
        parts: list[tuple[str, str, float, tuple[str, ...]]] = [("permanent", "nT", PERMANENT_NT, ("",))]
        parts += [("induced", "1", INDUCED_NT / STRENGTH_NT, columns.AXES)]
        parts += [("eddy", "s", EDDY_NT / STRENGTH_NT, columns.AXES)]
        parts += [("eddy lag", "s^2", BEND_NT / STRENGTH_NT, columns.AXES)]
        if self.memory:
            parts += [("memory", "1", MEMORY_NT / STRENGTH_NT, columns.AXES)]
        table = [
            Signal(f"{group} {axis}".strip(), group, unit, size) for group, unit, size, axes in parts for axis in axes
        ]
        for channel in self.channels:
            family = columns.family_of(channel.name)
            word, unit, size = CHANNELS[family]
            name = f"{word} {next(iter((family.match(channel.name) or {}).values()))}"
            table.append(Signal(name, name, unit, size))
        return tuple(table)

    def __call__(self, recording: Recording) -> Driven:
        """Return background and signals of a recording; see ``BackgroundField`` for what is raised."""
        inputs = self.read(recording)
        return self.driven(inputs, self.motion(inputs))

    def read(self, recording: Recording) -> SourceInputs:
        """Return what background and signals are made from; see ``BackgroundField`` for what is raised."""
        known: dict[Channel, np.ndarray] = {}
        background: backgrounds.Readings | np.ndarray
        if isinstance(self.background, CalibratedField):
            background = self.background.regressors.read(recording)
            known = dict(zip(self.background.regressors.channels, background.channels.T, strict=True))
        else:
            background = self.background(recording)
        channels = np.empty((len(recording), len(self.channels)))
        for column, channel in enumerate(self.channels):
            channels[:, column] = known[channel] if channel in known else channel(recording)
        return SourceInputs(background, channels, signals.spans(recording.time_s), round(recording.rate_hz, 6))

    def driven(self, inputs: SourceInputs, motion: Sequence[np.ndarray]) -> Driven:
        """Return background and signals."""
        field, rate, bend, *late = motion
        parts, bends = [np.ones((len(field), 1)), field, rate, bend], np.zeros((0, *field.shape[::-1]))
        if self.memory:
            pieces = [field[span] for span in inputs.spans]
            widths = self.shape.widths_nt
            held = [remembered(piece, repeated=self.repeated, widths_nt=widths) for piece in pieces]
            states = np.concatenate([states for states, _ in held])
            if self.knows_start:
                states += self.shape.bent[-1] * late[0]
                bends = np.concatenate([np.concatenate([slopes for _, slopes in held], axis=2), late[0].T[None]])
            parts.append(states)
        return Driven(field, np.hstack([*parts, inputs.channels]), bends)

    def motion(self, inputs: SourceInputs) -> list[np.ndarray]:
        """Return the background and its first two derivatives by time, and its relaxations where they count."""
        motion = self._motion(inputs)
        if self.knows_start:
            motion.append(np.concatenate([relaxed(motion[0][span], inputs.rate_hz) for span in inputs.spans]))
        return motion

    def _motion(self, inputs: SourceInputs) -> list[np.ndarray]:
        """Return the background and its first two derivatives by time."""
        if isinstance(self.background, CalibratedField):
            assert isinstance(inputs.background, backgrounds.Readings)
            return self.background.motion(inputs.background, self.shape.later_s)
        field = inputs.background
        assert isinstance(field, np.ndarray)
        out = [np.empty_like(field) for _ in range(3)]
        for order, into in enumerate(out):
            filtered = taps(order, self.shape.later_s, self.lookahead_rows, inputs.rate_hz)
            for span in inputs.spans:
                into[span] = filtered(field[span])
        return out

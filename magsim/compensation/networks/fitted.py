"""A trained pair of closed-form first stage and network, and the scales between them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from torch import nn

from magsim import columns as families
from magsim.compensation.base import Compensator
from magsim.compensation.networks.inputs import InputColumns
from magsim.compensation.networks.scaling import Standardizer
from magsim.compensation.networks.settings import NetworkSettings
from magsim.compensation.networks.windows import apply_network
from magsim.compensation.targets import interference
from magsim.errors import DataError
from magsim.recording import Recording


@dataclass(frozen=True)
class Fitted:
    """A first stage and a network: estimate = stage + mean + weight * scale * network(inputs).

    Attributes
    ----------
    settings : NetworkSettings
    stage : Compensator
    columns : InputColumns
        Inputs of the network.
    names : tuple of str
        Of the input columns.
    standardizer : Standardizer
    mean, scale : float [nT]
        Of what the stage leaves.
    module : nn.Module
    rate_hz : float [Hz]
        Rate of the training rows: windows count rows, so a network knows one rate only.
    weight : float
        Share of the network's output in use, 0 to 1; see ``magsim.compensation.networks.evidence``.
    is_start : bool
        Each flight of the training had a stage or inputs of its own: a start for others, with no estimate by itself.
    """

    settings: NetworkSettings
    stage: Compensator
    columns: InputColumns
    names: tuple[str, ...]
    standardizer: Standardizer
    mean: float
    scale: float
    module: nn.Module
    rate_hz: float
    weight: float = 1.0
    is_start: bool = False

    @property
    def gain_nt(self) -> float:
        """What an output of 1 adds to the estimate [nT]."""
        return self.weight * self.scale

    def inputs(self, recording: Recording) -> np.ndarray:
        """Return the standardized columns, (n, c) in the precision of the network."""
        values = self.standardizer(self.columns(recording).matrix)
        return values if self.settings.optimizer == "lm" else values.astype(np.float32)

    def output(
        self, module: nn.Module, inputs: np.ndarray, time_s: np.ndarray, *, platform: bool = False
    ) -> np.ndarray:
        """Return the output of a network over a recording, or the platform's part of it, (n,), NaN in the warm-up."""
        settings = self.settings
        return apply_network(
            module,
            inputs,
            time_s,
            window=settings.window,
            stride=settings.hop,
            context=settings.context,
            platform=platform,
        )

    def rest(self, recording: Recording, sensor: str) -> np.ndarray:
        """Return what the stage leaves of the target, less its mean, (n,) [nT]; see ``left_by``."""
        return left_by(self.stage, self.settings, recording, sensor) - self.mean


def left_by(stage: Compensator, settings: NetworkSettings, recording: Recording, sensor: str) -> np.ndarray:
    """Return what a stage leaves of the target, (n,) [nT].

    Rows in which the magnetometer does not read are bridged: what is held there must not reach filters.
    """
    found = target_of(settings, recording, sensor) - stage.interference(recording)
    read = recording.reads(sensor)
    return found if read.all() else np.interp(recording.time_s, recording.time_s[read], found[read])


def target_of(settings: NetworkSettings, recording: Recording, sensor: str) -> np.ndarray:
    """Return what stage and network learn together: the label, or the reading, (n,) [nT]."""
    if settings.target == "measured":
        return recording[families.MAG.name(sensor=sensor)]
    return interference(recording, sensor)


def check_rate(recording: Recording, rate_hz: float) -> None:
    """Refuse a recording of another rate than the training rows.

    Raises
    ------
    DataError
    """
    check_rate_hz(f"recording {recording.name!r}", recording.rate_hz, rate_hz)


def check_rate_hz(what: str, found_hz: float, rate_hz: float) -> None:
    """Refuse another rate than that of the training rows.

    Raises
    ------
    DataError
    """
    if abs(found_hz / rate_hz - 1.0) > 0.01:
        msg = f"{what} has {found_hz:g} rows a second; the network learned from {rate_hz:g}"
        raise DataError(msg)


def check_rates(recordings: Sequence[Recording]) -> float:
    """Return the rate that recordings have in common [Hz].

    Raises
    ------
    DataError
        If they have different ones.
    """
    rate_hz = recordings[0].rate_hz
    for recording in recordings:
        check_rate(recording, rate_hz)
    return rate_hz

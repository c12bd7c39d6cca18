"""Networks as papers 000 and 003 have them: the output is the clean field itself, and the reading is not looked at."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from magsim import columns
from magsim.compensation import Compensator, FitContext, create
from magsim.compensation.networks import NetworkCompensator
from magsim.compensation.targets import interference
from magsim.dataset import Training
from magsim.recording import Recording


class CleanField(Compensator):
    """A network that learns the clean field: what is subtracted from the reading is the reading less its output.

    So the compensated reading is the output, which no anomaly in the reading can reach.

    Parameters
    ----------
    network : str
        A method of ``magsim.compensation.networks``.
    settings : mapping
        Its parameters.
    """

    name = "clean_field"
    trains = True

    def __init__(self, network: str, settings: Mapping[str, object]) -> None:
        self.network = network
        self.settings = settings

    @property
    def requires(self) -> tuple[str, ...]:  # type: ignore[override]
        """What the network reads, and the reading."""
        return (*self.network_.requires, columns.MAG.pattern) if hasattr(self, "network_") else (columns.MAG.pattern,)

    @property
    def warmup_s(self) -> float:  # type: ignore[override]
        """The network's."""
        return self.network_.warmup_s

    def learn(self, training: Training, context: FitContext) -> None:
        """Train the network on recordings whose label is the clean field."""
        relabeled = tuple(_clean_as_label(recording, training.sensor) for recording in training.recordings)
        network = create(self.network, **self.settings).fit_rows(replace(training, recordings=relabeled), context)
        assert isinstance(network, NetworkCompensator)
        self.network_ = network

    def estimate(self, recording: Recording) -> np.ndarray:
        """Return the reading less the network's output, (n,) [nT]."""
        return recording[columns.MAG.name(sensor=self.sensor_)] - self.network_.interference(recording)


def _clean_as_label(recording: Recording, sensor: str) -> Recording:
    """Return a recording whose label is its reading without the interference."""
    clean = recording[columns.MAG.name(sensor=sensor)] - interference(recording, sensor)
    return replace(recording, data={**recording.data, columns.INTERFERENCE.name(sensor=sensor): clean})

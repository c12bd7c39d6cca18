"""Target ``reference``: the reading minus that of a quieter scalar magnetometer of the same aircraft."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from magsim import columns
from magsim.compensation.base import Compensator
from magsim.compensation.targets.base import reading
from magsim.compensation.targets.pairs import Pairs
from magsim.errors import RequestError
from magsim.recording import Recording


@dataclass(frozen=True)
class OtherReading:
    """The reading minus that of another magnetometer, as it is or compensated.

    What the reference keeps of interference and noise counts as that of the magnetometer, with the opposite sign; and
    so does what the clean field differs by between the two places.

    Attributes
    ----------
    sensor : str
        The other magnetometer.
    compensator : Compensator, optional
        Fitted for it.
    """

    sensor: str
    compensator: Compensator | None = None
    name: str = "reference"
    measured: bool = True
    broadband: bool = True

    def check(self) -> None:
        """Refuse a compensator of another magnetometer, or one that does not estimate every row.

        Raises
        ------
        RequestError
        """
        fitted = self.compensator
        if fitted is None:
            return
        if fitted.sensor_ != self.sensor:
            msg = f"reference_model was fitted for magnetometer {fitted.sensor_!r}; allowed: one for {self.sensor!r}"
            raise RequestError(msg)
        if fitted.warmup_s > 0.0:
            msg = (
                f"reference_model {fitted.name} estimates nothing in the first {fitted.warmup_s:g} s of each piece; "
                "allowed: a method without warm-up"
            )
            raise RequestError(msg)

    def reads(self, sensor: str) -> tuple[str, ...]:
        """Return the columns of both magnetometers."""
        return columns.MAG.name(sensor=sensor), columns.MAG.name(sensor=self.sensor)

    def values(self, recording: Recording, sensor: str) -> np.ndarray:
        """Return the difference of the two readings, (n,) [nT]; see ``Target``."""
        if sensor == self.sensor:
            msg = f"target 'reference': {sensor!r} is the magnetometer to be compensated; allowed: another one"
            raise RequestError(msg)
        other = reading(recording, self.sensor)
        if self.compensator is not None:
            other = other - self.compensator.interference(recording)
        return reading(recording, sensor) - other

    def known(self, recording: Recording, sensor: str) -> np.ndarray:
        """Return the rows in which both magnetometers read."""
        return recording.reads(sensor) & recording.reads(self.sensor)

    def pairs(self, recordings: Sequence[Recording], sensor: str) -> Pairs | None:
        """Return None."""
        return None

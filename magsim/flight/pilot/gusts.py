"""Gusts in time: each is passed to its generator shortly before it begins."""

import math
from collections.abc import Sequence

from magsim.flight.model.weather import (
    GUST_INPUTS,
    Weather,
    gust_property,
)
from magsim.scenario import Gust
from magsim.units import FT


class GustSchedule:
    """Passes each gust to its generator on the last tick before it begins.

    Parameters
    ----------
    weather : Weather

    Attributes
    ----------
    next_s : float
        When the next gust begins, on the clock of ``begin``; infinite if none waits.
    """

    def __init__(self, weather: Weather) -> None:
        self._slots = weather.slots
        self._waiting: list[tuple[float, int, Gust]] = []
        self._offset_s, self.next_s = 0.0, math.inf

    def begin(self, zero_s: float, offset_s: float) -> None:
        """Set the time of the first row and the lead of JSBSim's clock; before this call there are no gusts."""
        self._offset_s = offset_s
        dated = [(gust.at_s + zero_s, slot, gust) for slot, gusts in enumerate(self._slots) for gust in gusts]
        # The later a gust begins, the earlier in the list: the next one is popped from the end.
        self._waiting = sorted(dated, key=lambda item: -item[0])
        self._look()

    def due(self, until_s: float) -> Sequence[tuple[str, float]]:
        """Return properties and values of the gusts that begin before a time on the clock of ``zero_s``."""
        out: list[tuple[str, float]] = []
        while self.next_s <= until_s:
            start, slot, gust = self._waiting.pop()
            wind = (gust.north_mps / FT, gust.east_mps / FT, gust.down_mps / FT)
            values = (start + self._offset_s, gust.duration_s, *wind)
            out += [(gust_property(slot, name), value) for name, value in zip(GUST_INPUTS, values, strict=True)]
            self._look()
        return out

    def _look(self) -> None:
        self.next_s = self._waiting[-1][0] if self._waiting else math.inf

"""Gusts in time: each is passed to its generator shortly before it begins."""

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
    """

    def __init__(self, weather: Weather) -> None:
        self._slots = weather.slots
        self._waiting: list[tuple[float, int, Gust]] = []
        self._offset_s = 0.0

    def begin(self, zero_s: float, offset_s: float) -> None:
        """Set the time of the first row and the lead of JSBSim's clock; before this call there are no gusts."""
        self._offset_s = offset_s
        dated = [(gust.at_s + zero_s, slot, gust) for slot, gusts in enumerate(self._slots) for gust in gusts]
        # The later a gust begins, the earlier in the list: the next one is popped from the end.
        self._waiting = sorted(dated, key=lambda item: -item[0])

    def due(self, until_s: float) -> Sequence[tuple[str, float]]:
        """Return properties and values of the gusts that begin before a time on the clock of ``zero_s``."""
        waiting = self._waiting
        if not waiting or waiting[-1][0] > until_s:
            return ()
        out: list[tuple[str, float]] = []
        while waiting and waiting[-1][0] <= until_s:
            start, slot, gust = waiting.pop()
            wind = (gust.north_mps / FT, gust.east_mps / FT, gust.down_mps / FT)
            values = (start + self._offset_s, gust.duration_s, *wind)
            out += [(gust_property(slot, name), value) for name, value in zip(GUST_INPUTS, values, strict=True)]
        return out

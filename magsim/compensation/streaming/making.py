"""The stream of a method: by its own part, or by its estimate on the rows around each row."""

from dataclasses import replace
from typing import Protocol

import numpy as np

from magsim.compensation.streaming.protocol import Feed, Streamer
from magsim.compensation.streaming.stream import Stream
from magsim.compensation.streaming.windowed import WindowedStreamer
from magsim.errors import RequestError
from magsim.recording import Recording


class Streamable(Protocol):
    """What a stream needs of a fitted method; see ``Compensator``."""

    name: str

    @property
    def lookahead_rows(self) -> int | None:
        """Rows after its own that an estimate needs."""

    @property
    def memory_rows(self) -> int | None:
        """Rows before its own that an estimate needs."""

    def _streamer(self, feed: Feed) -> Streamer | None: ...

    def _estimate(self, visible: Recording) -> np.ndarray: ...


def make_stream(
    method: Streamable, sensor: str, known: Feed | None, *, rate_hz: float | None, start_utc: str | None
) -> Stream:
    """Return the stream of a fitted method; see ``Compensator.stream``.

    Parameters
    ----------
    method : Streamable
    sensor : str
        The scalar magnetometer.
    known : Feed, optional
        Rate and columns of the training.
    rate_hz : float [Hz], optional
        Of the rows; that of the training by default.
    start_utc : str, optional

    Raises
    ------
    RequestError
        If the rate is not known, or the method cannot be streamed.
    """
    known = known or Feed(float("nan"))
    feed = replace(known, rate_hz=known.rate_hz if rate_hz is None else rate_hz, start_utc=start_utc)
    if not 0.0 < feed.rate_hz < float("inf"):
        msg = f"method {method.name}: rate_hz is {feed.rate_hz}; a stream needs the rows a second, a number above 0"
        raise RequestError(msg)
    return Stream(lambda: _streamer(method, feed), sensor=sensor, rate_hz=feed.rate_hz)


def _streamer(method: Streamable, feed: Feed) -> Streamer:
    if method.lookahead_rows is None:
        msg = f"method {method.name} needs rows that come later without limit (lookahead_rows is None): no stream"
        raise RequestError(msg)
    own = method._streamer(feed)
    if own is not None:
        return own
    if method.memory_rows is None:
        msg = (
            f"method {method.name} does not declare how many rows before its own an estimate needs: it cannot be "
            "streamed unless it sets memory_rows"
        )
        raise RequestError(msg)
    return WindowedStreamer(
        method._estimate, feed, memory_rows=method.memory_rows, lookahead_rows=method.lookahead_rows
    )

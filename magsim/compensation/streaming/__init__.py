"""Row by row: one row in, one estimate out, a fixed number of rows later."""

from magsim.compensation.streaming.columns import ColumnRows, FluxgateRows, TollesLawsonRows
from magsim.compensation.streaming.linear import ConstantStreamer, LinearStreamer
from magsim.compensation.streaming.making import make_stream
from magsim.compensation.streaming.protocol import Estimate, Feed, Streamer
from magsim.compensation.streaming.stream import Stream
from magsim.compensation.streaming.together import Together
from magsim.compensation.streaming.windowed import WindowedStreamer

__all__ = [
    "ColumnRows",
    "ConstantStreamer",
    "Estimate",
    "Feed",
    "FluxgateRows",
    "LinearStreamer",
    "Stream",
    "Streamer",
    "Together",
    "TollesLawsonRows",
    "WindowedStreamer",
    "make_stream",
]

"""A foreign world: an aircraft that follows other laws than ``magsim.field``, for methods that know those.

It shares the flight and the background of a recording, and nothing else: steel with Preisach's hysteresis and
saturation, loops with time constants to 100 ms, loads without a channel, a return current over two paths, magnets
behind a backlash, a fluxgate of second order.
"""

from magsim.ladder.foreign.aircraft import ForeignAircraft

__all__ = ["ForeignAircraft"]

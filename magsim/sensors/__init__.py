"""Instruments: their readings of the true field and motion, in columns.

Every magnetometer measures at the simulation rate; one anti-alias filter and decimation (``Acquisition``) then makes
rows of readings, labels and truth alike, so that all of them have the same response and add up.

An instrument is a function of one ``MeasuredFlight`` that returns its columns; ``INSTRUMENTS`` lists all of them.
"""

from magsim.sensors.acquisition import Acquisition, Counter
from magsim.sensors.instrument import Instrument, MeasuredFlight
from magsim.sensors.table import INSTRUMENTS, read_instruments, read_of_the_flight

__all__ = [
    "INSTRUMENTS",
    "Acquisition",
    "Counter",
    "Instrument",
    "MeasuredFlight",
    "read_instruments",
    "read_of_the_flight",
]

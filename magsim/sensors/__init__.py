"""Instruments: what they make of the true field and motion, and the columns they leave.

Every instrument measures at the simulation rate; one anti-alias filter and decimation (``Acquisition``) then makes
rows of readings, labels and truth alike, so that all of them have the same response and add up.
"""

from magsim.sensors.acquisition import Acquisition, Counter
from magsim.sensors.barometer import baro_columns, true_baro_columns
from magsim.sensors.base import base_columns
from magsim.sensors.cabin import temperature_c
from magsim.sensors.electrical import electrical_columns
from magsim.sensors.fluxgate import fluxgate_columns
from magsim.sensors.inertial import inertial_columns
from magsim.sensors.navigation import carrier_columns, carrier_ins_columns, ins_columns, rope_columns, true_columns
from magsim.sensors.radar import ground_columns, radar_columns
from magsim.sensors.scalar import scalar_columns
from magsim.sensors.timing import instants

__all__ = [
    "Acquisition",
    "Counter",
    "baro_columns",
    "base_columns",
    "carrier_columns",
    "carrier_ins_columns",
    "electrical_columns",
    "fluxgate_columns",
    "ground_columns",
    "inertial_columns",
    "ins_columns",
    "instants",
    "radar_columns",
    "rope_columns",
    "scalar_columns",
    "temperature_c",
    "true_baro_columns",
    "true_columns",
]

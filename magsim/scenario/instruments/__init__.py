"""The instruments on board, and the base station on the ground."""

from magsim.scenario.instruments.channels import Electrical, Surfaces
from magsim.scenario.instruments.common import InstrumentClock, Sensor
from magsim.scenario.instruments.fluxgate import Cabin, FluxgateSensor
from magsim.scenario.instruments.ground import BaseStation
from magsim.scenario.instruments.height import Barometer, Radar
from magsim.scenario.instruments.inertial import Ins
from magsim.scenario.instruments.scalar import ScalarSensor, Tone
from magsim.scenario.instruments.table import Sensors

__all__ = [
    "Barometer",
    "BaseStation",
    "Cabin",
    "Electrical",
    "FluxgateSensor",
    "Ins",
    "InstrumentClock",
    "Radar",
    "ScalarSensor",
    "Sensor",
    "Sensors",
    "Surfaces",
    "Tone",
]

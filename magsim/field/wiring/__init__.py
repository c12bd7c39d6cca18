"""Wires, the loads that draw current through them, and the voltages of the buses."""

from magsim.field.wiring.electronics import Clock, Onboard, onboard
from magsim.field.wiring.harness import Wiring

__all__ = [
    "Clock",
    "Onboard",
    "Wiring",
    "onboard",
]

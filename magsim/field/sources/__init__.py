"""Sources that are small beside their distance, and the memory of steel."""

from magsim.field.sources.dipoles import DeflectedDipole, dipole_field
from magsim.field.sources.memory import hysteresis, remembered, viscosity
from magsim.field.sources.rotors import Rotation, ShaftDipole, SpinningDipole

__all__ = [
    "DeflectedDipole",
    "Rotation",
    "ShaftDipole",
    "SpinningDipole",
    "dipole_field",
    "hysteresis",
    "remembered",
    "viscosity",
]

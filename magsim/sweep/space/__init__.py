"""The flights of a sweep: their numbers, what varies between them, and the order in which they are flown."""

from magsim.sweep.space.constraints import Constraint, read_constraint
from magsim.sweep.space.space import DRESSING, Space, SweptFlight

__all__ = ["DRESSING", "Constraint", "Space", "SweptFlight", "read_constraint"]

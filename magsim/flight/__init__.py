"""Flying: a scenario and its aircraft become a flight.

``path`` plans it over ground, ``model`` is the aircraft in JSBSim, ``pilot`` flies it, ``carriers`` are the ways to fly
one, ``tow`` is the bird under it; ``flying`` joins them.
"""

from magsim.flight.flying import fly
from magsim.flight.over_sea import check_over_sea

__all__ = ["check_over_sea", "fly"]

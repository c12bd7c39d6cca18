"""Flying: a scenario and its aircraft become a flight.

``path`` plans it over ground, ``model`` is the aircraft in JSBSim, ``pilot`` flies it, ``carriers`` are the ways to fly
one, ``tow`` is the bird under it; ``flying`` joins them.
"""

from magsim.flight.flying import bare_run, fly
from magsim.flight.over_sea import check_over_sea

__all__ = ["bare_run", "check_over_sea", "fly"]

"""Planning: when each maneuver of a leg is flown, and whether a described flight can be flown at all.

``FlyableScenario`` is the scenario that ``load_scenario`` reads: a ``Scenario`` whose tables are checked against each
other, with every problem reported in one pass.
"""

from magsim.planning.flyable import FlyableScenario
from magsim.planning.geology import shortest_crust_m
from magsim.planning.legs import legs_allowed
from magsim.planning.schedule import ScheduledOscillation, needed_s, schedule
from magsim.planning.sea import check_swell
from magsim.planning.tow import WHIP_G

__all__ = [
    "WHIP_G",
    "FlyableScenario",
    "ScheduledOscillation",
    "check_swell",
    "legs_allowed",
    "needed_s",
    "schedule",
    "shortest_crust_m",
]

"""Survey files that are compensated: the same file with the compensated reading and what was removed."""

from magsim.exchange.compensating.feed import LineFeed
from magsim.exchange.compensating.files import calibrate, compensate
from magsim.exchange.compensating.lines import PickedLines
from magsim.exchange.compensating.reading import SurveyFile, read_map, read_survey
from magsim.exchange.compensating.writing import write_compensated

__all__ = [
    "LineFeed",
    "PickedLines",
    "SurveyFile",
    "calibrate",
    "compensate",
    "read_map",
    "read_survey",
    "write_compensated",
]

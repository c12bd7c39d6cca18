"""The field without the aircraft: main field, crust, targets and time variation, at a flight and at a base station."""

from magsim.field.background.crust import CrustField, crust_of
from magsim.field.background.main_field import earth_along
from magsim.field.background.station import station_field
from magsim.field.background.targets import sources_of
from magsim.field.background.variation import variation_n

__all__ = [
    "CrustField",
    "crust_of",
    "earth_along",
    "sources_of",
    "station_field",
    "variation_n",
]

"""The Earth: WGS-84 ellipsoid, normal gravity, standard atmosphere, UTM and the IGRF-14 main field."""

from magsim.earth.igrf import decimal_year, decimal_years, igrf
from magsim.earth.local import LocalFrame
from magsim.earth.raster import Raster
from magsim.earth.utm import utm, utm_zone
from magsim.earth.wgs84 import (
    ecef_from_geodetic,
    geodetic_from_ecef,
    quaternion_en_at,
    radii_of_curvature,
    rot_ne_at,
    transport_rate,
)

__all__ = [
    "LocalFrame",
    "Raster",
    "decimal_year",
    "decimal_years",
    "ecef_from_geodetic",
    "geodetic_from_ecef",
    "igrf",
    "quaternion_en_at",
    "radii_of_curvature",
    "rot_ne_at",
    "transport_rate",
    "utm",
    "utm_zone",
]

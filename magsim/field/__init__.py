"""The magnetic field at each mount: the Earth, and everything the aircraft adds to it."""

from magsim.field.background.whole import Background
from magsim.field.composition import backgrounds_of, compute_field
from magsim.field.metal.skin.mesh import Outline, outline
from magsim.field.response import (
    AircraftResponse,
    compute_response,
    load_response,
    obstacles,
    response_at,
    skin_model,
)
from magsim.field.tow import compute_tow_field

__all__ = [
    "AircraftResponse",
    "Background",
    "Outline",
    "backgrounds_of",
    "compute_field",
    "compute_response",
    "compute_tow_field",
    "load_response",
    "obstacles",
    "outline",
    "response_at",
    "skin_model",
]

"""The magnetic field at each mount: the Earth, and everything the aircraft adds to it."""

from magsim.field.composition import compute_field
from magsim.field.response import AircraftResponse, compute_response, load_response, obstacles, response_at

__all__ = ["AircraftResponse", "compute_field", "compute_response", "load_response", "obstacles", "response_at"]

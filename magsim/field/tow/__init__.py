"""The field of a tow: the bird's own parts, the carrier's field at the bird, and the changes by its swing."""

from magsim.field.tow.bird import compute_tow_field

__all__ = ["compute_tow_field"]

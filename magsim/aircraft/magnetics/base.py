"""Types that all parts of ``magnetics.toml`` share."""

import math
from typing import Annotated

from pydantic import BeforeValidator, Field

from magsim.config import Name, Vector

Positive = Annotated[float, Field(gt=0.0)]
NonNegative = Annotated[float, Field(ge=0.0)]
Source = Annotated[str, Field(min_length=4, description="where the numbers come from, or 'estimate: ...'")]

Hangs = Annotated[Name | None, Field(description="rubber mounts on which it hangs")]


def unit(value: Vector) -> Vector:
    """Check that a direction is a unit vector.

    Raises
    ------
    ValueError
        If its length is not 1.
    """
    length = math.hypot(*value)
    if not abs(length - 1.0) < 1e-6:
        msg = f"has length {length:.6g}; allowed: a unit vector"
        raise ValueError(msg)
    return value


def as_tuple(value: object) -> object:
    """Return a list as a tuple, for strict tuples in TOML."""
    return tuple(value) if isinstance(value, list) else value


Vertices = Annotated[tuple[Vector, ...], BeforeValidator(as_tuple), Field(min_length=3)]

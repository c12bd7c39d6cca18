"""A coefficient of a fitted method, as reports list it."""

from typing import NamedTuple


class Term(NamedTuple):
    """One coefficient of a fitted model."""

    name: str
    value: float
    unit: str
    error: float | None = None
    """Standard error, in the same unit; None where the method does not know it."""
    group: str = ""
    """What it belongs to: ``permanent``, ``induced``, ``eddy``, ... (``Compensator.shares`` sums by it)."""

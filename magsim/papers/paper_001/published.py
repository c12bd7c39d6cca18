"""What paper 001 prints: Tables 1 and 2 of Yu et al., Appl. Sci. 2022, 12, 10759."""

from collections.abc import Mapping
from typing import NamedTuple


class Printed(NamedTuple):
    """A row: STD before and after compensation [nT], and their ratio."""

    before_nt: float
    after_nt: float
    ir: float


TABLE_1: Mapping[tuple[str, str], Printed] = {
    ("A", "least_squares"): Printed(2.171, 0.355, 6.115),
    ("A", "ridge"): Printed(2.171, 0.324, 6.701),
}
"""By the flight that is judged, which the other one trained for, and the method."""

TABLE_2: Mapping[tuple[str, str], Printed] = {
    ("B", "bp"): Printed(2.334, 0.294, 7.939),
    ("B", "res_bp"): Printed(2.334, 0.260, 8.977),
    ("A", "bp"): Printed(2.112, 0.285, 7.411),
    ("A", "res_bp"): Printed(2.112, 0.266, 7.940),
}

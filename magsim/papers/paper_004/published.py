"""What paper 004 prints: Table 6 of Liu et al., J. Geod. Geoinf. Sci. 2021, 4(4), 74-83."""

import math
from collections.abc import Mapping
from typing import NamedTuple


class Experiment(NamedTuple):
    """A row of Table 6: STD [nT] of the raw data and of what each method leaves."""

    raw: float
    least_squares: float
    aircraft: float
    all_nets: float

    @property
    def field_nt(self) -> float:
        """What the nets of the field take beyond those of the aircraft, if the two are uncorrelated [nT]: derived."""
        return math.sqrt(self.aircraft**2 - self.all_nets**2)


TABLE_6: Mapping[str, Experiment] = {
    "UAV2": Experiment(17.8126, 1.1256, 0.9324, 0.5004),
    "UAV3": Experiment(41.1538, 0.7028, 0.4856, 0.4855),
    "SCSS1": Experiment(191.8949, 23.0391, 0.7030, 0.6018),
    "SCSS2": Experiment(118.0897, 45.7260, 5.6801, 1.0443),
}
"""By the code of the experiment."""

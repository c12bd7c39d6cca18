"""Temperature along a flight: of the air at the height flown, and of magnets and metal that follow it late."""

from dataclasses import dataclass

import numpy as np

from magsim.earth.atmosphere import standard_temperature_c
from magsim.population.spreads import ALUMINUM_PER_K, DAY, MAGNETS, REFERENCE_C
from magsim.signals import first_order_lag


@dataclass(frozen=True)
class Warmth:
    """How much warmer magnets and metal are than the air at the start's height, whose temperature they had there.

    Attributes
    ----------
    air_c : float [degC]
        Of that air: the moments and the conductivities of a day's aircraft hold for it.
    magnets_k, metal_k : (n,) [K]
    """

    air_c: float
    magnets_k: np.ndarray
    metal_k: np.ndarray

    @classmethod
    def along(cls, alt_m: np.ndarray, start_alt_m: float, air_c: float, step_s: float) -> "Warmth":
        """Return the warmth at heights (n,) [m] of evenly spaced samples; it begins in the air of the first one."""
        outside_k = standard_temperature_c(alt_m) - standard_temperature_c(start_alt_m)
        late = (first_order_lag(outside_k, DAY[lag].size[0], 1.0 / step_s) for lag in ("magnet_lag", "metal_lag"))
        return cls(air_c, *late)

    def moment(self, magnet: str) -> np.ndarray:
        """Return the change of a magnet's moment over its moment in the air of the start's height, (n,)."""
        per_k = MAGNETS[magnet][0]
        return per_k * self.magnets_k / (1.0 + per_k * (self.air_c - REFERENCE_C))

    @property
    def resistance(self) -> np.ndarray:
        """Resistance of aluminum over that in the air of the start's height, (n,)."""
        return 1.0 + ALUMINUM_PER_K * self.metal_k / (1.0 + ALUMINUM_PER_K * (self.air_c - REFERENCE_C))

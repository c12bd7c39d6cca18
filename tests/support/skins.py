"""Time constants of thin shells without any reduction, as a reference."""

import numpy as np
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from magsim.field.metal.skin.shells import ThinShells


def time_constants(shells: ThinShells, count: int) -> np.ndarray:
    """Return the longest time constants, (count,) [s], of ``L u = tau R u``."""
    resistance, inductance = shells.resistance, shells.inductance
    shape = resistance.shape
    inverse = LinearOperator(shape, matvec=splu(resistance).solve, dtype=float)
    start = np.cos(np.arange(shape[0]))  # any fixed vector; a random one would change from run to run
    tau = eigsh(inductance, k=count, M=resistance, Minv=inverse, which="LA", v0=start, return_eigenvectors=False)
    return np.sort(tau)[::-1]

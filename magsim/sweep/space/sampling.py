"""Numbers between 0 and 1 for each flight of a sweep, by its index.

Each axis has numbers of its own, by its name, in blocks; so the number of flight k on an axis depends neither on how
many flights there are nor on the other axes, and any flight's can be asked for alone. scipy's own scrambling would not
keep that: one more dimension changes the columns before it, and a Latin hypercube of more points is another one.
"""

from functools import lru_cache

import numpy as np
from scipy.stats import qmc

from magsim.streams import stream

BLOCK = 4096
"""Numbers that are drawn at once, where the method leaves it open: a power of two, as Sobol points want it."""

SOBOL_BITS = 30
"""Of scipy's Sobol points."""


def numbers(
    method: str, seed: int, name: str, index: np.ndarray, *, dimension: int = 0, block: int = BLOCK
) -> np.ndarray:
    """Return the numbers of flights on one axis.

    Parameters
    ----------
    method : str
        ``random``, ``sobol`` or ``latin_hypercube``.
    seed : int
        Of the sweep.
    name : str
        Of the axis.
    index : (n,) int
        Indices of the flights, 0 or larger.
    dimension : int
        Of a Sobol axis, its number among them.
    block : int
        Flights of one Latin hypercube.

    Returns
    -------
    (n,)
        Above 0 and below 1.
    """
    size = block if method == "latin_hypercube" else BLOCK
    which, place = np.divmod(np.asarray(index, dtype=np.int64), size)
    out = np.empty(len(place))
    for number in np.unique(which):
        here = which == number
        column = _block(method, seed, name, number=int(number), dimension=dimension, size=size)
        out[here] = column[place[here]]
    return out


@lru_cache(maxsize=512)
def _block(method: str, seed: int, name: str, *, number: int, dimension: int, size: int) -> np.ndarray:
    """Return the numbers of one block, (size,)."""
    if method == "sobol":
        return _sobol(seed, name, number, dimension, size)
    random = stream(seed, f"sweep/{name}/{method}/{number}")
    if method == "latin_hypercube":
        column = qmc.LatinHypercube(1, rng=random).random(size)[:, 0]
    else:
        column = random.random(size)
    return np.clip(column, 2.0**-54, 1.0 - 2.0**-53)


def _sobol(seed: int, name: str, number: int, dimension: int, size: int) -> np.ndarray:
    """Return a block of one dimension of Sobol's sequence, shifted digit by digit.

    The shift of an axis is drawn by its name (Owen 2003, "Quasi-Monte Carlo sampling", section 4): it keeps the
    stratification of the points, and does not depend on the other dimensions.
    """
    points = qmc.Sobol(dimension + 1, scramble=False)
    if number:
        points.fast_forward(number * size)
    whole = (points.random(size)[:, dimension] * 2.0**SOBOL_BITS).astype(np.int64)
    shift = int(stream(seed, f"sweep/{name}/sobol").integers(2**SOBOL_BITS))
    return ((whole ^ shift) + 0.5) / 2.0**SOBOL_BITS

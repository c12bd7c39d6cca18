"""Named random streams: each purpose has its own, so adding one never changes another."""

import hashlib

import numpy as np


def stream(seed: int, name: str) -> np.random.Generator:
    """Return an independent random generator for one purpose.

    Parameters
    ----------
    seed : int
        The scenario's seed, 0 or larger.
    name : str
        Purpose of the numbers, for example ``"scalar/cabin/noise"``.

    Returns
    -------
    numpy.random.Generator
        PCG64 seeded by ``SeedSequence(seed, spawn_key=sha256(name))``.
    """
    digest = hashlib.sha256(name.encode()).digest()
    key = tuple(int.from_bytes(digest[i : i + 4], "little") for i in range(0, 16, 4))
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=key)))


def integer_seed(seed: int, name: str) -> int:
    """Return an integer in [1, 2^31), for libraries with plain seeds (JSBSim's turbulence)."""
    return int(stream(seed, name).integers(1, 2**31))

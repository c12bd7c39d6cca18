"""Random draws: streams of an individual, and the laws of ``magsim.population.spreads``."""

import math
from dataclasses import dataclass

import numpy as np

from magsim.config import Vector
from magsim.streams import stream

MOST_SIGMAS = 3.0
"""Normal numbers beyond are drawn again: parts so far off are not built in."""


@dataclass(frozen=True)
class Draws:
    """The random streams of one individual of a type: one for each name, whatever the scenario and its seed.

    Attributes
    ----------
    type_name : str
    number : int
        Of the individual.
    attempt : int
        Counts up where what was drawn cannot be built.
    """

    type_name: str
    number: int
    attempt: int = 0

    def __call__(self, name: str) -> np.random.Generator:
        """Return the stream of a name, for example ``"moment/engine"``."""
        again = f"/again_{self.attempt}" if self.attempt else ""
        return stream(self.number, f"population/{self.type_name}/{name}{again}")


def normal(random: np.random.Generator) -> float:
    """Return a normal number within ``MOST_SIGMAS``."""
    while True:
        value = float(random.standard_normal())
        if abs(value) <= MOST_SIGMAS:
            return value


def lognormal(random: np.random.Generator, sigma: float) -> float:
    """Return a positive number with a median of 1 whose logarithm has the standard deviation ``sigma``."""
    return math.exp(sigma * normal(random))


def direction(random: np.random.Generator) -> np.ndarray:
    """Return a unit vector, all directions alike, (3,)."""
    vector = random.standard_normal(3)
    return vector / np.linalg.norm(vector)


def turned(random: np.random.Generator, vector: np.ndarray, sigma_deg: float) -> np.ndarray:
    """Return a vector turned about a random axis across it by a normal angle, (3,)."""
    size = np.linalg.norm(vector)
    if size == 0.0:
        return vector
    along = vector / size
    across = direction(random)
    across = across - along * (across @ along)
    across /= np.linalg.norm(across)
    angle = math.radians(sigma_deg) * normal(random)
    return size * (math.cos(angle) * along + math.sin(angle) * across)


def box(random: np.random.Generator, half: float) -> np.ndarray:
    """Return a vector whose components are even within ``half`` either way, (3,)."""
    return random.uniform(-half, half, 3)


def between(random: np.random.Generator, sizes: tuple[float, ...]) -> float:
    """Return a number even between two."""
    least, largest = sizes
    return float(random.uniform(least, largest))


def either_sign(random: np.random.Generator, least: float, largest: float) -> Vector:
    """Return three numbers of sizes even between two, with any signs."""
    x, y, z = random.uniform(least, largest, 3) * random.choice([-1.0, 1.0], 3)
    return float(x), float(y), float(z)


def vector(values: np.ndarray) -> Vector:
    """Return three numbers as a setting."""
    x, y, z = (float(value) for value in values)
    return x, y, z

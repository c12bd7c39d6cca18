"""Lengths that no aircraft has: places in millimeters or inches."""

from collections.abc import Iterator, Mapping

from magsim.aircraft.bird import BirdFacts
from magsim.aircraft.facts import Facts
from magsim.aircraft.kinematic import KinematicFacts
from magsim.aircraft.magnetics import Magnetics

LARGEST_M = 100.0
"""From the datum of a carrier of unknown size. The longest aircraft had 84 m (Antonov An-225), its datum is inside."""

SIZES = 2.0
"""How many lengths or spans of a body its parts may be from its datum. Estimate: with a boom of a third of the length,
nothing is farther than 1.4."""


def reach_m(facts: Facts | KinematicFacts | BirdFacts) -> float:
    """Return how far from the datum a part of a body may be [m]."""
    if isinstance(facts, Facts):
        return SIZES * max(facts.geometry.length.value, facts.geometry.span.value)
    return SIZES * facts.body.length.value if isinstance(facts, BirdFacts) else LARGEST_M


def beyond_hull(magnetics: Magnetics, facts: Facts | KinematicFacts | BirdFacts) -> Iterator[tuple[str, str]]:
    """Yield the lengths of magnetic parts and mounts that are beyond the reach of the body: key and text."""
    most = reach_m(facts)
    for key, length in _lengths(magnetics.model_dump(), ""):
        if abs(length) > most:
            yield key, f"{length:g} m is off the hull; allowed: {-most:g} to {most:g}, lengths are in meters"


def _lengths(value: object, key: str) -> Iterator[tuple[str, float]]:
    """Yield every number whose key names meters, below a table."""
    if isinstance(value, Mapping):
        for name, inner in value.items():
            yield from _lengths(inner, f"{key}.{name}" if key else str(name))
    elif isinstance(value, list | tuple):
        for i, inner in enumerate(value):
            yield from _lengths(inner, f"{key}[{i}]")
    elif isinstance(value, float) and key.rpartition(".")[2].partition("[")[0].endswith("_m"):
        yield key, value

"""Nodes of speed and height at which the loops are calibrated, and what holds between them.

A calibration takes seconds, and a sweep may fly at every speed and height. What it finds changes smoothly with both,
so it is measured at nodes alone and is linear between the three around a flight. What a flight gets depends on its own
speed and height, not on what was flown before it.
"""

import math
from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from magsim.aircraft.facts import Facts
from magsim.flight.model.setup import PlantSetup

HEIGHTS_M = (500.0, *np.arange(1000.0, 21_000.0, 2000.0).tolist())
"""Heights of nodes. The lowest is clear of the ground; the density below differs by a twentieth at most."""

SPEED_STEPS_MPS = (1.0, 2.5, 5.0, 10.0)
SPEED_STEPS_UP_TO_HIGHEST = 12
"""Speeds of nodes are multiples of the largest of these steps of which so many fit below the highest speed."""

Arrays = dict[str, np.ndarray]
Parts = Sequence[tuple[float, Arrays]]
"""Calibrations with weights that sum up to 1."""


class Node(NamedTuple):
    """A speed and a height with a calibration, and its weight at a flight."""

    weight: float
    setup: PlantSetup


def between_nodes(
    facts: Facts,
    setup: PlantSetup,
    calibrated: Callable[[PlantSetup], Arrays],
    mixed: Callable[[Parts], Arrays],
) -> Arrays:
    """Return a calibration at a speed and a height.

    Parameters
    ----------
    facts : Facts
    setup : PlantSetup
    calibrated : callable
        Finds the calibration of a setup in the cache, or makes it; nothing where the aircraft cannot fly it.
    mixed : callable
        The mean of calibrations.

    Returns
    -------
    dict of str to array
        What is measured there, where the aircraft cannot fly the calibration at one of the nodes around; nothing where
        it cannot fly it there either.
    """
    parts = [(node.weight, calibrated(node.setup)) for node in nodes_around(facts, setup)]
    if not all(arrays for _, arrays in parts):
        return calibrated(setup)
    return parts[0][1] if len(parts) == 1 else mixed(parts)


def nodes_around(facts: Facts, setup: PlantSetup) -> list[Node]:
    """Return the corners of the triangle of nodes around a speed and a height, without those of no weight.

    A cell between two speeds and two heights is two triangles; on their common side the speed is as far from the lower
    node as the height.
    """
    highest = facts.limits.speed_mps[1]
    fitting = [step for step in SPEED_STEPS_MPS if step * SPEED_STEPS_UP_TO_HIGHEST <= highest]
    step = max(fitting, default=SPEED_STEPS_MPS[0])
    number = math.floor(setup.speed_mps / step)
    speeds = (step * number, step * (number + 1))
    above = min(max(bisect_right(HEIGHTS_M, setup.alt_m), 1), len(HEIGHTS_M) - 1)
    heights = HEIGHTS_M[above - 1 : above + 1]
    fast = (setup.speed_mps - speeds[0]) / step
    high = min(max((setup.alt_m - heights[0]) / (heights[1] - heights[0]), 0.0), 1.0)
    middle = (1, 0) if fast >= high else (0, 1)
    weights = {(0, 0): 1.0 - max(fast, high), middle: abs(fast - high), (1, 1): min(fast, high)}
    return [
        Node(weight, replace(setup, speed_mps=speeds[i], alt_m=heights[j]))
        for (i, j), weight in weights.items()
        if weight > 0.0
    ]


def mean(parts: Parts) -> Arrays:
    """Return the weighted mean of each array."""
    return {name: weighted([(weight, arrays[name]) for weight, arrays in parts]) for name in parts[0][1]}


def weighted(values: Sequence[tuple[float, np.ndarray]]) -> np.ndarray:
    """Return the sum of arrays times their weights."""
    out = np.zeros(values[0][1].shape)
    for weight, value in values:
        out += weight * value
    return out

"""The worlds of paper 003: interference drawn from Tolles-Lawson coefficients, in place of an aircraft; and its split.

The paper makes its data from Tolles-Lawson coefficients that it does not print, at 12 to 20 uT from peak to peak, a
third of the Earth's field: no aircraft. Such a world is made here from the attitude of a flight without any aircraft's
field, by the paper's equations 1 to 5, in which interference adds to the strength of the field.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from magsim import columns
from magsim.compensation.columns.tolles_lawson import term_groups, tolles_lawson_columns
from magsim.papers.rows import TEST, TRAIN, VALID, split_as
from magsim.recording import Recording
from magsim.streams import stream

SENSOR = "boom"
"""The scalar magnetometer of the path."""

TEST_SHARE = 0.2
"""Last part of the flight, which is the test (section 3.2)."""

VALID_SHARE = 0.2
"""Of the rows before, their last part, which tells when to stop: an estimate, the paper does not print it."""

LEVELS_NT = (11968.55, 19718.07)
"""Least and most peak to peak before compensation on the paper's test segments (Table 3)."""

TERMS = 18

GROUPS: Mapping[str, tuple[str, ...]] = {
    "drawn": ("permanent", "induced", "eddy"),
    "static": ("permanent", "induced"),
    "dynamic": ("eddy",),
}
"""Parts of the interference in each world: all; those of Table 1, at rest in a constant field, and of eddy currents."""

NO_AIRCRAFT = tuple(
    f"field.{part}.enabled=false"
    for part in ("permanent", "hinged", "propeller", "induced", "memory", "eddy", "electronics")
)
"""Settings of a path without an aircraft's field."""


def split_by_time(recording: Recording) -> Recording:
    """Return a recording whose last fifth is the test, and the last fifth of the rows before it for validation."""
    count = len(recording)
    test = count - round(TEST_SHARE * count)
    split = np.full(count, TRAIN)
    split[test - round(VALID_SHARE * test) :] = VALID
    split[test:] = TEST
    return split_as(recording, split)


def background_of(recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Return direction, (n, 3), and strength, (n,) [nT], of the true field without the aircraft, in body axes."""
    parts = [part for part in columns.components_of(recording.data, SENSOR) if part in columns.BACKGROUND]
    field = np.sum([recording.vector(columns.PART, component=part, sensor=SENSOR) for part in parts], axis=0)
    strength = np.linalg.norm(field, axis=1)
    return field / strength[:, None], strength


def drawn(path: Recording, seed: int, world: str) -> Recording:
    """Return a flight with interference from Tolles-Lawson coefficients in place of an aircraft's.

    The coefficients are normal random numbers. Permanent, induced and eddy part have the same standard deviation, and
    the peak to peak of their sum on the test rows is uniform between ``LEVELS_NT``: both are estimates. The strength of
    the field in the induced and the eddy part is its mean, the constant field of the paper.

    Parameters
    ----------
    path : Recording
        Of ``NO_AIRCRAFT``, split, with full truth.
    seed : int
        Of the coefficients.
    world : str
        Of ``GROUPS``.

    Returns
    -------
    Recording
        Reading, labels and total field hold the interference; the parts of the field, whose sum would not be that
        total, are left out.
    """
    interference = drawn_interference(path, seed, world)
    names = {
        columns.INTERFERENCE.name(sensor=SENSOR): 0.0,
        columns.PROJECTION.name(sensor=SENSOR): 0.0,
        columns.TOTAL.name(sensor=SENSOR): path[columns.CLEAN.name(sensor=SENSOR)],
        columns.MAG.name(sensor=SENSOR): path[columns.MAG.name(sensor=SENSOR)],
    }
    data = {**path.data, **{name: before + interference for name, before in names.items()}}
    return replace(path, data=data).with_truth("sum")


def drawn_interference(path: Recording, seed: int, world: str) -> np.ndarray:
    """Return the interference of a world, (n,) [nT]; see ``drawn``."""
    cosines, strength = background_of(path)
    rates = np.gradient(cosines, path.time_s, axis=0)
    matrix = tolles_lawson_columns(cosines, rates, np.full(len(path), strength.mean()), TERMS)
    random = stream(seed, f"papers/003/{world}")
    coefficients = random.standard_normal(TERMS)
    groups = np.array(term_groups(TERMS))
    total = np.zeros(len(path))
    for group in GROUPS[world]:
        part = matrix[:, groups == group] @ coefficients[groups == group]
        total += part / part.std()
    level = random.uniform(*LEVELS_NT)
    return total * level / np.ptp(total[path.mask(split="test")])

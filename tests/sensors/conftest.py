"""A known field at one mount, and the acquisition of it."""

from collections.abc import Callable

import numpy as np
import pytest

from magsim.sensors import Acquisition
from magsim.truth import FieldTruth

RATE, DURATION = 120.0, 20.0


@pytest.fixture
def acquisition() -> Acquisition:
    return Acquisition.of(times(), DURATION, RATE, 10.0)


def times() -> np.ndarray:
    return np.arange(round(-1.5 * RATE), round((DURATION + 1.5) * RATE) + 1) / RATE


@pytest.fixture
def make_truth() -> Callable[..., FieldTruth]:
    """Truth with parts given as functions of time that return three components."""

    def make(**parts: Callable[[np.ndarray], tuple]) -> FieldTruth:
        t = times()
        arrays = {name: np.stack(np.broadcast_arrays(t, *part(t))[1:], axis=1)[:, None] for name, part in parts.items()}
        return FieldTruth(t, ("cabin",), arrays)

    return make

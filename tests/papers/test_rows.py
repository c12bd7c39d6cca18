"""Rows of papers: other splits of a flight, and legs without their trends."""

import numpy as np

from magsim.papers.rows import TEST, TRAIN, VALID, split_as, straight_legs, without_trends
from magsim.recording import Recording


def flight():
    """Two legs of 20 rows, each with 5 rows of a turn at its end."""
    time_s = np.arange(50) / 10.0
    data = {
        "leg": np.repeat([1.0, 2.0], 25),
        "turn": np.tile(np.repeat([0.0, 1.0], [20, 5]), 2),
        "split": np.zeros(50),
    }
    return Recording("flight", time_s, data)


def test_splits_are_replaced_and_the_rest_stays():
    recording = flight()
    tested = split_as(recording, TEST)
    assert tested.mask(split="test").all()
    held = split_as(recording, np.where(recording["leg"] == 2, VALID, TRAIN))
    np.testing.assert_array_equal(held.mask(split="valid"), recording["leg"] == 2)
    np.testing.assert_array_equal(held.mask(split="train"), recording["leg"] == 1)
    assert recording.mask(split="train").all()
    np.testing.assert_array_equal(held["turn"], recording["turn"])


def test_trends_of_legs_go_and_what_is_across_them_stays():
    """Parabolas about the middle of a leg have neither mean nor trend; each leg has a line of its own."""
    recording = flight()
    across = np.tile(np.concatenate([(np.arange(20) - 9.5) ** 2 - 33.25, np.full(5, 1e6)]), 2)
    line = np.where(recording["leg"] == 1, 3.0 + 7.0 * recording.time_s, 100.0 - recording.time_s)
    legs = straight_legs(recording)
    assert [int(leg.sum()) for leg in legs] == [20, 20]
    expected = np.concatenate([across[leg] for leg in legs])
    np.testing.assert_allclose(without_trends(recording, across + line), expected, atol=1e-9)

"""What Levenberg-Marquardt is given: which rows, and the loss over them."""

import numpy as np
import pytest
import torch

from magsim import signals
from magsim.compensation.networks.losses import band_matrix
from magsim.compensation.networks.squares import LearnedPiece, squares_of
from magsim.errors import DataError, RequestError


def piece(rows, *, unlearned=()):
    """Random rows; the targets of those that are not learned are missing."""
    rng = np.random.default_rng(rows)
    learned = ~np.isin(np.arange(rows), list(unlearned))
    return LearnedPiece(rng.normal(size=(rows, 2)), np.where(learned, rng.normal(size=rows), np.nan), learned)


def test_each_learned_row_with_a_whole_context_counts_once():
    long, short = piece(9, unlearned=[4]), piece(4)
    found = squares_of([long, piece(2), short], 10.0, context=3, window=320, band_weight=0.0)
    places = [(long, k) for k in (2, 3, 5, 6, 7, 8)] + [(short, k) for k in (2, 3)]
    np.testing.assert_array_equal(found.inputs, np.stack([p.inputs[k - 2 : k + 1].T for p, k in places]))
    np.testing.assert_array_equal(found.targets[:, 0], [p.targets[k] for p, k in places])
    assert found.operator is None
    assert found.weights.dtype == torch.float64
    assert bool((found.weights == 1.0).all())


def test_networks_from_windows_to_windows_get_windows():
    whole = piece(23, unlearned=[*range(10), 15])
    found = squares_of([whole, piece(7)], 10.0, context=None, window=10, band_weight=0.0)
    starts = (10, 13)  # nothing of the first is learned, the last ends with the piece
    np.testing.assert_array_equal(found.inputs, np.stack([whole.inputs[s : s + 10].T for s in starts]))
    expected = np.where(whole.learned, whole.targets, 0.0)
    np.testing.assert_array_equal(found.targets, np.stack([expected[s : s + 10] for s in starts]))
    np.testing.assert_array_equal(found.weights, np.stack([whole.learned[s : s + 10] for s in starts]))


@pytest.mark.parametrize(("context", "window", "group"), [(3, 40, 320), (None, 400, 400)])
def test_the_operator_gives_the_mean_squares_of_errors_and_of_errors_in_band(context, window, group):
    """A slow and a fast wave and one in band, against the filter over the whole signal, whose tails groups cut."""
    rows = 20 * (group - 120) + 120 + (context or 1) - 1
    time_s = np.arange(rows) / 10.0
    waves = [np.sin(2.0 * np.pi * f * time_s) for f in (0.01, 0.3, 0.97)]
    errors = 3.0 * waves[0] + 0.2 * waves[1] + 0.1 * waves[2]
    whole = LearnedPiece(np.zeros((rows, 1)), errors, np.ones(rows, dtype=bool))
    found = squares_of([whole], 10.0, context=context, window=window, band_weight=50.0)
    flat = found.targets.reshape(-1, group)
    assert len(flat) == 20
    assert bool((found.weights == 1.0).all())
    squares = ((flat @ found.operator.T) ** 2).sum() / 20 / (group - 120)
    inside = signals.band_pass(errors, 10.0)[300:-300]
    assert float(squares) == pytest.approx(np.mean(errors**2) + 50.0 * np.mean(inside**2), rel=0.05)
    # four rows at 10 Hz are as good as one
    band = 50.0**0.5 * torch.from_numpy(band_matrix(group, 10.0))
    every = ((flat[:, 60:-60] ** 2).sum() + ((flat @ band.T) ** 2).sum()) / 20 / (group - 120)
    assert float(squares) == pytest.approx(float(every), rel=0.01)


def test_pieces_that_are_too_short_are_reported():
    with pytest.raises(DataError, match="takes 322 rows at once, but the longest piece without a gap has 200"):
        squares_of([piece(200)], 10.0, context=3, window=320, band_weight=1.0)
    with pytest.raises(RequestError, match="too short for the in-band loss"):
        squares_of([piece(200)], 10.0, context=None, window=100, band_weight=1.0)

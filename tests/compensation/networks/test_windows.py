"""A network over a whole recording, piece by piece."""

import numpy as np
import pytest
import torch

from magsim.compensation.networks.modules.branches import AddedBranches, Branch
from magsim.compensation.networks.modules.perceptrons import SampleMLP, WindowMLP
from magsim.compensation.networks.windows import BATCH, apply_network

TIME_S = np.concatenate([np.arange(40), np.arange(60, 67), np.arange(100, 100 + BATCH + 30)]) / 10.0
INPUTS = np.random.default_rng(0).normal(size=(len(TIME_S), 3)).astype(np.float32)
PIECES = (slice(0, 40), slice(40, 47), slice(47, None))


@pytest.fixture(autouse=True)
def _seed():
    with torch.random.fork_rng():
        torch.manual_seed(0)
        yield


def test_windows_that_end_at_each_row():
    """By hand, row by row; the first rows of a piece, and pieces shorter than a window, have no value."""
    module = WindowMLP(3, 8, (4,))
    got = apply_network(module, INPUTS, TIME_S, window=8, stride=4, context=8)
    expected = np.full(len(TIME_S), np.nan)
    for piece in PIECES:
        for row in range(piece.start + 7, len(TIME_S) if piece.stop is None else piece.stop):
            window = torch.from_numpy(INPUTS[row - 7 : row + 1].T.copy())[None]
            expected[row] = module(window).item()
    assert np.isnan(expected).sum() == 7 + 7 + 7
    np.testing.assert_allclose(got, expected, rtol=1e-5, atol=1e-6)


def test_overlapping_windows_of_a_network_without_memory_give_the_network():
    module = SampleMLP(3, (4,))
    got = apply_network(module, INPUTS, TIME_S, window=8, stride=4, context=None)
    with torch.no_grad():
        expected = module(torch.from_numpy(INPUTS.T.copy())[None])[0].numpy()
    np.testing.assert_allclose(got, expected, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("window", [3, 8, 60])
def test_windows_side_by_side_give_each_row_what_its_own_rows_give(window):
    """Outputs from three rows each, in windows of any length; a piece shorter than a window has them too."""
    module = AddedBranches({"all": Branch((0, 1, 2), 4)}, 3)
    got = apply_network(module, INPUTS, TIME_S, window=window, stride=4, context=3)
    expected = apply_network(module, INPUTS, TIME_S, window=3, stride=1, context=3)
    assert np.flatnonzero(np.isnan(got)).tolist() == [0, 1, 40, 41, 47, 48]
    np.testing.assert_allclose(got, expected, rtol=1e-5, atol=1e-6)


def test_the_part_of_the_platform_is_what_the_network_says():
    branches = {"field": Branch((0,), 4, platform=False), "own": Branch((1, 2), 4)}
    module, settings = AddedBranches(branches, 1), {"window": 8, "stride": 4, "context": 1}
    whole, own = (apply_network(module, INPUTS, TIME_S, **settings, platform=part) for part in (False, True))
    field = module.perceptrons["field"](torch.from_numpy(INPUTS[:, :1]))[:, 0].detach().numpy()
    assert np.abs(field).max() > 0.1
    np.testing.assert_allclose(whole - own, field, rtol=1e-5, atol=1e-6)
    plain = SampleMLP(3, (4,))
    one, other = (apply_network(plain, INPUTS, TIME_S, **settings, platform=part) for part in (False, True))
    np.testing.assert_array_equal(one, other)


class Sum(torch.nn.Module):
    """Sum of a window, at all its rows."""

    def forward(self, x):
        return x.sum(dim=(1, 2))[:, None].expand(-1, x.shape[2])


def test_no_window_spans_a_gap():
    """What is added to one piece changes that piece alone."""
    changed = INPUTS.copy()
    changed[PIECES[1]] += 1.0
    one, other = (apply_network(Sum(), x, TIME_S, window=8, stride=4, context=None) for x in (INPUTS, changed))
    different = one != other
    assert different[PIECES[1]].all()
    assert not different[PIECES[0]].any()
    assert not different[PIECES[2]].any()


def test_the_network_is_used_in_evaluation_mode():
    module = torch.nn.Sequential(torch.nn.Dropout(0.5), SampleMLP(3, (4,)))
    module.train()
    one, other = (apply_network(module, INPUTS, TIME_S, window=8, stride=4, context=None) for _ in range(2))
    np.testing.assert_array_equal(one, other)

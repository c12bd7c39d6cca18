import numpy as np
import pytest
import torch

from magsim.training import RandomWindows, overlap_add, starts_of


def test_windows_stay_inside_their_piece_and_all_offsets_come():
    pieces = [np.arange(0.0, 50.0), np.arange(1000.0, 1008.0), np.arange(2000.0, 2030.0)]
    windows = RandomWindows(
        [p[:, None] * [1.0, 2.0] for p in pieces], [p[:, None] for p in pieces], length=10, batch=64
    )
    assert windows.rows == 80
    generator = torch.Generator().manual_seed(0)
    firsts = set()
    for _ in range(40):
        x, y = windows(generator)
        assert x.shape == (64, 2, 10)
        assert y.shape == (64, 1, 10)
        assert torch.equal(x[:, 1], 2.0 * y[:, 0])
        assert torch.equal(y[:, 0].diff(dim=1), torch.ones(64, 9))
        firsts |= set(y[:, 0, 0].tolist())
    assert firsts == {*range(41), *range(2000, 2021)}


def test_no_piece_is_as_long_as_a_window():
    with pytest.raises(ValueError, match="a window has 10 rows, but the longest piece without a gap has 9"):
        RandomWindows([np.zeros((9, 1))], [np.zeros((9, 1))], length=10, batch=1)


@pytest.mark.parametrize(
    ("rows", "expected"), [(5, [0]), (10, [0]), (11, [0, 1]), (25, [0, 5, 10, 15]), (27, [0, 5, 10, 15, 17])]
)
def test_windows_cover_a_piece(rows, expected):
    assert starts_of(rows, 10, 5) == expected


@pytest.mark.parametrize("rows", [3, 20, 63, 200])
def test_overlapping_windows_of_a_memoryless_function_give_the_function(rows):
    x = np.random.default_rng(0).normal(size=(rows, 3)).astype(np.float32)
    got = overlap_add(lambda windows: windows.sum(axis=1), x, length=20, stride=5, batch=3)
    np.testing.assert_allclose(got, x.sum(axis=1), rtol=1e-5, atol=1e-5)


def test_overlapping_windows_are_weighted_by_their_middle():
    """A function that is wrong at the ends of its window hurts little where windows overlap."""

    def edges(windows):
        out = np.zeros((len(windows), windows.shape[2]))
        out[:, [0, -1]] = 1.0
        return out

    got = overlap_add(edges, np.zeros((100, 1)), length=20, stride=5)
    assert got[[0, -1]] == pytest.approx([1.0, 1.0])
    assert got[20:80].max() < 0.02

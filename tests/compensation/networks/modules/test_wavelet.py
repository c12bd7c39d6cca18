"""Wavelet parts by hand, and the bidirectional LSTM on them."""

import numpy as np
import pytest
import torch

from magsim.compensation.networks.counting import multiply_accumulates, parameters
from magsim.compensation.networks.modules.wavelet import WaveletBiLSTM, wavelet_parts


@pytest.fixture(autouse=True)
def _seed():
    with torch.random.fork_rng():
        torch.manual_seed(0)
        yield


def test_parts_are_those_of_the_haar_wavelet_and_add_up():
    """Level j smooths over 2^(j + 1) samples: a running mean, here by a plain loop."""
    x = torch.randn(1, 1, 40, dtype=torch.float64)
    parts = wavelet_parts(x, 3)
    assert len(parts) == 4
    torch.testing.assert_close(sum(parts), x, rtol=0, atol=1e-14)
    held = np.concatenate([np.full(8, float(x[0, 0, 0])), x[0, 0].numpy()])
    means = [np.array([held[8 + t - size + 1 : 8 + t + 1].mean() for t in range(40)]) for size in (1, 2, 4, 8)]
    for level in range(3):
        np.testing.assert_allclose(parts[level][0, 0], means[level] - means[level + 1], rtol=0, atol=1e-14)
    np.testing.assert_allclose(parts[3][0, 0], means[3], rtol=0, atol=1e-14)


def test_a_constant_has_no_details_and_a_slow_signal_equal_ones():
    assert not torch.cat(wavelet_parts(torch.full((1, 2, 9), 3.0), 5)[:-1]).any()
    t = torch.arange(4000, dtype=torch.float64)
    parts = wavelet_parts(torch.sin(2.0 * np.pi * t / 1000.0)[None, None], 4)
    sizes = [float(part.std()) for part in parts[:4]]
    np.testing.assert_allclose(np.diff(np.log2(sizes)), 1.0, atol=0.01)


def test_sizes_and_both_directions_of_time():
    module = WaveletBiLSTM(3, hidden=4, levels=2).double()
    # two directions of four gates: 9 features, 4 states, two biases; then 8 weights and a bias
    assert parameters(module) == 2 * 4 * 4 * (9 + 4 + 2) + 9
    assert multiply_accumulates(module, 3, 20) == 20 * (2 * 4 * 4 * (9 + 4) + 8)
    x = torch.randn(2, 3, 20, dtype=torch.float64)
    out = module(x)
    assert out.shape == (2, 20)
    for row in (0, 19):
        changed = x.clone()
        changed[:, :, row] += 1.0
        assert (module(changed) != out).all()


def test_an_untrained_network_returns_zeros_and_can_learn():
    module, x = WaveletBiLSTM(3, hidden=4, levels=2), torch.randn(2, 3, 20)
    assert module(x).abs().max() > 0.01
    module.start_at_zero()
    assert not module(x).any()
    (module(x) - 1.0).square().sum().backward()
    assert module.output.weight.grad.abs().max() > 0.0

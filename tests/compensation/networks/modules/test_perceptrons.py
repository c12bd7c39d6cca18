"""Plain back-propagation networks: sizes, and what each output depends on."""

import pytest
import torch

from magsim.compensation.networks.modules.perceptrons import SampleMLP, WindowMLP


def count(module):
    return sum(parameter.numel() for parameter in module.parameters())


def test_sizes_of_the_plain_networks():
    """Paper 000 prints 0.684 million multiply-accumulates; a perceptron has one for each weight."""
    window = WindowMLP(19, 320, (112,))
    assert count(window) == 681_185
    assert sum(p.numel() for p in window.parameters() if p.ndim == 2) == 681_072
    sample = SampleMLP(18, (64, 64))
    assert count(sample) == 5_441
    assert sum(p.numel() for p in sample.parameters() if p.ndim == 2) == 5_312


def test_a_sample_is_mapped_alone_and_by_the_layers_in_turn():
    torch.manual_seed(0)
    module = SampleMLP(3, (4,), "tanh")
    x = torch.randn(2, 3, 7)
    first, _, last = module.layers
    for row in range(7):
        expected = last(torch.tanh(first(x[:, :, row])))[:, 0]
        torch.testing.assert_close(module(x)[:, row], expected)


def test_a_window_gives_one_value_from_all_its_samples():
    torch.manual_seed(0)
    module = WindowMLP(3, 7, (4, 5), "gelu")
    x = torch.randn(2, 3, 7)
    assert module(x).shape == (2, 1)
    torch.testing.assert_close(module(x), module.layers(x.reshape(2, 21)))
    for row in range(7):
        changed = x.clone()
        changed[:, :, row] += 1.0
        assert not torch.equal(module(changed), module(x))


@pytest.mark.parametrize("make", [lambda: SampleMLP(3, (4,)), lambda: WindowMLP(3, 7, (4,))])
def test_an_untrained_network_returns_zeros_and_can_learn(make):
    torch.manual_seed(0)
    module, x = make(), torch.randn(2, 3, 7)
    assert module(x).abs().max() > 0.01
    module.start_at_zero()
    assert not module(x).any()
    (module(x) - 1.0).pow(2).sum().backward()
    assert module.layers[-1].weight.grad.abs().max() > 0.0

"""Res-Bp: against plain numpy."""

import numpy as np
import pytest
import torch

from magsim.compensation.networks.modules.residual import ResBp

ACTIVATIONS = {"relu": lambda v: np.maximum(v, 0.0), "tanh": np.tanh}


def network(activation):
    torch.manual_seed(0)
    module = ResBp(3, width=4, layers=2, activation=activation).double()
    with torch.no_grad():
        for parameter in module.parameters():
            parameter.normal_()
    return module


@pytest.mark.parametrize("activation", ["relu", "tanh"])
def test_each_sample_goes_through_the_layers_alone(activation):
    module, f = network(activation), ACTIVATIONS[activation]
    x = torch.randn(2, 3, 5, dtype=torch.double)
    w = {name: tensor.detach().numpy() for name, tensor in module.state_dict().items()}
    expected = np.zeros((2, 5))
    for b in range(2):
        for t in range(5):
            z = f(w["layers.0.weight"] @ x[b, :, t].numpy() + w["layers.0.bias"])
            for layer in (2, 3):
                path = f"layers.{layer}.path"
                inner = f(w[f"{path}.0.weight"] @ z + w[f"{path}.0.bias"])
                z = f(z + w[f"{path}.2.weight"] @ inner + w[f"{path}.2.bias"])
            expected[b, t] = (w["head.weight"] @ z + w["head.bias"])[0]
    assert expected.std() > 0.1
    np.testing.assert_allclose(module(x).detach().numpy(), expected, rtol=1e-12, atol=1e-12)


def test_an_untrained_network_returns_zeros_and_can_learn():
    module, x = network("relu"), torch.randn(2, 3, 5, dtype=torch.double)
    module.start_at_zero()
    assert not module(x).any()
    (module(x) - 1.0).pow(2).sum().backward()
    assert module.head.weight.grad.abs().max() > 0.0

"""Weights that are put into a network or kept."""

import pytest
import torch

from magsim.errors import RequestError
from magsim.training import freeze, put_weights


def network():
    return torch.nn.Sequential(torch.nn.Linear(2, 3), torch.nn.BatchNorm1d(3), torch.nn.Linear(3, 1))


def test_weights_are_put_in():
    one, two = network(), network()
    put_weights(one, two.state_dict())
    torch.testing.assert_close(one.state_dict(), two.state_dict(), rtol=0, atol=0)


def test_what_does_not_fit_is_named_and_nothing_is_put_in():
    module, whole = network(), network().state_dict()
    before = {name: tensor.clone() for name, tensor in module.state_dict().items()}
    wrong = [
        (whole | {"2.weight": torch.ones(1, 4)}, r"2\.weight has shape \(1, 4\), and \(1, 3\) in the network"),
        ({name: tensor for name, tensor in whole.items() if name != "0.bias"}, r"they lack 0\.bias, which the network"),
        (whole | {"3.bias": torch.ones(1)}, r"they have 3\.bias, which the network lacks"),
    ]
    for weights, expected in wrong:
        with pytest.raises(ValueError, match=f"^the weights do not fit the network: {expected}[^\n]*$"):
            put_weights(module, weights)
    torch.testing.assert_close(module.state_dict(), before, rtol=0, atol=0)


def test_parameters_are_frozen_by_their_names():
    module = network()
    assert freeze(module, ["0.*", "1.bias"]) == ("0.weight", "0.bias", "1.bias")
    assert {name for name, p in module.named_parameters() if p.requires_grad} == {"1.weight", "2.weight", "2.bias"}
    assert freeze(module, []) == ()


def test_patterns_that_fit_nothing_or_everything_are_refused():
    with pytest.raises(RequestError, match=r"freeze 'blocks\.\*' fits no parameter of Sequential; it has 0\.weight"):
        freeze(network(), ["0.*", "blocks.*"])
    with pytest.raises(RequestError, match=r"freeze \* leaves no parameter of Sequential to train"):
        freeze(network(), ["*"])

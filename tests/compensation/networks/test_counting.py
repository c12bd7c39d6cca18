"""Counts of parameters and multiply-accumulates, against torch's own counter and sizes by hand."""

import pytest
import torch
from torch import nn
from torch.utils.flop_counter import FlopCounterMode

from magsim.compensation.networks.counting import multiply_accumulates, parameters
from magsim.compensation.networks.modules.branches import AddedBranches, Branch
from magsim.compensation.networks.modules.magtcn import MagTCN
from magsim.compensation.networks.modules.perceptrons import SampleMLP, WindowMLP
from magsim.compensation.networks.modules.residual import ResBp
from magsim.compensation.networks.modules.resnet import ResNet


def million(module, channels=19, window=320):
    return multiply_accumulates(module, channels, window) / 1e6


def test_networks_of_paper_000_have_the_sizes_that_it_prints():
    """Its Table 6, 0.238, 0.684, 105.541 and 95.722 million, to 2 %; the last places are those of our sizes."""
    williams = AddedBranches(
        {
            "p": Branch((0, 1, 2, 16, 17, 18), 39),
            "i": Branch(tuple(range(3, 8)), 39),
            "e": Branch(tuple(range(8, 16)), 39),
        },
        320,
    )
    found = {
        "WilliamsNN": (williams, 237_357, 0.237237, 0.238),
        "BPNN": (WindowMLP(19, 320, (112,)), 681_185, 0.681072, 0.684),
        "ResNet": (ResNet(19, width=60, blocks=9, head="last"), 352_201, 105.5232, 105.541),
        "MagTCN": (MagTCN(19, width=48, head="flat", revin=True), 2_246_025, 95.62624, 95.722),
    }
    for module, count, expected, printed in found.values():
        assert parameters(module) == count
        assert million(module) == pytest.approx(expected, abs=5e-7)
        assert million(module) == pytest.approx(printed, rel=0.02)


def test_other_networks_have_the_sizes_of_their_reconstructions():
    assert parameters(ResNet(19, width=64, blocks=8, head="last")) == 357_377
    assert million(ResNet(19, width=64, blocks=8, head="last")) == pytest.approx(106.82, abs=0.005)
    assert (parameters(ResBp(18)), multiply_accumulates(ResBp(18), 18, 1)) == (26_241, 25_792)
    assert (parameters(SampleMLP(18)), multiply_accumulates(SampleMLP(18), 18, 1)) == (5_441, 5_312)
    for (width, head), expected in {(16, "flat"): 20.72, (8, "flat"): 9.78, (8, "per-time"): 7.84}.items():
        assert million(MagTCN(19, width=width, head=head)) == pytest.approx(expected, abs=0.005)


def test_a_causal_magtcn_has_fewer_outputs():
    """By hand: embedding of 64 samples, 54 outputs of the kernel of 11 and of all that follows."""
    m, d, r = 5, 4, 2
    expected = m * d * 64 + 54 * (m * d * 11 + 2 * r * m * d**2 + 2 * r * d * m**2 + m * d + m)
    assert multiply_accumulates(MagTCN(m, width=d, kernel=11, causal=True), m, 64) == expected


def test_subnetworks_of_paper_004():
    """Three taps of 1, 2, 3, 5, 8 and 2 features, half as many units: 534 parameters in all, 478 without the field."""
    sizes = {"Z1": (1, 1), "Z2": (2, 3), "Z3": (3, 4), "Z4": (5, 7), "Z5": (8, 12), "Z6": (2, 3)}
    expected = {"Z1": (6, 4), "Z2": (25, 21), "Z3": (45, 40), "Z4": (120, 112), "Z5": (313, 300), "Z6": (25, 21)}
    for name, (features, hidden) in sizes.items():
        module = AddedBranches({name: Branch(tuple(range(features)), hidden)}, 3)
        assert (parameters(module), multiply_accumulates(module, features, 3)) == expected[name]
    assert sum(count for count, _ in expected.values()) == 534
    assert sum(expected[name][0] for name in ("Z3", "Z4", "Z5")) == 478


@pytest.mark.parametrize(
    "module",
    [
        SampleMLP(5, (4, 3)),
        WindowMLP(5, 64, (4,)),
        ResBp(5, width=4),
        ResNet(5, width=4),
        ResNet(5, width=4, head="last", window=64),
        ResNet(5, width=4, causal=True),
        AddedBranches({"a": Branch((0, 1), 3), "b": Branch((2, 3, 4), 2)}, 7),
        nn.Conv1d(5, 10, 3, groups=5, stride=2),
    ],
    ids=lambda module: type(module).__name__,
)
def test_products_are_those_that_torch_counts(module):
    with FlopCounterMode(display=False) as counter:
        module(torch.zeros(1, 5, 64))
    assert multiply_accumulates(module, 5, 64) == counter.get_total_flops() / 2
    assert module.training


class Turned(nn.Module):
    """A recurrent layer on windows."""

    def __init__(self, layer):
        super().__init__()
        self.layer = layer

    def forward(self, x):
        return self.layer(x.transpose(1, 2))[0]


def test_recurrent_layers_count_every_gate_at_every_sample():
    """LSTM of 64 units on 20 inputs: 4 (20 + 64) 64 = 21,504 a sample; a GRU has three gates."""
    assert multiply_accumulates(Turned(nn.LSTM(20, 64, batch_first=True)), 20, 50) == 21_504 * 50
    assert multiply_accumulates(Turned(nn.GRU(20, 64, batch_first=True)), 20, 50) == 16_128 * 50
    both = nn.LSTM(20, 8, num_layers=2, batch_first=True, bidirectional=True)
    assert multiply_accumulates(Turned(both), 20, 50) == 50 * (2 * 4 * 8 * (20 + 8) + 2 * 4 * 8 * (16 + 8))


def test_frozen_parameters_are_not_counted():
    module = SampleMLP(5, (4,))
    module.layers[0].weight.requires_grad_(False)
    assert parameters(module) == 4 + 4 + 1


def test_a_layer_without_a_rule_is_refused():
    with pytest.raises(ValueError, match="Bilinear has weights of its own and no rule to count them"):
        multiply_accumulates(nn.Bilinear(3, 3, 2), 3, 1)

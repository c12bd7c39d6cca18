"""The neural methods and their presets, as modules."""

import pytest
import torch

from magsim.compensation import create
from magsim.compensation.networks.inputs import fit_inputs
from magsim.compensation.networks.modules.magtcn import MagTCN
from magsim.compensation.networks.modules.perceptrons import SampleMLP, WindowMLP
from magsim.dataset import flights_of, read_training
from tests.support.worlds import World, calibration


@pytest.fixture(autouse=True)
def _seed():
    with torch.random.fork_rng():
        yield


def weights(module):
    return sum(parameter.numel() for parameter in module.parameters())


def columns(count):
    return tuple(f"input {i}" for i in range(count))


def test_presets_of_the_papers_have_the_papers_sizes():
    """19 inputs: 16 Tolles-Lawson columns and an attitude of three angles; see the tests of the modules."""
    assert weights(create("magtcn", preset="paper").make_module(columns(19))) == 2_246_025
    assert weights(create("bpnn", preset="paper").make_module(columns(19))) == 681_185


def test_parameters_reach_the_module():
    method = create("magtcn", width=3, expansion=4, kernel=7, window=40, head="last", revin=True, blocks=2)
    module = method.make_module(columns(6))
    expected = MagTCN(6, width=3, expansion=4, kernel=7, window=40, head="last", revin=True, blocks=2)
    assert {n: p.shape for n, p in module.named_parameters()} == {n: p.shape for n, p in expected.named_parameters()}
    assert module(torch.zeros(2, 6, 40)).shape == (2, 1)


@pytest.mark.parametrize(("activation", "kind"), [("relu", "ReLU"), ("tanh", "Tanh"), ("gelu", "GELU")])
def test_a_perceptron_for_each_sample_or_for_a_window(activation, kind):
    sample = create("bp", hidden=(5, 4), activation=activation).make_module(columns(6))
    window = create("bpnn", window=10, hidden=(5, 4), activation=activation).make_module(columns(6))
    assert isinstance(sample, SampleMLP)
    assert isinstance(window, WindowMLP)
    names = ["Linear", kind, "Linear", kind, "Linear"]
    for module, inputs in ((sample, 6), (window, 60)):
        assert [type(layer).__name__ for layer in module.layers] == names
        assert [layer.in_features for layer in module.layers[::2]] == [inputs, 5, 4]


@pytest.mark.parametrize(
    ("name", "parameters", "context", "outputs"),
    [
        ("magtcn", {}, None, 320),
        ("magtcn", {"head": "flat"}, None, 320),
        ("magtcn", {"head": "last"}, 320, 1),
        ("magtcn", {"causal": True}, 51, 270),
        ("bp", {}, 1, 320),
        ("bpnn", {}, 40, 1),
        ("williams", {}, 1, 320),
        ("williams", {"taps": 320}, 320, 1),
        ("resnet", {}, None, 320),
        ("resnet", {"head": "last"}, 320, 1),
        ("resnet", {"causal": True}, 21, 300),
        ("res_bp", {}, 1, 320),
        ("lstm_bp", {}, 10, 171),
        ("lstm_bp", {"taps": 50, "window": 50}, 50, 1),
        ("gru_bp", {}, 10, 171),
        ("lstm", {}, 10, 171),
        ("pg_tlnet", {}, 1, 320),
        ("ga_bp", {}, 1, 320),
        ("wavelet_bilstm", {}, None, 160),
        ("subnetworks", {}, 3, 318),
    ],
)
def test_which_rows_an_output_is_made_from_and_how_many_a_window_gives(name, parameters, context, outputs):
    settings = create(name, **parameters).settings
    assert (settings.context, settings.outputs) == (context, outputs)
    recording = calibration(World(circuits=1))
    names = fit_inputs(settings, read_training(flights_of(recording)))(recording).names
    module = create(name, **parameters).make_module(names)
    assert module(torch.zeros(2, len(names), settings.window)).shape == (2, outputs)

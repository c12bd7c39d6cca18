"""Methods of paper 003: presets, the grid of its Table 2, and what a fit gives."""

import numpy as np
import pytest
import torch
from torch import nn

from magsim.compensation import create
from magsim.compensation.networks.counting import parameters
from magsim.compensation.networks.inputs import fit_inputs
from magsim.compensation.networks.modules.recurrent import ActivatedLSTM
from magsim.dataset import flights_of, read_training
from magsim.errors import RequestError
from tests.support import scores
from tests.support.worlds import World, calibration


@pytest.fixture(autouse=True)
def _seed():
    with torch.random.fork_rng():
        yield


def columns(count):
    return tuple(f"input {i}" for i in range(count))


@pytest.mark.parametrize(
    ("name", "preset", "weights", "context"),
    [
        ("lstm_bp", "paper", 28_289, 50),
        ("gru_bp", "paper", 22_785, 50),
        ("lstm", "paper", 22_081, 50),
        ("bp", "paper003", 11_009, 1),
    ],
)
def test_presets_of_the_paper_have_its_sizes_and_20_inputs(name, preset, weights, context):
    method = create(name, preset=preset)
    names = fit_inputs(method.settings, read_training(flights_of(calibration(World(circuits=1)))))
    module = method.make_module(names(calibration(World(circuits=1))).names)
    assert parameters(module) == weights
    assert (method.settings.context, method.settings.outputs) == (context, 1)


@pytest.mark.parametrize("layers", [1, 2])
@pytest.mark.parametrize("activation", ["tanh", "sigmoid"])
@pytest.mark.parametrize("dense", [(64,), (64, 32)])
@pytest.mark.parametrize("dense_activation", ["tanh", "relu"])
def test_every_place_of_table_2_can_be_asked_for(layers, activation, dense, dense_activation):
    params = {"layers": layers, "activation": activation, "dense": dense, "dense_activation": dense_activation}
    module = create("lstm_bp", preset="paper", **params).make_module(columns(20))
    assert module.recurrent.num_layers == layers
    assert isinstance(module.recurrent, nn.LSTM if activation == "tanh" else ActivatedLSTM)
    kinds = {"tanh": nn.Tanh, "relu": nn.ReLU}
    assert [type(layer) for layer in module.dense] == [nn.Linear, kinds[dense_activation]] * len(dense)


def test_more_taps_than_rows_of_a_window_are_refused():
    with pytest.raises(RequestError, match="window: 20 rows are fewer than the 30 that an output is made from"):
        create("gru_bp", taps=30, window=20).fit(calibration(World(circuits=1)))
    with pytest.raises(RequestError, match="activation"):
        create("gru_bp", activation="sigmoid")


def test_an_lstm_learns_the_lag_that_tolles_lawson_lacks():
    """Eddy currents that lag by 0.3 s: memory, which the 16 columns of a row do not hold."""
    recording = calibration(World(eddy_tau_s=0.3))
    test = recording.where(split="test")
    truth = test["interference_cabin_nt"]
    ratios = []
    quick = {"stage_band": "broad", "steps": 120, "every": 40, "batch": 8, "learning_rate": 2e-2}
    for method in (create("tolles_lawson", band="broad"), create("lstm", **quick)):
        estimate = method.fit(recording).interference(test)
        late = np.isfinite(estimate)
        ratios.append(scores.improvement_ratio(truth[late], (truth - estimate)[late], 10.0))
    assert late.sum() >= len(test) - 9
    assert ratios[1] > 1.2 * ratios[0]

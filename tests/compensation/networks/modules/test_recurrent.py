"""LSTM-BP, GRU-BP and LSTM of paper 003: sizes, the cell by hand, and what an output is made from."""

import numpy as np
import pytest
import torch
from torch import nn

from magsim.compensation.networks.counting import multiply_accumulates, parameters
from magsim.compensation.networks.modules.recurrent import ActivatedLSTM, RecurrentNet


@pytest.fixture(autouse=True)
def _seed():
    with torch.random.fork_rng():
        torch.manual_seed(0)
        yield


@pytest.mark.parametrize(
    ("settings", "weights", "per_row", "once"),
    [
        # counted by hand: four gates of 64 (20 + 64) weights and two biases, then 64 64 32 1
        ({}, 28_289, 21_504, 6_176),
        ({"unit": "gru"}, 22_785, 16_128, 6_176),
        ({"dense": ()}, 22_081, 21_504, 64),
        ({"activation": "sigmoid"}, 28_289, 21_504, 6_176),
    ],
)
def test_sizes_with_twenty_inputs_and_a_window_of_fifty(settings, weights, per_row, once):
    module = RecurrentNet(20, context=50, **settings)
    assert parameters(module) == weights
    assert multiply_accumulates(module, 20, 50) == 50 * per_row + once


def by_hand(x, weights, activation):
    """Paper 003, eq. 6 to 11, gate by gate in double precision; x (T, inputs)."""
    w_ih, w_hh, b_ih, b_hh = (w.detach().numpy() for w in weights)
    size = w_hh.shape[1]
    sigmoid, h, c, rows = (lambda v: 1.0 / (1.0 + np.exp(-v))), np.zeros(size), np.zeros(size), []
    function = {"tanh": np.tanh, "sigmoid": sigmoid}[activation]
    for row in x:
        gates = [w_ih[k * size : (k + 1) * size] @ row + w_hh[k * size : (k + 1) * size] @ h for k in range(4)]
        i, f, g, o = (gate + (b_ih + b_hh)[k * size : (k + 1) * size] for k, gate in enumerate(gates))
        c = sigmoid(f) * c + sigmoid(i) * function(g)
        h = sigmoid(o) * function(c)
        rows.append(h)
    return np.array(rows), c


@pytest.mark.parametrize("activation", ["tanh", "sigmoid"])
def test_the_cell_is_that_of_the_paper(activation):
    lstm = ActivatedLSTM(3, 4, 1, activation).double()
    x = torch.randn(2, 7, 3, dtype=torch.float64)
    out, (h, c) = lstm(x)
    for number in range(2):
        expected, memory = by_hand(x[number].numpy(), lstm.all_weights[0], activation)
        np.testing.assert_allclose(out[number].detach(), expected, rtol=0, atol=1e-14)
        np.testing.assert_allclose(c[0, number].detach(), memory, rtol=0, atol=1e-14)
        np.testing.assert_array_equal(h[0, number].detach(), out[number, -1].detach())


@pytest.mark.parametrize("layers", [1, 2])
def test_with_tanh_the_own_cell_is_the_library_s(layers):
    own, library = ActivatedLSTM(3, 4, layers, "tanh").double(), nn.LSTM(3, 4, layers, batch_first=True).double()
    library.load_state_dict(own.state_dict())
    x = torch.randn(2, 9, 3, dtype=torch.float64)
    results = []
    for module in (own, library):
        out, (h, c) = module(x)
        out.square().sum().backward()
        results.append([out, h, c, *(weight.grad for weight in module.parameters())])
    for mine, theirs in zip(*results, strict=True):
        torch.testing.assert_close(mine, theirs, rtol=0, atol=1e-13)


@pytest.mark.parametrize("unit", ["lstm", "gru"])
def test_in_use_an_output_is_made_from_its_taps_alone(unit):
    """Rows after an output or more than its taps before do not count; each of the taps does."""
    module = RecurrentNet(2, unit=unit, hidden=4, dense=(3,), context=6).double().eval()
    x = torch.randn(1, 2, 20, dtype=torch.float64)
    out = module(x)
    assert out.shape == (1, 15)
    for row in range(20):
        changed = x.clone()
        changed[:, :, row] += 1.0
        differs = (module(changed) != out)[0]
        # output k is of row k + 5 and of the rows k to k + 5
        assert differs.tolist() == [k <= row <= k + 5 for k in range(15)]
    torch.testing.assert_close(module(x[:, :, 4:10])[:, 0], out[:, 4], rtol=0, atol=1e-14)


def test_while_it_learns_a_window_is_run_through_once_and_never_looks_ahead():
    module = RecurrentNet(2, hidden=4, dense=(), context=6).double().train()
    x = torch.randn(1, 2, 20, dtype=torch.float64)
    out = module(x)
    assert out.shape == (1, 15)
    # the first output of a window has seen as many rows as in use
    torch.testing.assert_close(out[:, :1], module.eval()(x[:, :, :6]), rtol=0, atol=1e-14)
    expected = module.output(module.recurrent(x.transpose(1, 2))[0])[:, 5:, 0]
    torch.testing.assert_close(out, expected, rtol=0, atol=1e-14)
    module.train()
    for row in range(20):
        changed = x.clone()
        changed[:, :, row] += 1.0
        assert (module(changed) != out)[0].tolist() == [row <= k + 5 for k in range(15)]


@pytest.mark.parametrize("layers", [1, 2])
@pytest.mark.parametrize("activation", ["tanh", "sigmoid"])
@pytest.mark.parametrize("dense", [(64,), (64, 32)])
@pytest.mark.parametrize("dense_activation", ["tanh", "relu"])
def test_the_grid_of_table_2_is_there_and_starts_at_zero(layers, activation, dense, dense_activation):
    module = RecurrentNet(
        5, layers=layers, activation=activation, dense=dense, dense_activation=dense_activation, context=4
    )
    assert module.recurrent.num_layers == layers
    assert [type(layer) for layer in module.dense[1::2]] == [nn.Tanh if dense_activation == "tanh" else nn.ReLU] * len(
        dense
    )
    x = torch.randn(2, 5, 7)
    assert module(x).abs().max() > 1e-3
    module.start_at_zero()
    assert not module(x).any()
    (module(x) - 1.0).square().sum().backward()
    assert module.output.weight.grad.abs().max() > 0.0

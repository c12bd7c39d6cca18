"""Sums of squares of networks and their normal equations, against automatic differentiation row by row."""

import pytest
import torch
from torch import nn

from magsim.compensation.networks.modules.magtcn import MagTCN
from magsim.compensation.networks.modules.perceptrons import SampleMLP, WindowMLP
from magsim.errors import RequestError
from magsim.training import least_squares, seeded
from magsim.training.least_squares import SquaredErrors
from tests.support.recurrent import LastOfRecurrent

MODULES = {
    "perceptron on samples": lambda: SampleMLP(3, (4, 3), "tanh"),
    "perceptron on windows": lambda: WindowMLP(3, 6, (4,), "gelu"),
    "MagTCN": lambda: MagTCN(3, width=2, expansion=2, kernel=3, window=6, head="per-time", revin=True),
    "convolution": lambda: nn.Sequential(nn.Conv1d(3, 2, 3), nn.Tanh(), nn.Flatten(), nn.Dropout(0.5), nn.Linear(8, 1)),
    "LSTM": lambda: LastOfRecurrent("LSTM", 3, 2),
    "GRU": lambda: LastOfRecurrent("GRU", 3, 2),
}


def data(module, rows=7, seed=0):
    generator = torch.Generator().manual_seed(seed)
    inputs = torch.randn(rows, 3, 6, generator=generator, dtype=torch.float64)
    with torch.no_grad():
        shape = module.eval()(inputs).shape
    return inputs, torch.randn(shape, generator=generator, dtype=torch.float64)


def by_hand(module, inputs, targets):
    """Errors (n o,) and Jacobian (n o, p) from one backward pass for each output."""
    errors, rows = [], []
    for x, y in zip(inputs, targets, strict=True):
        output = module(x[None])[0]
        errors.append((y - output).detach())
        for one in output:
            gradient = torch.autograd.grad(one, list(module.parameters()), retain_graph=True)
            rows.append(torch.cat([part.reshape(-1) for part in gradient]))
    return torch.cat(errors), torch.stack(rows)


@pytest.mark.parametrize("kind", MODULES)
def test_normal_equations_are_those_of_one_backward_pass_for_each_output(kind, monkeypatch):
    monkeypatch.setattr(least_squares, "ROWS", 3)  # 7 rows: two whole batches and a part of one
    with seeded(1):
        module = MODULES[kind]().double().eval()
    inputs, targets = data(module)
    errors, jacobian = by_hand(module, inputs, targets)
    squares = SquaredErrors(module, inputs, targets)
    normal = squares.normal(squares.start)
    assert squares.value(squares.start) == pytest.approx(float(errors @ errors), rel=1e-12)
    assert squares.terms == targets.numel()
    torch.testing.assert_close(normal.matrix, jacobian.T @ jacobian, rtol=1e-11, atol=1e-12)
    torch.testing.assert_close(normal.gradient, jacobian.T @ errors, rtol=1e-11, atol=1e-12)
    assert torch.equal(normal.matrix, normal.matrix.T)


def test_weights_operator_and_decay_are_in_all_three():
    with seeded(2):
        module = SampleMLP(3, (4,), "tanh").double()
    inputs, targets = data(module, rows=8)
    errors, jacobian = by_hand(module, inputs, targets)
    weights = torch.linspace(0.0, 2.0, 48, dtype=torch.float64).reshape(8, 6)
    start = torch.nn.utils.parameters_to_vector(module.parameters()).detach()
    # the operator takes two rows of six outputs at once
    operator = torch.randn(5, 12, generator=torch.Generator().manual_seed(3), dtype=torch.float64)
    weigh, filtered = torch.diag(weights.sqrt().reshape(-1)), torch.block_diag(*[operator] * 4)
    cases = [
        ({"weights": weights}, weigh, 48.0),
        ({"operator": operator}, filtered, 20.0),
        ({"weights": weights, "operator": operator}, filtered @ weigh, 20.0),
    ]
    for given, matrix, terms in cases:
        squares = SquaredErrors(module, inputs, targets, **given, decay=0.01)
        e, j = matrix @ errors, matrix @ jacobian
        assert squares.terms == pytest.approx(terms)
        assert squares.value(start) == pytest.approx(float(e @ e + 0.01 * terms * start @ start), rel=1e-12)
        normal = squares.normal(start)
        expected = j.T @ j + 0.01 * terms * torch.eye(len(start), dtype=torch.float64)
        torch.testing.assert_close(normal.matrix, expected, rtol=1e-11, atol=1e-12)
        torch.testing.assert_close(normal.gradient, j.T @ e - 0.01 * terms * start, rtol=1e-11, atol=1e-12)


def test_batches_are_bounded_and_leave_groups_of_the_operator_whole(monkeypatch):
    module = WindowMLP(3, 6, (4,), "tanh")
    inputs, targets = data(module.double(), rows=20)
    monkeypatch.setattr(least_squares, "ELEMENTS", 700)  # 81 parameters: 8 rows
    sizes = [b.stop - b.start for b in SquaredErrors(module, inputs, targets)._batches]
    assert sizes == [8, 8, 4]
    sizes = [b.stop - b.start for b in SquaredErrors(module, inputs, targets, operator=torch.ones(2, 5))._batches]
    assert sizes == [5, 5, 5, 5]


def test_what_does_not_go_together_is_refused():
    module, x, y = SampleMLP(3, (4,)), torch.zeros(6, 3, 2), torch.zeros(6, 2)
    with pytest.raises(ValueError, match=r"inputs \(6, 3, 2\) and targets \(5, 2\)"):
        SquaredErrors(module, x, y[:5])
    for weights in (torch.ones(6, 1), -torch.ones(6, 2), torch.zeros(6, 2), torch.full((6, 2), torch.nan)):
        with pytest.raises(ValueError, match=r"expected \(6, 2\), not negative, not all zero and finite"):
            SquaredErrors(module, x, y, weights=weights)
    for columns in (3, 8):
        with pytest.raises(ValueError, match=f"an operator \\(1, {columns}\\) over 12 errors, 2 a row"):
            SquaredErrors(module, x, y, operator=torch.ones(1, columns))
    with pytest.raises(
        RequestError, match=r"SampleMLP maps inputs \(2, 3, 2\) to \(2, 2\); the targets ask for \(2, 1\)"
    ):
        SquaredErrors(module, x, y[:, :1])


def test_a_module_that_looks_at_its_numbers_is_refused():
    class Choosy(nn.Linear):
        def forward(self, x):
            return super().forward(x[:, :, 0]) if x.sum() > 0.0 else super().forward(-x[:, :, 0])

    with pytest.raises(RequestError, match=r"torch\.func cannot differentiate Choosy row by row"):
        SquaredErrors(Choosy(3, 1), torch.ones(4, 3, 1), torch.zeros(4, 1))

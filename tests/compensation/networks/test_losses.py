"""Losses of networks, against the filter itself and the formulas of paper 000."""

import numpy as np
import pytest
import torch

from magsim import signals
from magsim.compensation.networks.losses import DecayedLoss, ResidualLoss, TutoredLoss, band_matrix
from magsim.training import LevenbergPlan, train_levenberg


def test_band_matrix_is_the_filter():
    """On a signal that lives inside the window, the matrix and the forward-backward filter agree."""
    matrix = band_matrix(320, 10.0)
    assert matrix.shape == (200, 320)
    rng = np.random.default_rng(0)
    window = rng.normal(size=320)
    padded = np.concatenate([np.zeros(2000), window, np.zeros(2000)])
    expected = signals.band_pass(padded, 10.0)[2060:2260]
    np.testing.assert_allclose(matrix @ window, expected, rtol=0, atol=1e-9)
    with pytest.raises(ValueError, match="needs more than 120"):
        band_matrix(120, 10.0)


def test_losses():
    torch.manual_seed(0)
    band = torch.tensor(band_matrix(200, 10.0).T, dtype=torch.float32)
    truth, out = torch.randn(3, 200), torch.randn(3, 200)
    error = (out - truth).numpy().astype(float)
    inside = error @ band_matrix(200, 10.0).T
    expected = np.mean(error**2) + 4.0 * np.mean(inside**2)
    learned = torch.ones(3, 200)
    assert float(ResidualLoss(band, 4.0).of(out, truth, learned)) == pytest.approx(expected, rel=1e-5)
    last = ResidualLoss(None, 0.0).of(out[:, :1], truth, learned)
    assert float(last) == pytest.approx(np.mean((out[:, 0] - truth[:, -1]).numpy() ** 2), rel=1e-5)


def test_rows_that_are_not_learned_count_for_nothing():
    """By hand: their error is taken for zero, and the mean is that of the others."""
    torch.manual_seed(1)
    band = torch.tensor(band_matrix(200, 10.0).T, dtype=torch.float32)
    truth, out, learned = torch.randn(3, 200), torch.randn(3, 200), (torch.rand(3, 200) < 0.7).float()
    error = ((out - truth) * learned).numpy().astype(float)
    inside = error @ band_matrix(200, 10.0).T
    expected = (np.mean(error**2) + 4.0 * np.mean(inside**2)) / learned.numpy().mean()
    loss = ResidualLoss(band, 4.0)
    assert float(loss.of(out, truth, learned)) == pytest.approx(expected, rel=1e-5)
    changed = torch.where(learned > 0.0, truth, truth + 5.0)
    assert float(loss.of(out, changed, learned)) == pytest.approx(expected, rel=1e-5)
    last = ResidualLoss(None, 0.0)
    known = learned[:, -1].numpy() > 0.0
    wanted = np.mean((out[:, 0] - truth[:, -1]).numpy()[known] ** 2)
    assert float(last.of(out[:, :1], truth, learned)) == pytest.approx(wanted, rel=1e-5)


def test_tutored_loss_hands_over_from_tolles_lawson_to_the_truth():
    """Paper 000, eq. 36 with W = 1: weights e^(-v k) and 1 - e^(-v k), k the epoch."""
    loss = TutoredLoss(ResidualLoss(None, 0.0), decay=0.05, steps_per_epoch=10.0)
    targets = torch.stack([torch.ones(1, 8), 3.0 * torch.ones(1, 8), torch.ones(1, 8)], dim=1)
    module = torch.nn.Module()
    module.forward = lambda x: torch.zeros(1, 8)
    for step in (0, 200):
        share = np.exp(-0.05 * step / 10.0)
        parts = [float(part) for part in loss(module, (torch.zeros(1, 2, 8), targets), step)]
        assert parts == pytest.approx([share * 9.0, (1.0 - share) * 1.0])


def test_squares_of_trained_parameters_weigh_as_in_levenberg_marquardt():
    """At the minimum of Levenberg-Marquardt with a decay, the gradient of the decayed loss is zero."""
    torch.manual_seed(2)
    inputs, truth = torch.randn(400, 3, 1, dtype=torch.float64), torch.randn(400, 1, dtype=torch.float64)
    module = torch.nn.Sequential(torch.nn.Flatten(), torch.nn.Linear(3, 1)).double()
    batch = inputs, torch.stack([truth, torch.ones_like(truth)], dim=1)
    loss = DecayedLoss(ResidualLoss(None, 0.0), 0.3)
    plan = LevenbergPlan(20, patience=20, weight_decay=0.3)
    train_levenberg(module, inputs, truth, lambda net: loss(net, batch, 0)[0].item(), plan)
    plain, decayed = (sum(each(module, batch, 0)) for each in (loss.loss, loss))
    squares = sum(parameter.square().sum().item() for parameter in module.parameters())
    assert (decayed - plain).item() == pytest.approx(0.3 * squares)
    assert all(gradient.abs().max() < 1e-6 for gradient in torch.autograd.grad(decayed, [*module.parameters()]))
    module[1].weight.requires_grad_(False)
    rest = (sum(loss(module, batch, 0)) - plain).item()
    assert rest == pytest.approx(0.3 * module[1].bias.square().item())

"""Losses of residual networks, among them one in the band that compensation is judged in."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from torch import Tensor, nn

from magsim import signals
from magsim.training import distributed

BAND_EDGE_S = 6.0
"""What is left out at each end of a window after the band-pass inside it [s]."""


def band_matrix(length: int, rate_hz: float) -> np.ndarray:
    """Return the forward-backward band-pass as a matrix on a window, its ends left out.

    Rows hold the impulse response of ``signals.band_pass``, so a product with a window that is zero outside equals
    the filter. Inside a longer signal the rows near the ends lack what lies beyond the window.

    Parameters
    ----------
    length : int
        Samples of the window.
    rate_hz : float [Hz]

    Returns
    -------
    (length - 2 edge, length)

    Raises
    ------
    ValueError
        If the window is too short to leave any row.
    """
    edge = round(BAND_EDGE_S * rate_hz)
    if length <= 2 * edge:
        msg = f"a window of {length} samples is too short for the in-band loss; it needs more than {2 * edge}"
        raise ValueError(msg)
    # Long enough that the response has died out at both ends.
    half = max(round(120.0 * rate_hz), 2 * length)
    impulse = np.zeros(2 * half + 1)
    impulse[half] = 1.0
    response = signals.band_pass(impulse, rate_hz)
    rows, samples = np.arange(edge, length - edge), np.arange(length)
    return response[half + rows[:, None] - samples]


@dataclass(frozen=True)
class ResidualLoss:
    """Mean squared error, broadband and in band, of a network that learns a standardized residual.

    Attributes
    ----------
    band : Tensor or None
        ``band_matrix`` transposed, None for the broadband part alone.
    band_weight : float
        Weight of the in-band part; both parts are relative to the variance of what there is to learn.
    """

    band: Tensor | None
    band_weight: float

    def __call__(self, module: nn.Module, batch: tuple[Tensor, ...], step: int) -> Sequence[Tensor]:
        """Return the loss of a batch: inputs (B, M, T), targets (B, 2, T) with truth and learned rows."""
        inputs, targets = batch
        return [self.of(module(inputs), targets[:, 0], targets[:, -1])]

    def of(self, output: Tensor, target: Tensor, learned: Tensor) -> Tensor:
        """Return the loss of an output (B, K) against a target (B, T), whose last K samples the output is of.

        ``learned``, (B, T), is 1 in rows that are learned and 0 in others, whose error counts as none.
        """
        first = target.shape[1] - output.shape[1]
        target, learned = target[:, first:], learned[:, first:]
        error = (output - target) * learned
        share = learned.mean()
        distributed.average([share])  # of the whole batch, as one process has it
        share = share.clamp_min(1e-6)
        loss = (error**2).mean()
        if self.band is not None:
            loss = loss + self.band_weight * ((error @ self.band.to(error.device)) ** 2).mean()
        return loss / share


@dataclass(frozen=True)
class TutoredLoss:
    """Paper 000, eq. 39: at first learn the Tolles-Lawson estimate, then more and more the truth.

    Two losses, ``e^(-v k)`` times that against the Tolles-Lawson estimate and ``1 - e^(-v k)`` times that against the
    truth, k the epoch. The paper gives neither v nor the unit of k.

    Attributes
    ----------
    truth : ResidualLoss
    decay : float
        v, for each epoch.
    steps_per_epoch : float
    """

    truth: ResidualLoss
    decay: float
    steps_per_epoch: float

    def __call__(self, module: nn.Module, batch: tuple[Tensor, ...], step: int) -> Sequence[Tensor]:
        """Return both weighted losses of a batch: inputs (B, M, T), targets (B, 3, T): truth, tutor, learned rows."""
        inputs, targets = batch
        output = module(inputs)
        share = math.exp(-self.decay * step / self.steps_per_epoch)
        losses = [self.truth.of(output, targets[:, i], targets[:, -1]) for i in (1, 0)]
        return [share * losses[0], (1.0 - share) * losses[1]]


@dataclass(frozen=True)
class DecayedLoss:
    """A loss and the squared parameters that are trained, as Levenberg-Marquardt weighs them.

    Attributes
    ----------
    loss : ResidualLoss or TutoredLoss
    weight_decay : float
        Weight of the sum of squares.
    """

    loss: ResidualLoss | TutoredLoss
    weight_decay: float

    def __call__(self, module: nn.Module, batch: tuple[Tensor, ...], step: int) -> Sequence[Tensor]:
        """Return the losses of a batch, the squares with the first."""
        first, *others = self.loss(module, batch, step)
        squares = [parameter.square().sum() for parameter in module.parameters() if parameter.requires_grad]
        return [first + self.weight_decay * sum(squares, first.new_zeros(())), *others]


Loss = ResidualLoss | TutoredLoss | DecayedLoss
"""Losses of networks on a first stage."""

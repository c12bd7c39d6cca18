"""Sum of squares of a network's errors, with its normal equations, as functions of all parameters in one vector."""

from copy import deepcopy
from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.func import functional_call, jacrev, vmap

from magsim.errors import RequestError

ROWS, ELEMENTS = 4096, 2_000_000
"""Most rows, and most numbers in the Jacobian (16 MB), of a batch. Measured: larger batches leave the processor's
cache and take up to twice the time, smaller ones pay for calls."""

KEPT = 4
"""Numbers that a network keeps for each input until it is differentiated, in units of what ``ELEMENTS`` counts
(estimate; measured with it: recurrent and convolutional networks of 1700 to 4200 parameters on windows of 320 rows take
0.3 to 0.7 GB)."""


class Normal(NamedTuple):
    """Normal equations: J^T J (p, p) and J^T e (p,), J the Jacobian of the outputs, e target minus output."""

    matrix: Tensor
    gradient: Tensor


class SquaredErrors:
    """Weighed sum of squares of what a network leaves of its targets.

    The Jacobian is that of ``torch.func`` in float64, row by row and batch by batch, so that memory stays bounded. The
    network is a copy in float64 and in evaluation mode: no dropout, and statistics of batches stay as they are.

    Parameters
    ----------
    module : nn.Module
        Maps windows (b, c, t) to (b, o). Parameters that need no gradient stay as they are.
    inputs : (n, c, t)
        May be a view, such as ``unfold`` returns: it is copied batch by batch.
    targets : (n, o)
    weights : (n, o), optional
        Of the squared errors, not negative.
    operator : (k, g), optional
        Applied to each g consecutive errors, which are then k; such as a band-pass over g samples. Errors have their
        weights before, so that those of weight 0 count as none.
    decay : float
        Weight of the squared parameters, beside the mean of the squared errors.

    Raises
    ------
    RequestError
        If the network does not map a window to o outputs, or ``torch.func`` cannot differentiate it.
    ValueError
        If shapes do not go together, or weights are negative, all zero or not finite.
    """

    def __init__(
        self,
        module: nn.Module,
        inputs: Tensor,
        targets: Tensor,
        *,
        weights: Tensor | None = None,
        operator: Tensor | None = None,
        decay: float = 0.0,
    ) -> None:
        _check(inputs, targets, weights, operator)
        self._module = deepcopy(module).double().eval()
        trained = {name: tensor for name, tensor in self._module.named_parameters() if tensor.requires_grad}
        self._shapes = {name: tensor.shape for name, tensor in trained.items()}
        self.start = torch.cat([tensor.detach().reshape(-1) for tensor in trained.values()])
        self._inputs, self._targets = inputs, targets
        self._roots = None if weights is None else self._here(weights).sqrt()
        self._operator = None if operator is None else self._here(operator)
        self._check_module()
        self._batches = self._cut()
        per_error = 1.0 if operator is None else operator.shape[0] / operator.shape[1]
        self.terms = targets.numel() * per_error * (1.0 if weights is None else float(weights.double().mean()))
        self._decay = decay * self.terms

    def value(self, vector: Tensor) -> float:
        """Return the sum of squares at the parameters (p,), with the part of the decay."""
        total = self._decay * _product(vector[:, None], vector[:, None])
        parameters = self._parameters(vector)
        with torch.no_grad():
            for batch in self._batches:
                output = functional_call(self._module, parameters, (self._here(self._inputs[batch]),))
                error = self._weighed(batch, (self._here(self._targets[batch]) - output)[..., None])
                total = total + _product(error, error)
        return float(total)

    def normal(self, vector: Tensor) -> Normal:
        """Return the normal equations at the parameters (p,): minus half of the gradient of ``value`` on the right."""
        matrix = torch.zeros(len(vector), len(vector), dtype=vector.dtype, device=vector.device)
        matrix.diagonal().add_(self._decay)
        gradient = -self._decay * vector
        for batch in self._batches:
            output, jacobian = self.jacobian(vector, self._inputs[batch])
            error = self._weighed(batch, (self._here(self._targets[batch]) - output)[..., None])
            jacobian = self._weighed(batch, jacobian)
            matrix += _product(jacobian, jacobian)
            gradient += _product(jacobian, error)[:, 0]
        return Normal(matrix, gradient)

    def jacobian(self, vector: Tensor, inputs: Tensor) -> tuple[Tensor, Tensor]:
        """Return the outputs (b, o) of windows (b, c, t), and their derivatives by the parameters, (b, o, p).

        Each row has the parameters for itself, as views of the same memory. With one set for all, ``vmap`` fails for
        LSTM and GRU, whose first step adds in place to what has no rows yet; where it works, it takes as long.
        """
        rows = self._here(inputs)
        parameters = {name: part.expand(len(rows), *part.shape) for name, part in self._parameters(vector).items()}

        def one(own: dict[str, Tensor], row: Tensor) -> tuple[Tensor, Tensor]:
            output = functional_call(self._module, own, (row[None],))[0]
            return output, output

        # the fused recurrent kernels of CUDA differentiate in training mode only
        with torch.backends.cudnn.flags(enabled=False):
            parts, output = vmap(jacrev(one, has_aux=True))(parameters, rows)
        return output, torch.cat([parts[name].reshape(*output.shape, -1) for name in parameters], dim=2)

    def write(self, vector: Tensor, module: nn.Module) -> None:
        """Put the parameters (p,) into a module of the same form, in its own precision."""
        own = dict(module.named_parameters())
        with torch.no_grad():
            for name, part in self._parameters(vector).items():
                own[name].copy_(part)

    def _parameters(self, vector: Tensor) -> dict[str, Tensor]:
        parts = vector.split([shape.numel() for shape in self._shapes.values()])
        return {name: part.reshape(shape) for (name, shape), part in zip(self._shapes.items(), parts, strict=True)}

    def _here(self, values: Tensor) -> Tensor:
        return values.to(self.start.device, torch.float64)

    def _weighed(self, batch: slice, values: Tensor) -> Tensor:
        """Weigh errors or derivatives (b, o, q) of a batch in place, apply the operator, and return them as (m, q)."""
        if self._roots is not None:
            values *= self._roots[batch, :, None]
        if self._operator is not None:
            values = self._operator @ values.reshape(-1, self._operator.shape[1], values.shape[2])
        return values.reshape(-1, values.shape[2])

    def _cut(self) -> list[slice]:
        """Cut the rows into batches of a bounded size; what the operator takes together stays together."""
        count, outputs = self._targets.shape
        together = 1 if self._operator is None else self._operator.shape[1] // outputs
        most = min(ROWS, ELEMENTS // max(outputs * len(self.start), KEPT * self._inputs[0].numel()))
        rows = max(most // together, 1) * together
        return [slice(first, min(first + rows, count)) for first in range(0, count, rows)]

    def _check_module(self) -> None:
        name, expected = type(self._module).__name__, self._targets.shape[1]
        with torch.no_grad():
            found = tuple(self._module(self._here(self._inputs[:2])).shape)
        if found != (min(2, len(self._inputs)), expected):
            shape = tuple(self._inputs[:2].shape)
            msg = f"{name} maps inputs {shape} to {found}; the targets ask for ({shape[0]}, {expected})"
            raise RequestError(msg)
        try:
            self.jacobian(self.start, self._inputs[:2])
        except RuntimeError as error:
            msg = f"torch.func cannot differentiate {name} row by row, which Levenberg-Marquardt needs: {error}"
            raise RequestError(msg) from None


def _check(inputs: Tensor, targets: Tensor, weights: Tensor | None, operator: Tensor | None) -> None:
    if targets.ndim != 2 or len(inputs) != len(targets) or not len(inputs):
        msg = f"inputs {tuple(inputs.shape)} and targets {tuple(targets.shape)}; expected (n, c, t) and (n, o), n >= 1"
        raise ValueError(msg)
    if weights is not None:
        usable = bool((weights >= 0.0).all() & weights.isfinite().all() & (weights > 0.0).any())
        if weights.shape != targets.shape or not usable:
            expected = tuple(targets.shape)
            msg = f"weights {tuple(weights.shape)}; expected {expected}, not negative, not all zero and finite"
            raise ValueError(msg)
    if operator is not None and (operator.shape[1] % targets.shape[1] or targets.numel() % operator.shape[1]):
        msg = (
            f"an operator {tuple(operator.shape)} over {targets.numel()} errors, {targets.shape[1]} a row; expected "
            "(k, g) with g a multiple of the errors of a row and a divisor of all"
        )
        raise ValueError(msg)


def _product(left: Tensor, right: Tensor) -> Tensor:
    """Return left^T right; numpy computes only half of a matrix times itself, torch all of it."""
    if left.device.type == "cpu":
        return torch.from_numpy(left.numpy().T @ right.numpy())
    return left.T @ right

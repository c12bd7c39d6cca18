"""Sizes of networks: parameters, and multiply-accumulates of one window.

Only products with weights are counted, as the papers' figures are: no activations, no normalization, no sums. A
convolution counts as one that is carried out directly, also where it goes by the Fourier transform.
"""

from collections.abc import Callable, Mapping
from typing import Any

import torch
from torch import Tensor, nn

from magsim.compensation.networks.modules.magtcn import DepthwiseFFT, GroupedMLP, MagTCN
from magsim.compensation.networks.modules.recurrent import ActivatedLSTM

Rule = Callable[[Any, Tensor, Tensor], int]
"""Maps a layer, its first input and its first output to multiply-accumulates."""


def _linear(layer: nn.Linear, given: Tensor, out: Tensor) -> int:
    return out.numel() * layer.in_features


def _convolution(layer: nn.Conv1d, given: Tensor, out: Tensor) -> int:
    return out.numel() * (layer.in_channels // layer.groups) * layer.kernel_size[0]


def _recurrent(layer: nn.RNNBase, given: Tensor, out: Tensor) -> int:
    """Count the matrices of all gates, layers and directions, once for each sample."""
    weights = sum(weight.numel() for name, weight in layer.named_parameters() if name.startswith("weight"))
    return weights * out.numel() // out.shape[-1]


def _depthwise(layer: DepthwiseFFT, given: Tensor, out: Tensor) -> int:
    return out.numel() * layer.weight.shape[-1]


def _grouped(layer: GroupedMLP, given: Tensor, out: Tensor) -> int:
    return (layer.up.numel() + layer.down.numel()) * out.shape[-1]


def _embedding_and_merging(layer: MagTCN, given: Tensor, out: Tensor) -> int:
    times = [own for own in layer.modules() if isinstance(own, DepthwiseFFT)]
    lost = sum(own.weight.shape[-1] - 1 for own in times if own.causal)
    return given.shape[0] * (layer.embed.numel() * given.shape[2] + layer.merge.numel() * (given.shape[2] - lost))


RULES: Mapping[type[nn.Module], Rule] = {
    nn.Linear: _linear,
    nn.Conv1d: _convolution,
    nn.LSTM: _recurrent,
    nn.GRU: _recurrent,
    ActivatedLSTM: _recurrent,
    DepthwiseFFT: _depthwise,
    GroupedMLP: _grouped,
    MagTCN: _embedding_and_merging,
}
"""Layers whose own parameters are weights of products, and how they count."""


def parameters(module: nn.Module) -> int:
    """Return the number of parameters that are learned."""
    return sum(parameter.numel() for parameter in module.parameters() if parameter.requires_grad)


def multiply_accumulates(module: nn.Module, channels: int, window: int) -> int:
    """Count the multiply-accumulates of one window.

    Parameters
    ----------
    module : nn.Module
        Maps windows (B, channels, window).
    channels, window : int

    Raises
    ------
    ValueError
        If a layer with matrices of its own is of a kind that has no rule.
    """
    count = 0

    def add(layer: nn.Module, given: tuple[Tensor, ...], out: Any) -> None:
        nonlocal count
        count += RULES[type(layer)](layer, given[0], out[0] if isinstance(out, tuple) else out)

    hooks, training = [], module.training
    try:
        for layer in module.modules():
            if type(layer) in RULES:
                hooks.append(layer.register_forward_hook(add))
            elif any(own.ndim > 1 for own in layer.parameters(recurse=False)):
                kinds = ", ".join(kind.__name__ for kind in RULES)
                msg = (
                    f"{type(layer).__name__} has weights of its own and no rule to count them; layers with one: {kinds}"
                )
                raise ValueError(msg)
        example = next(module.parameters())
        with torch.no_grad():
            module.eval()(torch.zeros(1, channels, window, dtype=example.dtype, device=example.device))
    finally:
        module.train(training)
        for hook in hooks:
            hook.remove()
    return count

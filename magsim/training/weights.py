"""Weights of a network: put in with a check, and kept as they are."""

from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase

from torch import Tensor, nn

from magsim.errors import RequestError


def put_weights(module: nn.Module, weights: Mapping[str, Tensor]) -> None:
    """Put weights into a network that has these names and shapes.

    Raises
    ------
    ValueError
        If it has others; one line names the first.
    """
    own = module.state_dict()
    for name in dict.fromkeys([*own, *weights]):
        if name not in weights:
            msg = f"they lack {name}, which the network has"
        elif name not in own:
            msg = f"they have {name}, which the network lacks"
        elif weights[name].shape != own[name].shape:
            msg = f"{name} has shape {tuple(weights[name].shape)}, and {tuple(own[name].shape)} in the network"
        else:
            continue
        msg = f"the weights do not fit the network: {msg}"
        raise ValueError(msg)
    module.load_state_dict(weights)


def freeze(module: nn.Module, patterns: Sequence[str]) -> tuple[str, ...]:
    """Keep parameters from being trained, and return their names.

    Parameters
    ----------
    module : nn.Module
    patterns : sequence of str
        Of names, with ``*``, ``?`` and ``[...]``: ``blocks.0.*``.

    Raises
    ------
    RequestError
        If a pattern fits no parameter, or none is left to train.
    """
    names = [name for name, _ in module.named_parameters()]
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in names):
            msg = f"freeze {pattern!r} fits no parameter of {type(module).__name__}; it has {', '.join(names)}"
            raise RequestError(msg)
    frozen = tuple(name for name in names if any(fnmatchcase(name, pattern) for pattern in patterns))
    if len(frozen) == len(names):
        msg = f"freeze {', '.join(patterns)} leaves no parameter of {type(module).__name__} to train"
        raise RequestError(msg)
    for name, parameter in module.named_parameters():
        if name in frozen:
            parameter.requires_grad_(False)
    return frozen


def first_not_finite(module: nn.Module) -> str | None:
    """Return the name of the first parameter or buffer with a number that is not finite."""
    for name, tensor in module.state_dict().items():
        if tensor.is_floating_point() and not bool(tensor.isfinite().all()):
            return name
    return None

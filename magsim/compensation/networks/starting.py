"""What training starts from: a new network, another run's weights and scales, the state where it was broken off."""

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from torch import nn

from magsim.compensation.base import FitContext
from magsim.compensation.networks.fitted import Fitted
from magsim.compensation.networks.modules.committee import Committee
from magsim.compensation.networks.settings import NetworkSettings
from magsim.compensation.registry import load
from magsim.errors import RequestError
from magsim.streams import integer_seed
from magsim.training import Checkpoint, freeze, put_weights, seeded

ModuleFactory = Callable[[tuple[str, ...]], nn.Module]
"""Makes a network with its start weights for the names of its input columns."""


def new_module(
    settings: NetworkSettings, module_factory: ModuleFactory, names: tuple[str, ...], seed: int
) -> nn.Module:
    """Return a network that gives zeros, with start weights of a seed and in the precision of its optimizer."""
    with seeded(integer_seed(seed, "compensation/weights")):
        module = module_factory(names)
    module.start_at_zero()  # type: ignore[operator]
    if settings.optimizer == "lm":
        module.double()
    return module


def checkpoint_of(
    context: FitContext, phase: str, about: Mapping[str, object], module: nn.Module, contents: Iterable[bytes]
) -> Checkpoint | None:
    """Return where the state of a training run is kept, if it is.

    Parameters
    ----------
    context : FitContext
    phase : str
    about : mapping
        What the run belongs to, beside the seed: plain values.
    module : nn.Module
        With its start weights.
    contents : iterable of bytes
        The data.
    """
    if context.checkpoint is None:
        return None
    digest = hashlib.sha256(json.dumps({**about, "seed": context.seed}, sort_keys=True).encode())
    digest.update(repr(context.freeze).encode())
    for tensor in module.state_dict().values():
        digest.update(np.ascontiguousarray(tensor.numpy()).tobytes())
    for content in contents:
        digest.update(content)
    return Checkpoint(context.checkpoint / phase.replace(" ", "_"), digest.hexdigest())


def is_trained(context: FitContext) -> bool:
    """Whether a network has learned something before its first step; one that has not gives zeros."""
    return context.init is not None


def started_from(fitted: Fitted, context: FitContext) -> Fitted:
    """Return what training begins with: the network of ``context.init``, if there is one.

    Its inputs are scaled as there, and so is its output: only so do its weights mean the same. First stage and mean are
    those of the new rows.

    Raises
    ------
    RequestError
        If the run holds no such network, or a pattern of ``context.freeze`` fits no parameter.
    DataError
        If its files are broken.
    """
    if context.init is None:
        return fitted
    other = getattr(load(Path(context.init)), "_fitted", None)
    where = f"init {context.init}"
    if not isinstance(other, Fitted):
        msg = f"{where} holds no network to start from"
        raise RequestError(msg)
    if isinstance(other.module, Committee):
        msg = f"{where} holds the mean of several networks; allowed: a run that was trained with refit = true"
        raise RequestError(msg)
    if other.names != fitted.names or abs(other.rate_hz / fitted.rate_hz - 1.0) > 0.01:
        here, there = (f"{len(f.names)} inputs at {f.rate_hz:g} Hz" for f in (fitted, other))
        msg = f"{where} reads other inputs or another rate: {there}, here {here}; allowed: the same"
        raise RequestError(msg)
    try:
        put_weights(fitted.module, other.module.state_dict())
    except ValueError as error:
        msg = f"{where}: {error}"
        raise RequestError(msg) from None
    freeze(fitted.module, context.freeze)
    return replace(fitted, standardizer=other.standardizer, scale=other.scale)

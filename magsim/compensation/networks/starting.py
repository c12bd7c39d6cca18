"""Training that starts from another run: its weights and its scales, with parts that stay as they are."""

from dataclasses import replace
from pathlib import Path

from magsim.compensation.base import FitContext
from magsim.compensation.networks.fitted import Fitted
from magsim.compensation.networks.modules.committee import Committee
from magsim.compensation.registry import load
from magsim.errors import RequestError
from magsim.training import freeze, put_weights


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

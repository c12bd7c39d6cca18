"""The closed-form stage before a network."""

from typing import Any

from magsim.compensation.base import Compensator
from magsim.compensation.networks.settings import NetworkSettings
from magsim.compensation.registry import create
from magsim.compensation.tolles_lawson import TollesLawson
from magsim.dataset import Training
from magsim.errors import RequestError

PLAIN = ("tl16", "tl18")
"""Stages that learn from the labels, in band or broadband as ``stage_band`` says."""


def takes_direction(settings: NetworkSettings) -> bool:
    """Whether the direction of the stage is that of the network's inputs; stages of other names have their own."""
    return settings.first_stage in (*PLAIN, "tl16_measured", "tl18_measured")


def first_stage(settings: NetworkSettings) -> Compensator:
    """Return the unfitted closed-form stage: a method of that name.

    Raises
    ------
    RequestError
        If ``stage_band`` has no effect.
    """
    name = settings.first_stage
    if settings.stage_band != "in" and name not in PLAIN:
        msg = (
            f"stage_band {settings.stage_band!r} has no effect with first_stage {name!r}; allowed: with "
            f"{', '.join(PLAIN)}"
        )
        raise RequestError(msg)
    if name == "none":
        return create(name)
    if name.startswith("exact_norm"):
        return create(name, fluxgate=settings.fluxgate)
    params: dict[str, Any] = {"fluxgate": settings.fluxgate, "scale": settings.scale}
    if name in PLAIN:
        params["band"] = settings.stage_band
    if takes_direction(settings):
        params["direction"] = settings.direction
    return create(name, **params)


def tutor_of(settings: NetworkSettings, training: Training) -> TollesLawson:
    """Return the Tolles-Lawson fit that a network without a stage learns at first; see ``losses.TutoredLoss``."""
    return TollesLawson(fluxgate=settings.fluxgate, direction=settings.direction).fit_rows(training)

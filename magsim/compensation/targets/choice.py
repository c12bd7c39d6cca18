"""The target that the parameters of a method name."""

from collections.abc import Callable
from pathlib import Path
from typing import Literal, Protocol

from magsim.compensation.registry import load
from magsim.compensation.targets.anomaly_map import AnomalyMap
from magsim.compensation.targets.base import Label, Reading, Target
from magsim.compensation.targets.crossings import DISTANCE_M, HEIGHT_M, Crossings
from magsim.compensation.targets.model import KnownField
from magsim.compensation.targets.reference import OtherReading
from magsim.errors import RequestError

TargetName = Literal["interference", "measured", "model", "map", "crossings", "reference"]


class Targeted(Protocol):
    """Parameters of a method that name its target.

    Attributes
    ----------
    target : str
    map : str, optional
        Grid file of the anomalies, for target ``map``.
    map_height_m : float [m], optional
        Height above the ellipsoid that the map is of; without it, that of the flight.
    crossing_m, crossing_height_m : float [m], optional
        What counts as one place, for target ``crossings``.
    reference : str, optional
        The other magnetometer, for target ``reference``.
    reference_model : str, optional
        Folder of a method that was fitted for it.
    """

    target: TargetName
    map: str | None
    map_height_m: float | None
    crossing_m: float | None
    crossing_height_m: float | None
    reference: str | None
    reference_model: str | None


BELONGS = {
    "map": "map",
    "map_height_m": "map",
    "crossing_m": "crossings",
    "crossing_height_m": "crossings",
    "reference": "reference",
    "reference_model": "reference",
}
"""Parameters that one target alone reads."""


def target_of(method: Targeted) -> Target:
    """Return the target that parameters name.

    Raises
    ------
    RequestError
        If a parameter is missing or has no effect, or a file that it names cannot be read.
    """
    for key, target in BELONGS.items():
        if getattr(method, key) is not None and method.target != target:
            msg = f"{key} has no effect with target {method.target!r}; allowed: target = {target!r} beside it"
            raise RequestError(msg)
    return MAKERS[method.target](method)


def _map(method: Targeted) -> Target:
    if method.map is None:
        msg = "target 'map' needs the parameter map, the grid file of the anomalies"
        raise RequestError(msg)
    return KnownField(AnomalyMap.read(Path(method.map), method.map_height_m))


def _crossings(method: Targeted) -> Target:
    distance_m = DISTANCE_M if method.crossing_m is None else method.crossing_m
    height_m = HEIGHT_M if method.crossing_height_m is None else method.crossing_height_m
    return Crossings(distance_m, height_m)


def _reference(method: Targeted) -> Target:
    if method.reference is None:
        msg = "target 'reference' needs the parameter reference, the name of another magnetometer of the recording"
        raise RequestError(msg)
    target = OtherReading(method.reference, None if method.reference_model is None else load(method.reference_model))
    target.check()
    return target


MAKERS: dict[str, Callable[[Targeted], Target]] = {
    "interference": lambda _method: Label(),
    "measured": lambda _method: Reading(),
    "model": lambda _method: KnownField(),
    "map": _map,
    "crossings": _crossings,
    "reference": _reference,
}
"""Targets by name."""

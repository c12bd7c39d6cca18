"""What surrounds a network: its input columns, and the closed-form stage before it."""

from collections.abc import Callable, Mapping

from magsim.compensation.base import Compensator
from magsim.compensation.columns import AttitudeColumns, ColumnSet, Joined, TollesLawsonColumns
from magsim.compensation.networks.settings import NetworkSettings
from magsim.compensation.tolles_lawson import Nothing, TollesLawson

COLUMN_SETS: Mapping[str, Callable[[str, float | None], ColumnSet]] = {
    "tl16": lambda fluxgate, strength_nt: TollesLawsonColumns(16, fluxgate, strength_nt=strength_nt),
    "tl18": lambda fluxgate, strength_nt: TollesLawsonColumns(18, fluxgate, strength_nt=strength_nt),
    "attitude": lambda _fluxgate, _strength_nt: AttitudeColumns(),
}
"""Column sets that a network may read, by name: made for a fluxgate and a field strength."""


def network_columns(settings: NetworkSettings, fluxgate: str, strength_nt: float | None) -> Joined:
    """Return the input columns of a network."""
    return Joined(tuple(COLUMN_SETS[name](fluxgate, strength_nt) for name in settings.inputs))


def first_stage(settings: NetworkSettings, fluxgate: str | None) -> Compensator:
    """Return the unfitted closed-form stage."""
    if settings.first_stage == "none":
        return Nothing()
    measured = settings.first_stage.endswith("_measured")
    return TollesLawson(
        terms=18 if "18" in settings.first_stage else 16,
        target="measured" if measured else "interference",
        band="in" if measured else settings.stage_band,
        fluxgate=fluxgate,
        scale=settings.scale,
    )

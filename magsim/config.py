"""Strict configuration: the base of every model that is read from a TOML file."""

from typing import Annotated

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field


class Strict(BaseModel):
    """Frozen settings that refuse unknown keys and values of the wrong type."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, allow_inf_nan=False, validate_default=True
    )


def _as_list(value: object) -> object:
    return tuple(value) if isinstance(value, list) else value


def _one_or_many(value: object) -> object:
    return _as_list(value) if isinstance(value, list | tuple) else (value,)


Vector = Annotated[tuple[float, float, float], BeforeValidator(_as_list)]
"""Three numbers."""

Numbers = Annotated[tuple[float, ...], BeforeValidator(_one_or_many), Field(min_length=1)]
"""One number or a list of them; always a tuple once read."""

Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$", max_length=40)]
"""Name that may become part of a column."""

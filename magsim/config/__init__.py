"""Strict configuration: TOML files read into frozen models, with all errors reported at once.

``load`` reads a file (or a text) with tomllib, applies ``key.path=value`` overrides on top of it, and validates it with
pydantic. All problems come in one ``RequestError``, one line for each problem::

    box.toml:14: pattern.maneuvers[1].axis: 'pich' is not allowed; allowed: 'pitch', 'roll', 'yaw'

Problems that an override caused begin with ``--set key.path`` instead of file and line.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, ClassVar, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, WithJsonSchema

from magsim.config.document import Document, parse, read
from magsim.config.overrides import overrides_of
from magsim.config.problems import Problems
from magsim.config.toml import value_of

__all__ = [
    "Document",
    "Name",
    "Numbers",
    "Problems",
    "Strict",
    "Vector",
    "load",
    "overrides_of",
    "parse",
    "read",
    "value_of",
]


class Strict(BaseModel):
    """Frozen settings that refuse unknown keys and values of the wrong type."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False, validate_default=True)

    NEEDS: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    """Keys that have an effect only beside others of their table, of which at least one must not be zero or empty."""


def _as_list(value: object) -> object:
    return tuple(value) if isinstance(value, list) else value


def _one_or_many(value: object) -> object:
    return _as_list(value) if isinstance(value, list | tuple) else (value,)


Vector = Annotated[tuple[float, float, float], BeforeValidator(_as_list)]
"""Three numbers."""

Numbers = Annotated[
    tuple[float, ...],
    BeforeValidator(_one_or_many),
    Field(min_length=1),
    WithJsonSchema({"anyOf": [{"type": "number"}, {"type": "array", "items": {"type": "number"}, "minItems": 1}]}),
]
"""One number or a list of them; always a tuple once read."""

Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$", max_length=40)]
"""Name that may become part of a column."""

M = TypeVar("M", bound=BaseModel)


def load(
    path_or_text: Path | str,
    model: type[M],
    *,
    overrides: Sequence[str] = (),
    context: Mapping[str, object] | None = None,
    source: str | None = None,
) -> M:
    """Read settings from a TOML file, strictly.

    Parameters
    ----------
    path_or_text : Path or str
        A ``Path`` is read as a file; a ``str`` is the TOML text itself.
    model : type
        The pydantic model that the settings must fit, a ``Strict`` as a rule.
    overrides : sequence of str
        ``key.path=value`` settings that are applied on top of the file, in order. The value is read as TOML; what is
        no TOML value is taken as text. A list element is ``key[0]``.
    context : mapping, optional
        Passed to validators as ``info.context``.
    source : str, optional
        How messages name the file; the path as given, or ``<text>``.

    Returns
    -------
    model
        Validated and frozen.

    Raises
    ------
    RequestError
        If the file cannot be read or anything in it is wrong. One line for each problem.
    """
    if isinstance(path_or_text, Path):
        document = read(path_or_text, overrides=overrides, source=source)
    else:
        document = parse(path_or_text, overrides=overrides, source=source or "<text>")
    return document.validate(model, context=context)

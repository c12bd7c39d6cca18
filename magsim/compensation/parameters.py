"""Parameters of methods: taken from the constructor or a settings dataclass, checked strictly."""

import inspect
from collections.abc import Mapping
from functools import cache
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ValidationError, create_model

from magsim.config import Strict
from magsim.config.keys import show
from magsim.config.wording import complaints
from magsim.errors import RequestError


@cache
def parameters_of(cls: type) -> tuple[inspect.Parameter, ...]:
    """Return the parameters of a method: the fields of its ``settings_type`` if it has one, else its constructor's."""
    kinds = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
    stated = getattr(cls, "settings_type", None) or cls
    parameters = inspect.signature(stated, eval_str=True).parameters.values()
    return tuple(p for p in parameters if p.kind in kinds)


def _type_of(parameter: inspect.Parameter) -> Any:
    """Return the annotation; anything is allowed where a method of one's own has none."""
    return Any if parameter.annotation is inspect.Parameter.empty else parameter.annotation


def _default_of(parameter: inspect.Parameter) -> Any:
    """Return the default; an ellipsis where the parameter must be given."""
    return ... if parameter.default is inspect.Parameter.empty else parameter.default


@cache
def settings_model(cls: type) -> type[BaseModel]:
    """Return a strict model of a method's parameters, from their annotations and defaults."""
    # TOML and JSON have lists alone
    as_tuple = BeforeValidator(lambda value: tuple(value) if isinstance(value, list) else value)
    fields = {p.name: (Annotated[_type_of(p), as_tuple], _default_of(p)) for p in parameters_of(cls)}
    return create_model(f"{cls.__name__}Settings", __base__=Strict, **fields)  # type: ignore[call-overload]


def check_parameters(cls: type, parameters: Mapping[str, object], owner: str) -> dict[str, object]:
    """Return checked parameters with their defaults filled in.

    Parameters
    ----------
    cls : type
        The method.
    parameters : mapping
    owner : str
        Name of the method, for messages.

    Raises
    ------
    RequestError
        With one line for each parameter that is unknown or has a value that is not allowed.
    """
    table = dict(parameters)
    model = settings_model(cls)
    try:
        return dict(model.model_validate(table))
    except ValidationError as error:
        found = complaints(error, model, table)
        msg = "\n".join(f"method {owner}: {show(c.path)}: {c.text}" for c in found)
        raise RequestError(msg) from None

"""Overrides: single settings ``key.path=value`` that are applied on top of a file."""

from collections.abc import Mapping
from dataclasses import dataclass

from magsim.config import keys, toml
from magsim.config.schema import did_you_mean, show_value
from magsim.errors import RequestError


@dataclass(frozen=True)
class Override:
    """One ``key.path=value`` setting."""

    text: str
    path: keys.Path
    value: object


def overrides_of(settings: object, *, name: str) -> tuple[str, ...]:
    """Return the texts ``key.path=value`` of settings that are given as Python values.

    Parameters
    ----------
    settings : mapping of str to object
        Values by key path; what has no meaning in TOML is refused.
    name : str
        Name of the argument, for messages.

    Raises
    ------
    RequestError
        If it is no such mapping: one line for each problem.
    """
    example = 'a mapping of key paths to values, such as {"start.alt_m": 2500}'
    if not isinstance(settings, Mapping):
        msg = f"{name}: is of type {type(settings).__name__}; allowed: {example}"
        raise RequestError(msg)
    out, problems = [], []
    for key, value in settings.items():
        if not isinstance(key, str) or "=" in key or (path := keys.split(key)) is None or isinstance(path[0], int):
            problems.append(f"{name}: {key!r:.60} is no key path; allowed: {example}")
            continue
        try:
            out.append(f"{key.strip()}={toml.text_of(value)}")
        except (TypeError, ValueError) as error:
            problems.append(f"{name}: {key}: {error}" if key != name else f"{name}: {error}")
    if problems:
        raise RequestError("\n".join(problems))
    return tuple(out)


def read_override(text: str) -> Override:
    """Return the override that a text ``key.path=value`` means.

    Raises
    ------
    RequestError
        If it is not of that form.
    """
    key, equals, value = text.partition("=")
    path = keys.split(key)
    if not equals or path is None or isinstance(path[0], int):
        msg = f"--set {text}: is not of the form key.path=value, for example start.alt_m=2500"
        raise RequestError(msg)
    return Override(text, path, toml.value_of(value))


def apply(table: dict[str, object], override: Override) -> None:
    """Set one value in place, making tables on the way; lists never grow.

    Raises
    ------
    RequestError
        If the table has no such place.
    """
    node: object = table
    for i, part in enumerate(override.path):
        last = i == len(override.path) - 1
        here = keys.show(override.path[:i])
        if isinstance(part, int):
            if not isinstance(node, list):
                raise _refused(override, f"{here} is {show_value(node)}, not a list")
            if part >= len(node):
                allowed = f"0 to {len(node) - 1}" if len(node) > 1 else ("0" if node else "none, the list is empty")
                raise _refused(override, f"{here} has no element {part}; allowed: {allowed}")
            if last:
                node[part] = override.value
            else:
                node = node[part]
        elif not isinstance(node, dict):
            hint = f"; did you mean {here}[0]?" if isinstance(node, list) else ""
            raise _refused(override, f"{here} is {show_value(node)}, not a table{hint}")
        elif last:
            node[part] = override.value
        else:
            if part not in node and isinstance(override.path[i + 1], int):
                raise _refused(override, f"there is no list {part!r}{did_you_mean(part, node)}")
            node = node.setdefault(part, {})


def _refused(override: Override, why: str) -> RequestError:
    return RequestError(f"--set {keys.show(override.path)}: {why}")

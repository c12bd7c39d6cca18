"""TOML text: read with limits that tomllib lacks, and single values written."""

import json
import re
import tomllib
from collections.abc import Mapping
from datetime import date, datetime, time

import numpy as np

_DEEP_KEY = re.compile(r"""(?<![\w\-"'.])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){40}""")
_LONG_NUMBER = re.compile(r"[0-9][0-9_]{4000}")
_WHERE = re.compile(r" \((?:at line (\d+), column (\d+)|at end of document)\)$")
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")


def loads(text: str) -> dict[str, object]:
    """Return the table of a TOML text.

    Two things that tomllib takes too long or too hard are refused before: keys of very many parts, which cost it
    quadratic time, and numbers of thousands of digits.

    Raises
    ------
    ValueError
        If it is no TOML, with the place at the end of the message in the form of tomllib.
    """
    for pattern, what in ((_DEEP_KEY, "A key has more than 40 dotted parts"), (_LONG_NUMBER, "A number is too long")):
        found = pattern.search(text)
        if found is not None:
            line = text.count("\n", 0, found.start()) + 1
            msg = f"{what} (at line {line}, column {found.start() - text.rfind(chr(10), 0, found.start())})"
            raise ValueError(msg)
    try:
        return tomllib.loads(text)
    except RecursionError:
        msg = "Lists or tables are nested too deep (at end of document)"
        raise ValueError(msg) from None


def syntax_problem(message: str, text: str, source: str) -> str:
    """Return the line that reports a syntax error of ``loads``, with file and line."""
    found = _WHERE.search(message)
    if found is None:
        return f"{source}: is not TOML: {message}"
    message = message[: found.start()].replace("Cannot overwrite a value", "A key is given twice")
    if found[1] is None:
        return f"{source}:{max(len(text.splitlines()), 1)}: is not TOML: {message} at the end of the file"
    return f"{source}:{found[1]}: is not TOML: {message} (column {found[2]})"


def value_of(text: str) -> object:
    """Return the value that a text is in TOML; text that is no TOML value is taken as a string."""
    text = text.strip()
    try:
        read_back = loads(f"value = {text}")
    except ValueError:
        read_back = {}
    return read_back["value"] if set(read_back) == {"value"} else text


def text_of(value: object) -> str:
    """Return the TOML text of a value; the inverse of ``value_of``.

    A string is written without quotes where it is read back as itself, as people write it on a command line.

    Raises
    ------
    TypeError
        If TOML has no such value.
    """
    if isinstance(value, str) and value.isprintable() and value_of(value) == value:
        return value
    return _written(value)


def _written(value: object) -> str:
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, datetime | date | time):
        return value.isoformat()
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, list | tuple):
        return f"[{', '.join(_written(item) for item in value)}]"
    if isinstance(value, Mapping) and all(isinstance(key, str) for key in value):
        return "{" + ", ".join(f"{_key(key)} = {_written(item)}" for key, item in value.items()) + "}"
    what = "None" if value is None else f"a value of type {type(value).__name__}"
    msg = f"{what} is no TOML value; allowed: text, a number, true or false, a date, a list or a table of them"
    raise TypeError(msg)


def _key(key: str) -> str:
    return key if _BARE_KEY.fullmatch(key) else _written(key)

"""The JSON schema of a model: the keys below a key, and the values that it allows, in words."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import date, datetime, time
from difflib import get_close_matches
from functools import lru_cache
from typing import Any

from pydantic import BaseModel
from pydantic.errors import PydanticInvalidForJsonSchema

Schema = Mapping[str, Any]
"""A JSON schema: its values are tables, lists, texts and numbers."""

_PATTERNS = {r"^[a-z][a-z0-9_]*$": "lower-case letters, digits and _, a letter first"}
_PLURALS = {"number": "numbers", "integer": "whole numbers", "string": "texts", "object": "tables"}


@lru_cache(maxsize=64)
def of_model(model: type[BaseModel]) -> Schema:
    """Return the JSON schema of a model; empty for a model that has none."""
    try:
        return model.model_json_schema(by_alias=True)
    except PydanticInvalidForJsonSchema:
        return {}


class Guide:
    """The schema of one model, with its references followed."""

    def __init__(self, model: type[BaseModel]) -> None:
        self._root = of_model(model)
        self.root = self.resolve(self._root)

    def resolve(self, schema: object) -> Schema:
        """Return a schema with its reference followed; keys beside the reference stay.

        What may also be null, a key that may be left out, is what it is otherwise.
        """
        while isinstance(schema, Mapping):
            if "$ref" in schema:
                key, target = "$ref", self._root
                for part in str(schema["$ref"]).removeprefix("#/").split("/"):
                    target = target.get(part, {}) if isinstance(target, Mapping) else {}
            elif len(others := [m for m in schema.get("anyOf", ()) if m.get("type") != "null"]) == 1:
                key, target = "anyOf", others[0]
            else:
                return schema
            own = {name: value for name, value in schema.items() if name != key}
            schema = {**target, **own} if isinstance(target, Mapping) else own
        return {}

    def members(self, schema: Schema) -> list[Schema]:
        """Return the members of a union without null; an empty list for anything else."""
        union = schema.get("anyOf") or schema.get("oneOf") or []
        return [m for m in map(self.resolve, union) if m.get("type") != "null"]

    def tagged(self, schema: Schema, tag: object) -> Schema | None:
        """Return the member of a tagged union, or None."""
        discriminator = schema.get("discriminator")
        mapping = discriminator.get("mapping", {}) if isinstance(discriminator, Mapping) else {}
        return self.resolve({"$ref": mapping[tag]}) if tag in mapping else None

    def below(self, schema: Schema, part: str | int) -> Schema:
        """Return the schema of a key or an element; empty where nothing is known."""
        for member in self.members(schema) or [schema]:
            if isinstance(part, int):
                prefix = member.get("prefixItems")
                found = prefix[part] if isinstance(prefix, list) and part < len(prefix) else member.get("items")
            else:
                found = member.get("properties", {}).get(part)
                found = found or next(iter(member.get("patternProperties", {}).values()), None)
                found = found or member.get("additionalProperties")
            if isinstance(found, Mapping):
                return self.resolve(found)
        return {}

    def keys(self, schema: Schema) -> list[str]:
        """Return the known keys of a table."""
        return [key for member in self.members(schema) or [schema] for key in member.get("properties", {})]

    def find(self, name: str) -> str | None:
        """Return the first key path of a key with this name in another table; lists are not entered."""
        queue: list[tuple[tuple[str, ...], Schema]] = [((), self.root)]
        seen = 0
        while queue and seen < 500:
            path, schema = queue.pop(0)
            seen += 1
            for key in self.keys(schema):
                if key == name:
                    return ".".join((*path, key))
                if len(path) < 4:
                    queue.append(((*path, key), self.below(schema, key)))
        return None

    def allowed(self, schema: Schema) -> str:
        """Return what a schema allows, in words."""
        schema = self.resolve(schema)
        if "const" in schema:
            return show_value(schema["const"])
        if "enum" in schema:
            return ", ".join(show_value(value) for value in schema["enum"])
        discriminator = schema.get("discriminator")
        if isinstance(discriminator, Mapping):
            tags = " or ".join(show_value(tag) for tag in discriminator.get("mapping", {}))
            return f"a table with {discriminator['propertyName']} = {tags}"
        members = self.members(schema)
        if members:
            return " or ".join(dict.fromkeys(self.allowed(member) for member in members))
        words = {
            "number": lambda: "a number" + _range(schema),
            "integer": lambda: "a whole number" + _range(schema),
            "boolean": lambda: "true or false",
            "string": lambda: _text(schema),
            "array": lambda: self._list(schema),
            "object": lambda: self._table(schema),
        }.get(str(schema.get("type")))
        return words() if words else "another value"

    def _table(self, schema: Schema) -> str:
        known = self.keys(schema)
        return f"a table with the keys {', '.join(known)}" if known else "a table"

    def _list(self, schema: Schema) -> str:
        prefix = schema.get("prefixItems")
        item = self.resolve(prefix[0] if prefix else schema.get("items", {}))
        low, high = schema.get("minItems", 0), schema.get("maxItems")
        count = f"{low} " if low == high else (f"{_count(low)} or more " if low else "")
        if high is not None and low != high:
            count = f"{low} to {high} "
        if self.members(item) or "discriminator" in item:
            if "discriminator" in item:
                return f"a list of {count}tables"
            return f"a list{f' of {count}values' if count else ''}, each {self.allowed(item)}"
        limits = _range(item)
        each = f", each{limits}" if limits else ""
        if "enum" in item:
            return f"a list of {count}values of {self.allowed(item)}"
        return f"a list of {count}{_PLURALS.get(str(item.get('type')), 'values')}{each}"


def _count(number: int) -> str:
    return "one" if number == 1 else str(number)


def _number(value: float) -> str:
    return str(value) if isinstance(value, int) else f"{value:.10g}"


def _range(schema: Schema) -> str:
    low, above = schema.get("minimum"), schema.get("exclusiveMinimum")
    high, below = schema.get("maximum"), schema.get("exclusiveMaximum")
    parts = []
    if low is not None and high is not None:
        parts.append(f"from {_number(low)} to {_number(high)}")
    else:
        parts += [f"of {_number(low)} or more"] if low is not None else []
        parts += [f"above {_number(above)}"] if above is not None else []
        parts += [f"up to {_number(high)}"] if high is not None else []
        parts += [f"below {_number(below)}"] if below is not None else []
    if "multipleOf" in schema:
        parts.append(f"that is a multiple of {_number(schema['multipleOf'])}")
    return "".join(f" {part}" if i == 0 else f", {part}" for i, part in enumerate(parts))


def _text(schema: Schema) -> str:
    formats = {
        "date-time": "a date and time such as 2025-03-13T06:00:00Z",
        "date": "a date such as 2025-03-13",
        "time": "a time such as 06:00:00",
    }
    if schema.get("format") in formats:
        return formats[str(schema["format"])]
    pattern = schema.get("pattern")
    words = "text" if pattern is None else _PATTERNS.get(str(pattern), f"text that matches {pattern}")
    if "minLength" in schema and not pattern:
        words += ", not empty" if schema["minLength"] == 1 else f" of {schema['minLength']} characters or more"
    return words + (f", at most {schema['maxLength']} characters" if "maxLength" in schema else "")


def hint(name: str, known: Iterable[str]) -> Iterator[str]:
    """Yield the known name that is closest to a mistaken one, if any is close."""
    known = list(known)
    close = get_close_matches(name, known, n=1, cutoff=0.6)
    if not close and len(name) >= 3:
        start = name.lower()[:3]
        close = get_close_matches(name.lower(), [k for k in known if k.startswith(start)], n=1, cutoff=0.4)
    yield from close


def did_you_mean(name: object, known: Iterable[str]) -> str:
    """Return a hint such as `` (did you mean 'axis'?)`` where a known name is close, else an empty text."""
    if not isinstance(name, str) or len(name) > 200:
        return ""
    return next((f" (did you mean '{close}'?)" for close in hint(name, known)), "")


def show_value(value: object, limit: int = 60) -> str:
    """Return a value as a TOML file would write it, cut short."""
    if isinstance(value, Mapping):
        return "a table"
    if isinstance(value, list | tuple):
        return _show_list(value, limit)
    if isinstance(value, str):
        short = value if len(value) <= limit else value[: limit - 3] + "..."
        return f"'{short}'" if short.isprintable() else ascii(short)
    return _show_scalar(value)[:limit]


def _show_list(values: Sequence[object], limit: int) -> str:
    if any(isinstance(value, Mapping) for value in values[:10]):
        return "a list of tables"
    text = "[" + ", ".join(show_value(v, 20) for v in values[:10]) + (", ...]" if len(values) > 10 else "]")
    return text if len(text) <= limit else text[: limit - 4] + "...]"


def _show_scalar(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, datetime | date | time):
        return value.isoformat()
    if isinstance(value, int) and abs(value) >= 10**18:
        return "a whole number of more than 18 digits"
    return f"{value:.10g}" if isinstance(value, float) else str(value)

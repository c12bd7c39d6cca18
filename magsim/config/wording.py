"""Errors of pydantic in plain words: what is wrong, and what is allowed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import islice

from pydantic import BaseModel, ValidationError

from magsim.config import keys
from magsim.config.problems import Problems
from magsim.config.schema import Guide, Schema, did_you_mean, show_value

MAX_ERRORS = 1000
"""Most errors that are looked at: beyond it a file is hostile, not mistaken."""


@dataclass(frozen=True)
class Complaint:
    """One problem: the key that it belongs to, and what is wrong and allowed."""

    path: keys.Path
    text: str


@dataclass(frozen=True)
class _Place:
    """Where an error lies: keys and indices of the data alone, the value there, and its schema."""

    path: keys.Path
    value: object
    schema: Schema


@dataclass(frozen=True)
class _Found:
    """One error of pydantic with its place, and with the place and the member of the union it arose in, if any.

    pydantic tries every member of an untagged union and complains about each; the member's name stands
    inside its location.
    """

    error: Mapping
    place: _Place
    union: _Place | None
    member: str


def complaints(error: ValidationError, model: type[BaseModel], table: Mapping[str, object]) -> list[Complaint]:
    """Return every problem in a validation error, once each, in pydantic's order."""
    guide = Guide(model)
    groups: dict[object, list[_Found]] = {}
    for number, raw in enumerate(islice(error.errors(include_url=False), MAX_ERRORS)):
        found = _locate(guide, raw, table)
        groups.setdefault(found.union.path if found.union else number, []).append(found)
    out: list[Complaint] = []
    for group in groups.values():
        out += _merge(guide, group)
    return list(dict.fromkeys(out))


def _has(value: object, part: str | int) -> bool:
    if isinstance(value, Mapping):
        return part in value
    return isinstance(value, list) and isinstance(part, int) and part < len(value)


def _locate(guide: Guide, error: Mapping, table: Mapping[str, object]) -> _Found:
    """Walk data and schema along pydantic's location.

    What is neither a key nor an index of the data is pydantic's own: tags of unions, names of their members, marks
    of validators. All of it is left out of the path.
    """
    place, union, member = _Place((), table, guide.root), None, ""
    loc = error["loc"]
    for i, part in enumerate(loc):
        tagged = guide.tagged(place.schema, part)
        if tagged is not None:
            place = _Place(place.path, place.value, tagged)
        elif _has(place.value, part):
            below = guide.below(place.schema, part)
            place = _Place((*place.path, part), place.value[part], below)  # type: ignore[index]
        elif error["type"] == "missing" and i == len(loc) - 1 and isinstance(part, str):
            place = _Place((*place.path, part), None, guide.below(place.schema, part))
        elif union is None and isinstance(part, str) and len(guide.members(place.schema)) > 1:
            union, member = place, part
    return _Found(error, place, union, member)


def _merge(guide: Guide, group: Sequence[_Found]) -> list[Complaint]:
    """Return the complaints about one value: if it may be of several kinds, those of the nearest kind."""
    union = group[0].union
    if union is None:
        return [complaint for found in group for complaint in _worded(guide, found)]
    members: dict[str, list[_Found]] = {}
    for found in group:
        members.setdefault(found.member, []).append(found)
    near = [
        member
        for member in members.values()
        if all(found.place.path != union.path or not _wrong_kind(found.error["type"]) for found in member)
    ]
    if near:
        return [c for found in min(near, key=len) for c in _worded(guide, found)]
    return [Complaint(union.path, _not_allowed(guide, union, kind=False))]


def _wrong_kind(error_type: str) -> bool:
    return error_type.endswith(("_type", "_error")) and error_type not in ("value_error", "assertion_error")


def _worded(guide: Guide, found: _Found) -> list[Complaint]:
    """Return one error of pydantic in words: one complaint as a rule."""
    place, kind, ctx = found.place, found.error["type"], found.error.get("ctx", {})
    loc = found.error["loc"]
    if kind in ("value_error", "assertion_error"):
        error = ctx.get("error")
        if isinstance(error, Problems):
            return [Complaint((*place.path, *(keys.split(key) or ())), text) for key, text in error.found]
        return [Complaint(place.path, str(error or found.error["msg"]))]
    if kind == "missing" and isinstance(loc[-1], str):
        meaning = place.schema.get("description")
        note = f" ({meaning})" if isinstance(meaning, str) and len(meaning) < 80 else ""
        text = f"is missing; allowed: {guide.allowed(place.schema)}{note}"
    elif kind == "extra_forbidden":
        text = _unknown_key(guide, found)
    elif loc and loc[-1] == "[key]":
        text = _bad_name(guide, found)
    elif kind in ("union_tag_invalid", "union_tag_not_found") and isinstance(place.value, Mapping):
        return [_wrong_tag(place, place.value, str(ctx["discriminator"]).strip("'"))]
    elif kind in ("missing", "too_short", "too_long"):
        count = len(place.value) if isinstance(place.value, Mapping | list) else 1
        if kind != "missing" and ctx.get("min_length", 0) <= count <= ctx.get("max_length", count):
            return []  # pydantic does not count entries that are wrong themselves; those are reported already
        text = f"has {count} {'entry' if count == 1 else 'entries'}; allowed: {guide.allowed(place.schema)}"
    else:
        text = _not_allowed(guide, place, kind=kind.endswith("_type"))
    return [Complaint(place.path, text)]


def _not_allowed(guide: Guide, place: _Place, *, kind: bool) -> str:
    shown, what = show_value(place.value), "not allowed"
    if kind:
        what = _kind(place.value)
    start = f"is {what}" if shown == what else f"{shown} is {what}"
    values = place.schema.get("enum") or ()
    return f"{start}; allowed: {guide.allowed(place.schema)}{did_you_mean(place.value, map(str, values))}"


def _kind(value: object) -> str:
    if isinstance(value, bool):
        return "not allowed"
    if isinstance(value, Mapping):
        return "a table"
    if isinstance(value, list):
        return show_value(value) if show_value(value) == "a list of tables" else "a list"
    return {str: "text", int: "a whole number", float: "a number"}.get(type(value), "not allowed")


def _unknown_key(guide: Guide, found: _Found) -> str:
    name = str(found.place.path[-1])
    parent = guide.root
    for part in found.error["loc"][:-1]:
        tagged = guide.tagged(parent, part)
        parent = tagged if tagged is not None else (guide.below(parent, part) or parent)
    known = guide.keys(parent)
    hint = did_you_mean(name, known)
    if not hint:
        elsewhere = guide.find(name)
        hint = f" (did you mean '{elsewhere}'?)" if elsewhere not in (None, keys.show(found.place.path)) else ""
    return f"unknown key{hint}; known: {', '.join(known)}"


def _bad_name(guide: Guide, found: _Found) -> str:
    table = guide.root
    for part in found.place.path[:-1]:
        table = guide.below(table, part)
    names = dict(table.get("propertyNames", {}))
    patterns = table.get("patternProperties", {})
    names.setdefault("type", "string")
    if patterns:
        names["pattern"] = next(iter(patterns))
    known = names.get("enum", ())
    return f"unknown name; allowed: {guide.allowed(names)}{did_you_mean(found.place.path[-1], map(str, known))}"


def _wrong_tag(place: _Place, table: Mapping[str, object], key: str) -> Complaint:
    mapping = place.schema.get("discriminator", {}).get("mapping", {})
    allowed = ", ".join(show_value(tag) for tag in mapping)
    path = (*place.path, key)
    value = table.get(key)
    if value is None:
        return Complaint(path, f"is missing; allowed: {allowed}")
    return Complaint(path, f"{show_value(value)} is not allowed; allowed: {allowed}{did_you_mean(value, mapping)}")

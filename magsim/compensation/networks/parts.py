"""What an input column is of: a term of Tolles and Lawson, the place, the time, or something else of the aircraft.

Networks of several branches give each branch its own columns; they know a column by its name.
"""

from collections.abc import Mapping, Sequence
from typing import Literal

from magsim.compensation.columns.tolles_lawson import term_groups, term_names
from magsim.errors import RequestError

Part = Literal["permanent", "induced", "eddy", "position", "travel", "time", "other"]

_TERMS: Mapping[str, str] = {
    name: group
    for eddy in ("direction", "field")
    for name, group in zip(term_names(18, eddy), term_groups(18), strict=True)
} | {f"B (u{i} u{i} - 1/3)": "induced" for i in (1, 2, 3)}

_EARTH: Mapping[str, str] = {
    "lat": "position",
    "lon": "position",
    "height": "position",
    "d lat": "travel",
    "d lon": "travel",
    "time": "time",
}


def part_of(name: str) -> str:
    """Return what a column is of; ``other`` for attitude, rates, currents and all else that is of the aircraft."""
    return _TERMS.get(name) or _EARTH.get(name, "other")


def places(names: Sequence[str], *parts: Part) -> tuple[int, ...]:
    """Return the places of the columns of these parts."""
    return tuple(place for place, name in enumerate(names) if part_of(name) in parts)


def refuse(names: Sequence[str], *parts: Part, reader: str, allowed: str) -> None:
    """Refuse columns of these parts.

    Raises
    ------
    RequestError
        Naming them, who does not read them, and what is allowed.
    """
    found = [names[place] for place in places(names, *parts)]
    if found:
        msg = f"inputs: {reader} reads no column {', '.join(found)}; allowed: {allowed}"
        raise RequestError(msg)

"""Parts of a flight by heading and maneuver: what scores are broken down by."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from magsim import columns


class NamedRows(NamedTuple):
    """Rows of one part of a flight."""

    name: str
    rows: np.ndarray
    """(n,) bool"""


def has_maneuvers(data: Mapping[str, np.ndarray]) -> bool:
    """Whether a table has the columns that headings and maneuvers are known from."""
    return columns.LEG_HEADING.pattern in data and columns.MANEUVER.pattern in data


def headings_and_maneuvers(data: Mapping[str, np.ndarray]) -> list[NamedRows]:
    """Find the straight legs of each heading, ``heading 90``, and the rows of each maneuver, ``roll``.

    Parameters
    ----------
    data : mapping of str to (n,)
        With the segment columns ``leg_heading_deg`` and ``maneuver``; ``turn`` separates legs from turns.

    Returns
    -------
    list of NamedRows
        Those that have rows: headings in order, then maneuvers. Empty without these columns.
    """
    if not has_maneuvers(data):
        return []
    heading, maneuver = data[columns.LEG_HEADING.pattern], data[columns.MANEUVER.pattern]
    straight = data.get(columns.TURN.pattern, np.zeros(len(heading))) == 0.0
    found = [NamedRows(f"heading {value:g}", straight & (heading == value)) for value in np.unique(heading[straight])]
    found += [NamedRows(word, maneuver == code) for code, word in columns.MANEUVERS.items() if code != 0]
    return [segment for segment in found if segment.rows.any()]


def cells(data: Mapping[str, np.ndarray]) -> list[NamedRows]:
    """Find the rows of each maneuver on each heading, ``heading 90 roll``: the cells of a figure of merit.

    Parameters
    ----------
    data : mapping of str to (n,)
        As in ``headings_and_maneuvers``.

    Returns
    -------
    list of NamedRows
        Those that have rows, in order of heading, then maneuver. Empty without these columns.
    """
    if not has_maneuvers(data):
        return []
    heading, maneuver = data[columns.LEG_HEADING.pattern], data[columns.MANEUVER.pattern]
    flown = np.isin(maneuver, [code for code in columns.MANEUVERS if code != 0])
    pairs = sorted(set(zip(heading[flown].tolist(), maneuver[flown].tolist(), strict=True)))
    return [
        NamedRows(f"heading {course:g} {columns.MANEUVERS[int(code)]}", (heading == course) & (maneuver == code))
        for course, code in pairs
    ]

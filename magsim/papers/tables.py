"""A table of a paper: what it prints, what is found here, and why they differ; as text, CSV, JSON and Markdown."""

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from scipy.stats import quantile_test

LEAST_FOR_INTERVAL = 6
"""Fewest values whose order statistics hold the median with 95 %: 1 - 2 / 2^6 = 97 %; five give 94 %."""

BESIDE: Mapping[str, str] = {
    "tl16_auxiliary": "T-L with auxiliary columns",
    "exact_norm": "exact_norm (ours)",
    "noise_floor": "noise floor",
}
"""Methods that stand below the tables of every paper, and how they are called there."""

MOST_PRINTED = 4
"""Most decimals that any of the papers prints."""


@dataclass(frozen=True)
class Cell:
    """One figure.

    Attributes
    ----------
    published : float, optional
        As the paper prints it.
    found : tuple of float
        Ours: one value for each flight, pair of flights, or start weights.
    """

    published: float | None = None
    found: tuple[float, ...] = ()

    @cached_property
    def median(self) -> float:
        """Median of what is found; NaN where nothing is."""
        return float(np.median(self.found)) if self.found else math.nan

    @cached_property
    def interval(self) -> tuple[float, float] | None:
        """Interval that holds the median with 95 %; None for fewer than two values.

        By order statistics (Conover, Practical Nonparametric Statistics, section 3.2); of fewer than
        ``LEAST_FOR_INTERVAL`` values the range.
        """
        if len(self.found) < 2:
            return None
        if len(self.found) < LEAST_FOR_INTERVAL:
            return min(self.found), max(self.found)
        low, high = quantile_test(self.found, p=0.5).confidence_interval(0.95)
        return float(low), float(high)

    @property
    def reproduced(self) -> bool | None:
        """Whether the published figure lies in the range of ours; None where one of the two is missing."""
        if self.published is None or not self.found:
            return None
        return min(self.found) <= self.published <= max(self.found)


@dataclass(frozen=True)
class Column:
    """A column of figures: its key in the lines, its name, unit, and the decimals that are shown."""

    key: str
    name: str
    unit: str = ""
    decimals: int = 3

    @property
    def title(self) -> str:
        """Name and unit."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


@dataclass(frozen=True)
class Line:
    """A row of a table.

    Attributes
    ----------
    name : str
        Of the method, as the paper has it.
    cells : mapping of str to Cell
        By the key of their column.
    remark : str
        Why ours differs, in one line.
    added : bool
        Not of the paper: stands below the table.
    """

    name: str
    cells: Mapping[str, Cell]
    remark: str = ""
    added: bool = False


@dataclass(frozen=True)
class PaperTable:
    """A table of a paper.

    Attributes
    ----------
    key : str
        ``table_2``: name of its files.
    title : str
    columns : tuple of Column
    lines : tuple of Line
        Those of the paper first.
    over : str
        What the values of a cell are: ``12 flights``.
    notes : tuple of str
    timed : bool
        Holds times of this machine, which are others in another run.
    """

    key: str
    title: str
    columns: tuple[Column, ...]
    lines: tuple[Line, ...]
    over: str
    notes: tuple[str, ...] = field(default=())
    timed: bool = False

    def cell(self, line: str, column: str) -> Cell:
        """Return a figure; an empty one where the line has none."""
        (found,) = (one for one in self.lines if one.name == line)
        return found.cells.get(column, Cell())

    @property
    def reproduced(self) -> tuple[int, int]:
        """How many published figures lie in the range of ours, and how many have been tried."""
        found = [cell.reproduced for line in self.lines for cell in line.cells.values()]
        known = [one for one in found if one is not None]
        return sum(known), len(known)


def counted(number: int, noun: str = "flights") -> str:
    """Return ``6 pairs of flights``, or ``1 pair of flights``: what the values of a cell are."""
    first, *others = noun.split(" ")
    return " ".join([str(number), first.removesuffix("s") if number == 1 else first, *others])


def _number(value: float, decimals: int) -> str:
    if math.isnan(value):
        return "-"
    # figures of another size than the column expects keep three digits
    return f"{value:.{decimals}f}" if value == 0.0 or abs(value) >= 10.0**-decimals else f"{value:.2g}"


def _printed(value: float, decimals: int) -> str:
    """Return a published figure with all of its decimals; one computed from published ones as the others are."""
    printed = f"{value:.{MOST_PRINTED}f}".rstrip("0")
    return _number(value, max(decimals, len(printed.partition(".")[2])) if float(printed) == value else decimals)


def _pair(cell: Cell, decimals: int) -> tuple[str, str]:
    """Return the published figure and ours as text."""
    published = "-" if cell.published is None else _printed(cell.published, decimals)
    ours = _number(cell.median, decimals)
    if cell.interval is not None:
        low, high = (_number(end, decimals) for end in cell.interval)
        ours += f" [{low}, {high}]"
    return published, ours


def _grid(table: PaperTable) -> tuple[list[str], list[tuple[bool, list[str]]]]:
    """Return the head, and the lines with whether they are added, as text."""
    printed = {key for line in table.lines for key, cell in line.cells.items() if cell.published is not None}
    head = [""]
    for column in table.columns:
        head += [f"{column.title}, paper", "ours"] if column.key in printed else [column.title]
    body = []
    for line in table.lines:
        words = [line.name]
        for column in table.columns:
            published, ours = _pair(line.cells.get(column.key, Cell()), column.decimals)
            words += [published, ours] if column.key in printed else [ours]
        body.append((line.added, words))
    return head, body


def _caption(table: PaperTable) -> str:
    return f"Ours: median over {table.over}; in brackets its 95 % interval, or the range of fewer than 6."


def _remarks(table: PaperTable) -> list[str]:
    """Return the remarks on lines, each once, behind the lines that it is on."""
    names: dict[str, list[str]] = {}
    for line in table.lines:
        if line.remark:
            names.setdefault(line.remark, []).append(line.name)
    return [f"{'; '.join(lines)}: {remark}" for remark, lines in names.items()]


def text(table: PaperTable) -> str:
    """Return a table as plain text, with its remarks below."""
    head, body = _grid(table)
    widths = [max(len(row[k]) for row in (head, *(words for _, words in body))) for k in range(len(head))]

    def row(words: Sequence[str]) -> str:
        first, *others = words
        cells = [first.ljust(widths[0]), *(word.rjust(width) for word, width in zip(others, widths[1:], strict=True))]
        return "  ".join(cells).rstrip()

    rule = "-" * len(row(head).ljust(sum(widths) + 2 * len(widths) - 2))
    lines = [table.title, _caption(table), "", row(head), rule]
    lines += [row(words) for added, words in body if not added]
    below = [row(words) for added, words in body if added]
    lines += [rule, *below] if below else []
    return "\n".join([*lines, "", *_remarks(table), *table.notes]).rstrip() + "\n"


def markdown(table: PaperTable) -> str:
    """Return a table for ``docs/papers.md``."""
    head, body = _grid(table)
    lines = [f"**{table.title}** {_caption(table)}", "", f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    for added, words in body:
        first, *others = words
        lines.append(f"| {' | '.join([f'*{first}*' if added else first, *others])} |")
    remarks = [f"- {one}" for one in (*_remarks(table), *table.notes)]
    return "\n".join([*lines, *([""] if remarks else []), *remarks]) + "\n"


def as_csv(table: PaperTable) -> str:
    """Return a table as CSV: one row for each figure."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["line", "added", "column", "unit", "published", "median", "low", "high", "values"])
    for line in table.lines:
        for column in table.columns:
            cell = line.cells.get(column.key, Cell())
            low, high = cell.interval or ("", "")
            median = "" if math.isnan(cell.median) else repr(cell.median)
            published = "" if cell.published is None else repr(cell.published)
            values = ";".join(map(repr, cell.found))
            ends = [repr(end) if end != "" else "" for end in (low, high)]
            writer.writerow([line.name, line.added, column.name, column.unit, published, median, *ends, values])
    return out.getvalue()


def cell_as_json(cell: Cell) -> dict[str, Any]:
    """Return a figure as values for JSON."""
    return {"published": cell.published, "found": list(cell.found), "interval": cell.interval}


def as_json(table: PaperTable) -> dict[str, Any]:
    """Return a table as values for JSON."""
    lines = []
    for line in table.lines:
        cells = {key: cell_as_json(cell) for key, cell in line.cells.items()}
        lines.append({"name": line.name, "added": line.added, "remark": line.remark, "cells": cells})
    columns = [{"key": c.key, "name": c.name, "unit": c.unit} for c in table.columns]
    head = {"key": table.key, "title": table.title, "over": table.over, "notes": list(table.notes)}
    return {**head, "timed": table.timed, "columns": columns, "lines": lines}

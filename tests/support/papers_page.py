"""Published figures as they stand on the page of the papers."""

import re
from collections.abc import Iterator

import pytest

from magsim.papers import PaperRun
from tests.support.paths import ROOT

Place = tuple[str, str, str]
"""Title of a table, name of a line, title of a column."""


def on_page(number: str) -> dict[Place, float]:
    """Return every figure that the page calls a paper's in the tables of one paper.

    They stand in columns whose head ends in ``, paper``, in the lines that are not in italics.
    """
    text = (ROOT / "docs/papers.md").read_text(encoding="utf-8")
    (run,) = re.findall(rf"<!-- run {number} -->(.*?)<!-- end -->", text, flags=re.DOTALL)
    found: dict[Place, float] = {}
    for title, table in re.findall(r"^\*\*(.+?)\*\* .*\n\n((?:\|.*\n)+)", run, flags=re.MULTILINE):
        head, _, *body = (_words(row) for row in table.splitlines())
        for line, *cells in body:
            for column, cell in zip(head[1:], cells, strict=True):
                if column.endswith(", paper") and cell != "-":
                    found[title, line, column.removesuffix(", paper")] = float(cell)
    return found


def _words(row: str) -> list[str]:
    return [word.strip() for word in row.strip("|").split("|")]


def of_run(run: PaperRun) -> Iterator[tuple[Place, float, float]]:
    """Yield the published figures of a run's tables, with what the page may differ by: nothing, where they are printed.

    Those that are computed from printed ones are rounded.
    """
    for table in run.tables:
        for line in table.lines:
            for column in table.columns:
                published = line.cells[column.key].published if column.key in line.cells else None
                if published is not None:
                    last = 10.0**-column.decimals
                    rounding = 0.005 * abs(published) if abs(published) < last else 0.5 * last
                    printed = round(published, 4) == published
                    yield (table.title, line.name, column.title), published, 0.0 if printed else rounding


def require_on_page(number: str, run: PaperRun) -> None:
    """Assert that the page has the published figures of a run, and no other."""
    wanted = {place: pytest.approx(value, rel=0.0, abs=rounding) for place, value, rounding in of_run(run)}
    assert on_page(number) == wanted

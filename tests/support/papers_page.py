"""Published figures as they stand on the page of the papers."""

import re
from collections.abc import Iterator, Mapping

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


def of_run(run: PaperRun) -> Iterator[tuple[Place, float, int]]:
    """Yield the published figures of a run's tables, with the decimals that are shown."""
    for table in run.tables:
        for line in table.lines:
            for column in table.columns:
                published = line.cells[column.key].published if column.key in line.cells else None
                if published is not None:
                    yield (table.title, line.name, column.title), published, column.decimals


def require_on_page(number: str, run: PaperRun) -> None:
    """Assert that the page has the published figures of a run, to the last digit shown, and no other."""
    wanted: Mapping[Place, float] = {
        place: pytest.approx(value, rel=0.005 if abs(value) < 10.0**-decimals else 0.0, abs=0.5 * 10.0**-decimals)
        for place, value, decimals in of_run(run)
    }
    assert on_page(number) == wanted

"""All papers by number; each is imported when it is asked for."""

from collections.abc import Mapping
from importlib import import_module

from magsim.errors import RequestError
from magsim.papers.paper import Paper

_MODULES: Mapping[str, str] = {
    "000": "magsim.papers.paper_000",
    "001": "magsim.papers.paper_001.paper",
    "002": "magsim.papers.paper_002",
    "003": "magsim.papers.paper_003.paper",
    "004": "magsim.papers.paper_004.paper",
}
"""Module of each paper, with its ``PAPER``."""


def numbers() -> tuple[str, ...]:
    """Return the numbers of all papers."""
    return tuple(_MODULES)


def find_paper(number: str) -> Paper:
    """Return a paper.

    Raises
    ------
    RequestError
        If there is none of that number.
    """
    if number not in _MODULES:
        msg = f"there is no paper {number!r}; allowed: {', '.join(_MODULES)}"
        raise RequestError(msg)
    paper: Paper = import_module(_MODULES[number]).PAPER
    return paper

"""Figures quoted in the comments of the shipped scenarios are those of the scenarios.

A figure that changed: the text is wrong, edit it. A new figure: a line in ``tests/support/quoted.py`` says what it is.
"""

import re
from functools import cache

import pytest

from magsim import assets
from magsim.loading import LoadedScenario, load_scenario
from tests.support.paths import ROOT
from tests.support.quoted import CITED, NAMES, NUMBER, PAGES, QUOTES, Quote, comments, rounds_to

SCENARIOS = assets.list_scenarios()


@cache
def loaded(name: str) -> LoadedScenario:
    return load_scenario(name)


def check(place: str, text: str, quote: Quote, name: str) -> int:
    """Compare each place where a text has a quote with a scenario; return how many there are."""
    found = list(re.finditer(quote.phrase, text))
    for match in found:
        figures = list(quote.figures(loaded(name)))
        assert all(rounds_to(value, printed) for value, printed in zip(figures, match.groups(), strict=True)), (
            f"{place}: '{match[0]}', but it is {', '.join(f'{value:.6g}' for value in figures)}"
        )
    return len(found)


@pytest.mark.parametrize("name", SCENARIOS)
def test_quoted_figures_are_those_of_the_scenario(name: str) -> None:
    for comment in comments(loaded(name).text):
        for quote in QUOTES:
            check(name, comment, quote, name)


@pytest.mark.parametrize(("page", "name", "quote"), PAGES)
def test_figures_on_pages_are_those_of_the_scenario(page: str, name: str, quote: Quote) -> None:
    text = " ".join((ROOT / page).read_text(encoding="utf-8").split())
    assert check(page, text, quote, name), f"{page} has no '{quote.phrase}'"


@pytest.mark.parametrize("name", SCENARIOS)
def test_every_figure_is_held(name: str) -> None:
    for comment in comments(loaded(name).text):
        rest = comment
        for phrase in (*NAMES, *CITED, *(quote.phrase for quote in QUOTES)):
            rest = re.sub(phrase, " ", rest)
        tokens = [token.strip("().,:;'\"`") for token in rest.split()]
        free = [token for token in tokens if NUMBER.fullmatch(token)]
        assert not free, f"{name}: nothing holds {', '.join(free)} in '{comment}'"


def test_every_quote_is_quoted() -> None:
    every = [comment for name in SCENARIOS for comment in comments(loaded(name).text)]
    for phrase in (*NAMES, *CITED, *(quote.phrase for quote in QUOTES)):
        assert any(re.search(phrase, comment) for comment in every), f"no scenario has '{phrase}'"


@pytest.mark.parametrize(
    ("value", "printed", "same"),
    [(133.33, "133", True), (133.6, "133", False), (1.258, "1.26", True), (5.0, "+-5", True), (-1.52, "-1.52", True)],
)
def test_figures_round_to_what_is_printed(value: float, printed: str, same: bool) -> None:
    assert rounds_to(value, printed) is same

"""Recipes: mistakes are reported with file and line."""

import shutil

import pytest

from tests.support.tiny_dataset import run


@pytest.mark.parametrize(
    ("old", "new", "lines"),
    [
        (
            'date = 2026-01-02\nkeywords = ["lines"]',
            'dat = 2026-01-02\nkeywords = "lines"',
            [
                "tiny/recipe.toml:1: date: is missing; allowed: a date such as 2025-03-13 (when this version",
                "tiny/recipe.toml:4: dat: unknown key (did you mean 'date'?)",
                "tiny/recipe.toml:5: keywords: 'lines' is text; allowed: a list",
            ],
        ),
        (
            'name = "more", scenario = "line.toml", set = ["seed=7"], splits = ["test"]',
            'name = "learn", scenario = "lin.toml", splits = ["tset"]',
            [
                "tiny/recipe.toml:21: shards[1].flights[0].name: 'learn' is the name of another flight; allowed: each",
                "tiny/recipe.toml:21: shards[1].flights[0].splits[0]: 'tset' is not allowed; allowed: 'train', 'valid'",
            ],
        ),
        (
            'name = "more", scenario = "line.toml"',
            'name = "learn", scenario = "lin.toml"',
            [
                "tiny/recipe.toml:21: shards[1].flights[0].name: 'learn' is the name of another flight",
                "tiny/recipe.toml:21: shards[1].flights[0].scenario: tiny/lin.toml: there is no such file",
            ],
        ),
        (
            'set = ["seed=7"]',
            'set = ["seed=-7", "start.alt=3"]',
            [
                "tiny/recipe.toml:21: shards[1].flights[0].scenario: --set seed: -7 is not allowed",
                "tiny/recipe.toml:21: shards[1].flights[0].scenario: --set start.alt: unknown key (did you mean",
            ],
        ),
    ],
)
def test_mistakes_in_a_recipe_are_reported_with_file_and_line(here, capsys, old, new, lines):
    text = (here / "tiny" / "recipe.toml").read_text()
    assert old in text
    (here / "tiny" / "recipe.toml").write_text(text.replace(old, new))
    code, _, err = run(capsys, "build", "./tiny", "-o", "other")
    assert code == 2
    found = err.splitlines()
    assert [line[: len(start)] for line, start in zip(found, lines, strict=True)] == lines


def test_names_that_are_not_of_data_sets(here, capsys):
    (here / "Bad-Name").mkdir()
    shutil.copy(here / "tiny" / "recipe.toml", here / "Bad-Name")
    shutil.copy(here / "tiny" / "line.toml", here / "Bad-Name")
    for name, text in (
        (
            "c208b_calibratio",
            "there is no data set 'c208b_calibratio'; allowed: c208b_calibration, or a folder",
        ),
        ("./no", "./no: there is no such folder with a recipe.toml; allowed: "),
        ("./Bad-Name", "Bad-Name/recipe.toml:2: title: the folder's name 'Bad-Name' cannot name a data set"),
    ):
        code, _, err = run(capsys, "build", name, "-o", "other")
        assert code == 2
        assert err.startswith(text)

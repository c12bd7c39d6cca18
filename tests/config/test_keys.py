"""Key paths, and their lines in a TOML text."""

import tomllib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magsim.config import keys

HARD = (
    """
# comment = 1 [x]
a.b = 1
"q.r" = 'it"""
    + """'s'
""".replace("'s'", "'")
    + r'''
c = """
[not.a.table]
d = "\"" # no comment
"""
l = [ # here
  1, # one
  [2,
   3],
  { m = 4, n = { o = "]" } },
]
t = { u = 1, "v w" = [5,
6] }
[x.y]
z = 1
[[x.list]]
p = 1
[[x.list]]
p = 2
[[x.list.inner]]
q = 7
[x]
late = 1
'''
)


def test_lines_of_all_kinds_of_keys():
    text = HARD
    table = tomllib.loads(text)
    lines = keys.Lines(text)
    rows = text.split("\n")

    def check(path: keys.Path, needle: str) -> None:
        assert needle in rows[lines.of(path) - 1], (path, lines.of(path))

    assert table["x"]["list"][1]["inner"][0]["q"] == 7
    check(("a", "b"), "a.b")
    check(("q.r",), '"q.r"')
    check(("c",), 'c = """')
    check(("l", 0), "  1,")
    check(("l", 1), "[2,")
    check(("l", 1, 1), "   3]")
    check(("l", 2, "n", "o"), "{ m")
    check(("t", "v w", 1), "6]")
    check(("x", "y", "z"), "z = 1")
    check(("x", "list", 0), "[[x.list]]")
    check(("x", "list", 1, "p"), "p = 2")
    check(("x", "list", 1, "inner", 0, "q"), "q = 7")
    check(("x", "late"), "late")
    check(("x", "unknown"), "[x]")
    assert lines.of(("nothing",)) == 1


def _paths(value: object, path: keys.Path = ()) -> list[keys.Path]:
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [path, *(p for key, item in items for p in _paths(item, (*path, key)))]


_KEY = st.text(st.characters(codec="utf-8", exclude_categories=["Cs", "Cc"]), max_size=6)


_SCALAR = st.one_of(
    st.integers(-9, 9), st.booleans(), st.text(st.characters(exclude_categories=["Cs", "Cc"]), max_size=8)
)


_VALUE = st.recursive(
    _SCALAR, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(_KEY, inner, max_size=3), max_leaves=8
)


def _toml(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, list):
        return "[" + ",\n ".join(map(_toml, value)) + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_toml(key)} = {_toml(item)}" for key, item in value.items()) + "}"
    return str(value)


@settings(max_examples=150, deadline=None)
@given(st.dictionaries(_KEY, _VALUE, max_size=5))
def test_the_locator_knows_every_key_that_tomllib_knows(table):
    text = "\n".join(f"{_toml(key)} = {_toml(value)}" for key, value in table.items())
    assert tomllib.loads(text) == table
    lines = keys.Lines(text)
    assert all(path in lines for path in _paths(table) if path)


@given(st.lists(st.one_of(st.integers(0, 99), _KEY), min_size=1, max_size=5))
def test_key_paths_survive_writing_and_reading(parts):
    path = ("start", *parts)
    assert keys.split(keys.show(path)) == path


@pytest.mark.parametrize("text", ["", ".", "a.", "a..b", "a[", "a[x]", "a b", "a[1]b", ".a"])
def test_what_is_no_key_path(text):
    assert keys.split(text) is None

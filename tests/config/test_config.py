"""Strict TOML: every mistake in one pass, each with its place and what is allowed."""

import tomllib
from contextlib import suppress
from datetime import datetime
from typing import Annotated, Literal

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import Discriminator, Field, model_validator

from magsim import config
from magsim.config import Name, Numbers, Problems, Strict, Vector, keys
from magsim.errors import RequestError


class Round(Strict):
    kind: Literal["round"] = "round"
    radius_m: float = Field(default=1.0, gt=0.0)
    weights: Numbers = (1.0,)
    place_m: Vector = (0.0, 0.0, 0.0)
    steps: Annotated[tuple[int, ...], Field(strict=False)] = (1,)


class Square(Strict):
    kind: Literal["square"] = "square"
    side_m: float | None = None
    either: float | Annotated[tuple[float, ...], Field(strict=False)] = 1.0
    rate_hz: int = Field(default=120, ge=60, le=480, multiple_of=60, description="step rate")
    when: datetime | None = None


Shape = Annotated[Round | Square, Discriminator("kind")]


class Plan(Strict):
    seed: int
    axis: Literal["pitch", "roll", "yaw"] = "roll"
    lat_deg: float = Field(default=0.0, ge=-89.0, le=89.0)
    on: bool = True
    shape: Shape = Round()
    shapes: tuple[Shape, ...] = Field(default=(), strict=False)
    named: dict[Name, Round] = Field(default_factory=dict)
    share: dict[Literal["first", "second"], float] = Field(default_factory=dict)


class Pair(Strict):
    low: float
    high: float
    parts: tuple[Round, ...] = Field(default=(), strict=False)

    @model_validator(mode="after")
    def _ordered(self) -> "Pair":
        if self.low > self.high:
            raise Problems(("high", "is below low"), ("parts[0].radius_m", "is odd"), ("", "is upside down"))
        return self


def problems(text: str, model: type = Plan, **options: object) -> list[str]:
    """Lines of the error that a text makes."""
    with pytest.raises(RequestError) as caught:
        config.load(text, model, source="p.toml", **options)
    return str(caught.value).split("\n")


def test_a_good_file_becomes_frozen_settings():
    plan = config.load(
        'seed = 3\nshape = { kind = "square", side_m = 2 }\n[[shapes]]\nkind = "round"\nweights = 4', Plan
    )
    assert plan.shape.side_m == 2.0
    assert plan.shapes[0].weights == (4.0,)
    with pytest.raises(ValueError, match="frozen"):
        plan.seed = 4


def test_every_mistake_is_told_in_one_pass_in_the_order_of_the_file():
    text = """\
axis = "pich"
lat_deg = 95
colour = 1

[shape]
kind = "round"
radius_m = -1.5
weights = [1, "x"]
place_m = [1.0, 2.0]
steps = ["1", 2.5]

[[shapes]]
kind = "squre"

[[shapes]]
kind = "square"
rate_hz = 50
when = 2025-01-01
"""
    assert problems(text) == [
        "p.toml:1: seed: is missing; allowed: a whole number",
        "p.toml:1: axis: 'pich' is not allowed; allowed: 'pitch', 'roll', 'yaw' (did you mean 'pitch'?)",
        "p.toml:2: lat_deg: 95 is not allowed; allowed: a number from -89 to 89",
        "p.toml:3: colour: unknown key; known: seed, axis, lat_deg, on, shape, shapes, named, share",
        "p.toml:7: shape.radius_m: -1.5 is not allowed; allowed: a number above 0",
        "p.toml:8: shape.weights[1]: 'x' is text; allowed: a number",
        "p.toml:9: shape.place_m: has 2 entries; allowed: a list of 3 numbers",
        "p.toml:10: shape.steps[0]: '1' is text; allowed: a whole number",
        "p.toml:10: shape.steps[1]: 2.5 is a number; allowed: a whole number",
        "p.toml:13: shapes[0].kind: 'squre' is not allowed; allowed: 'round', 'square' (did you mean 'square'?)",
        (
            "p.toml:17: shapes[1].rate_hz: 50 is not allowed; allowed: a whole number from 60 to 480, "
            "that is a multiple of 60"
        ),
        "p.toml:18: shapes[1].when: 2025-01-01 is not allowed; allowed: a date and time such as 2025-03-13T06:00:00Z",
    ]


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("seed = 1\nshape.radius = 2", "p.toml:2: shape.kind: is missing; allowed: 'round', 'square'"),
        (
            'seed = 1\nshape = { kind = "round", radius = 2 }',
            (
                "p.toml:2: shape.radius: unknown key (did you mean 'radius_m'?); "
                "known: kind, radius_m, weights, place_m, steps"
            ),
        ),
        (
            "seed = 1\nradius_m = 3",
            (
                "p.toml:2: radius_m: unknown key (did you mean 'shape.radius_m'?); "
                "known: seed, axis, lat_deg, on, shape, shapes, named, share"
            ),
        ),
        ("seed = true", "p.toml:1: seed: true is not allowed; allowed: a whole number"),
        ("seed = 1\nlat_deg = nan", "p.toml:2: lat_deg: nan is not allowed; allowed: a number from -89 to 89"),
        ("seed = 1\nlat_deg = inf", "p.toml:2: lat_deg: inf is not allowed; allowed: a number from -89 to 89"),
        ('seed = 1\non = "yes"', "p.toml:2: on: 'yes' is text; allowed: true or false"),
        (
            "seed = 1\nshape = 3",
            "p.toml:2: shape: 3 is a whole number; allowed: a table with kind = 'round' or 'square'",
        ),
        ("seed = 1\nshapes = {}", "p.toml:2: shapes: is a table; allowed: a list of tables"),
        (
            'seed = 1\n[shape]\nkind = "square"\nside_m = "x"',
            "p.toml:4: shape.side_m: 'x' is text; allowed: a number",
        ),
        (
            'seed = 1\n[shape]\nkind = "square"\neither = ["s"]',
            "p.toml:4: shape.either[0]: 's' is text; allowed: a number",
        ),
        (
            'seed = 1\n[shape]\nkind = "square"\neither = "s"',
            "p.toml:4: shape.either: 's' is not allowed; allowed: a number or a list of numbers",
        ),
        (
            'seed = 1\n[shape]\nkind = "round"\nweights = "x"',
            "p.toml:4: shape.weights: 'x' is text; allowed: a number or a list of one or more numbers",
        ),
        (
            'seed = 1\n[shape]\nkind = "round"\nweights = []',
            "p.toml:4: shape.weights: has 0 entries; allowed: a number or a list of one or more numbers",
        ),
        (
            "seed = 1\n[named.Big]\nradius_m = 1",
            (
                "p.toml:2: named.Big: unknown name; allowed: lower-case letters, digits and _, a letter first, "
                "at most 40 characters"
            ),
        ),
        (
            "seed = 1\n[share]\nfrist = 1.0",
            "p.toml:3: share.frist: unknown name; allowed: 'first', 'second' (did you mean 'first'?)",
        ),
        (f"seed = {'9' * 30}e1", "p.toml:1: seed: 1e+31 is a number; allowed: a whole number"),
        (
            'seed = 1\n"odd key" = 2',
            'p.toml:2: "odd key": unknown key; known: seed, axis, lat_deg, on, shape, shapes, named, share',
        ),
    ],
)
def test_one_mistake_reads_well(text, line):
    assert problems(text) == [line]


def test_hexadecimal_monsters_do_not_break_the_message():
    (line,) = problems("seed = 1\nlat_deg = 0x" + "f" * 5000)
    assert line.startswith("p.toml:2: lat_deg: a whole number of more than 18 digits is ")


def test_a_validator_may_name_several_keys():
    text = "low = 2\nhigh = 1\n[[parts]]\nradius_m = 3\n"
    assert problems(text, Pair) == [
        "p.toml:1: is upside down",
        "p.toml:2: high: is below low",
        "p.toml:4: parts[0].radius_m: is odd",
    ]


def test_checks_of_several_keys_show_beside_unknown_keys():
    found = problems("low = 2\nhigh = 1\nodd = 1\n[[parts]]\nradius_m = 3\n", Pair)
    assert "p.toml:3: odd: unknown key; known: low, high, parts" in found
    assert "p.toml:2: high: is below low" in found


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("a = 1\nb =\n", "p.toml:2: is not TOML: Invalid value (column 4)"),
        ("a = 1\na = 2\nb = 3", "p.toml:2: is not TOML: A key is given twice (column 6)"),
        ('a = "x\nb = 1', "p.toml:1: is not TOML: Illegal character '\\n' (column 7)"),
        ("a = [1,", "p.toml:1: is not TOML: Invalid value at the end of the file"),
        ("a = " + "[" * 100_000, "p.toml:1: is not TOML: Lists or tables are nested too deep at the end of the file"),
        ("\na = " + "9" * 5000, "p.toml:2: is not TOML: A number is too long (column 5)"),
        (".".join("a" * 3000) + " = 1", "p.toml:1: is not TOML: A key has more than 40 dotted parts (column 1)"),
    ],
)
def test_text_that_is_no_toml(text, line):
    assert problems(text) == [line]


def test_a_megabyte_of_one_word_is_read_fast():
    assert problems(f"seed = 1\ntext = '{'a' * 990_000}'")[0].startswith("p.toml:2: text: unknown key")


def test_overrides_lie_over_the_file():
    plan = config.load(
        '[[shapes]]\nkind = "round"\n[[shapes]]\nkind = "square"\nseed = 1\n'.replace("seed = 1\n", ""),
        Plan,
        overrides=[
            "seed=5",
            "shapes[1].rate_hz = 240",
            "shapes[0].weights=[1, 2]",
            "axis=yaw",
            'shape.kind="square"',
            "on=false",
        ],
    )
    assert plan.seed == 5
    assert plan.shapes[1].rate_hz == 240
    assert plan.shapes[0].weights == (1.0, 2.0)
    assert (plan.axis, plan.shape.kind, plan.on) == ("yaw", "square", False)


def test_the_last_override_of_a_key_wins():
    assert config.load("seed = 1", Plan, overrides=["seed=2", "seed=3"]).seed == 3


def test_mistakes_of_overrides_name_the_option():
    text = 'seed = 1\naxis = "roll"\n[[shapes]]\nkind = "round"\n'
    overrides = [
        "lat_deg=100",
        "axis=pich",
        "shapes[0].radius_m=-2",
        "shapes[3].radius_m=1",
        "shape.kindd=1",
        "news.today=1",
        "axis.x.y=1",
        "=3",
        "seed",
        "share=4",
    ]
    assert problems(text, overrides=overrides) == [
        "--set =3: is not of the form key.path=value, for example start.alt_m=2500",
        "--set seed: is not of the form key.path=value, for example start.alt_m=2500",
        "--set shapes[3].radius_m: shapes has no element 3; allowed: 0",
        "--set axis.x.y: axis is 'pich', not a table",
        "--set lat_deg: 100 is not allowed; allowed: a number from -89 to 89",
        "--set axis: 'pich' is not allowed; allowed: 'pitch', 'roll', 'yaw' (did you mean 'pitch'?)",
        "--set shapes[0].radius_m: -2 is not allowed; allowed: a number above 0",
        "--set shape.kindd: shape.kind: is missing; allowed: 'round', 'square'",
        "--set news.today: news: unknown key; known: seed, axis, lat_deg, on, shape, shapes, named, share",
        "--set share: 4 is a whole number; allowed: a table",
    ]


def test_an_override_cannot_smuggle_other_keys():
    assert problems("seed = 1", overrides=["axis=1\nseed = 7"]) == [
        "--set axis: '1\\nseed = 7' is not allowed; allowed: 'pitch', 'roll', 'yaw'"
    ]


def test_overrides_and_a_broken_text_are_told_together():
    assert problems("seed = ", overrides=["x"]) == [
        "p.toml:1: is not TOML: Invalid value at the end of the file",
        "--set x: is not of the form key.path=value, for example start.alt_m=2500",
    ]


def test_files_that_cannot_be_read(tmp_path):
    def line(path: object) -> str:
        with pytest.raises(RequestError) as caught:
            config.load(path, Plan)
        return str(caught.value)

    assert line(tmp_path / "no.toml") == f"{tmp_path}/no.toml: there is no such file"
    assert line(tmp_path) == f"{tmp_path}: is a folder, not a TOML file"
    binary = tmp_path / "b.toml"
    binary.write_bytes(b"seed = 1\ntitle = '\xe9'\n")
    assert line(binary) == f"{binary}:2: is not UTF-8 text (byte 0xe9); save the file as UTF-8"
    binary.write_bytes(b"#" * 1_000_001)
    assert line(binary) == f"{binary}: is larger than 1 MB, so it is no settings file"


def test_a_byte_order_mark_and_windows_line_ends_are_read(tmp_path):
    file = tmp_path / "w.toml"
    file.write_bytes(b"\xef\xbb\xbfseed = 1\r\naxis = 'yaw'\r\nlat_deg = 99\r\n")
    with pytest.raises(RequestError, match=r"w\.toml:3: lat_deg"):
        config.load(file, Plan)


def test_very_many_problems_are_cut_short():
    lines = problems("".join(f"k{i} = 1\n" for i in range(3000)))
    assert len(lines) == 101
    assert lines[-1].endswith("more problems")


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


@settings(max_examples=200, deadline=None)
@given(st.text(max_size=60), st.text(max_size=20))
def test_hostile_text_never_gives_anything_but_a_request_error(text, override):
    with suppress(RequestError):
        config.load(text, Plan, overrides=[override])

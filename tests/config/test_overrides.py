"""Settings of the command line and of Python on top of a file."""

from contextlib import suppress
from datetime import UTC, datetime

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magsim import config
from magsim.errors import RequestError
from tests.support.settings import Settings, problems


def test_overrides_lie_over_the_file():
    plan = config.load(
        '[[shapes]]\nkind = "round"\n[[shapes]]\nkind = "square"\nseed = 1\n'.replace("seed = 1\n", ""),
        Settings,
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
    assert config.load("seed = 1", Settings, overrides=["seed=2", "seed=3"]).seed == 3


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


def test_overrides_and_a_broken_text_are_reported_together():
    assert problems("seed = ", overrides=["x"]) == [
        "p.toml:1: is not TOML: Invalid value at the end of the file",
        "--set x: is not of the form key.path=value, for example start.alt_m=2500",
    ]


@settings(max_examples=200, deadline=None)
@given(st.text(max_size=60), st.text(max_size=20))
def test_hostile_text_never_gives_anything_but_a_request_error(text, override):
    with suppress(RequestError):
        config.load(text, Settings, overrides=[override])


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (2, "2"),
        (2500.0, "2500.0"),
        (1e-7, "1e-07"),
        (True, "true"),
        ("roll", "roll"),
        ("./mine", "./mine"),
        ("", ""),
        ("2", '"2"'),
        ("true", '"true"'),
        (" a ", '" a "'),
        ("two\nlines", '"two\\nlines"'),
        ([1, "b"], '[1, "b"]'),
        ((1.0, 2.0), "[1.0, 2.0]"),
        (np.float64(0.5), "0.5"),
        (np.array([1.0, 2.0]), "[1.0, 2.0]"),
        ({"kind": "box", "a b": [1]}, '{kind = "box", "a b" = [1]}'),
        (datetime(2025, 3, 13, 2, tzinfo=UTC), "2025-03-13T02:00:00+00:00"),
    ],
)
def test_python_values_are_written_as_on_the_command_line(value, text):
    assert config.overrides_of({"a.b[0]": value}, name="set") == (f"a.b[0]={text}",)
    read_back = config.value_of(text)
    plain = value.tolist() if isinstance(value, np.ndarray) else list(value) if isinstance(value, tuple) else value
    assert read_back == plain
    assert type(read_back) is type(value.item() if isinstance(value, np.float64) else plain)


_TEXT = st.text(st.characters(exclude_categories=["Cs"]), max_size=8)
_PYTHON = st.recursive(
    st.one_of(st.integers(-(10**20), 10**20), st.booleans(), st.floats(allow_nan=False), _TEXT),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(_TEXT, inner, max_size=3),
    max_leaves=6,
)


@given(_PYTHON)
def test_every_value_is_read_back(value):
    (text,) = config.overrides_of({"key": value}, name="set")
    assert config.value_of(text.partition("=")[2]) == value


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (["seed=2"], "set: is of type list; allowed: a mapping of key paths to values"),
        ("seed=2", "set: is of type str; allowed: a mapping"),
        ({"seed": None}, "set: seed: None is no TOML value; allowed: text, a number, true or false, a date, a list"),
        ({"shape": {"kind": object}}, "set: shape: a value of type type is no TOML value"),
        ({"a=b": 1}, "set: 'a=b' is no key path; allowed: a mapping of key paths"),
        ({"a..b": 1}, "set: 'a..b' is no key path"),
        ({3: 1}, "set: 3 is no key path"),
        ({"n": 10**5000}, "set: n: "),
    ],
)
def test_what_is_no_setting(settings, message):
    with pytest.raises(RequestError) as caught:
        config.overrides_of(settings, name="set")
    assert str(caught.value).startswith(message)


def test_every_wrong_setting_is_reported():
    with pytest.raises(RequestError) as caught:
        config.overrides_of({"": 1, "seed": None}, name="set")
    assert len(str(caught.value).splitlines()) == 2

"""Strict TOML: every mistake in one pass, each with its place and what is allowed."""

import pytest

from magsim import config
from magsim.errors import RequestError
from tests.support.settings import Pair, Settings, problems


def test_a_good_file_becomes_frozen_settings():
    plan = config.load(
        'seed = 3\nshape = { kind = "square", side_m = 2 }\n[[shapes]]\nkind = "round"\nweights = 4', Settings
    )
    assert plan.shape.side_m == 2.0
    assert plan.shapes[0].weights == (4.0,)
    with pytest.raises(ValueError, match="frozen"):
        plan.seed = 4


def test_every_mistake_is_reported_in_one_pass_in_the_order_of_the_file():
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


def test_files_that_cannot_be_read(tmp_path):
    def line(path: object) -> str:
        with pytest.raises(RequestError) as caught:
            config.load(path, Settings)
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
        config.load(file, Settings)


def test_very_many_problems_are_cut_short():
    lines = problems("".join(f"k{i} = 1\n" for i in range(3000)))
    assert len(lines) == 101
    assert lines[-1].endswith("more problems")

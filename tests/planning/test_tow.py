"""Errors of impossible tows: mistakes of the scenario, and those that only the flight finds."""

import re
from pathlib import Path

import pytest

from magsim import cli
from magsim.errors import DataError, RequestError
from magsim.loading import load_scenario
from magsim.simulation import simulate
from tests.support.towed import TEXT


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("s.toml").write_text(TEXT)
    return tmp_path


# ---- what is wrong in a scenario -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            ("settle_s = 20.0", "rope = { length_m = 2.0 }"),
            (
                "s.toml:21: tow.rope: 10 links in 2 m of rope are 0.2 m each; allowed: at least 0.25 m, that is up "
                "to 8 links, or a longer rope"
            ),
        ),
        (
            ("settle_s = 20.0", "rope = { links = 90 }"),
            "s.toml:21: tow.rope.links: 90 is not allowed; allowed: a whole number from 2 to 60",
        ),
        (
            ("settle_s = 20.0", "rope = { length_m = 4.0, links = 60 }"),
            (
                "s.toml:21: tow.rope: 60 links in 4 m of rope are 0.0667 m each; allowed: at least 0.25 m, that is "
                "up to 16 links, or a longer rope"
            ),
        ),
        (
            ('mount = "nose"', 'mount = "keel"'),
            (
                "s.toml:33: sensors.scalar[1].mount: bird has no mount 'keel'; allowed: nose, nose_boom, fluxgate, "
                "attitude_unit, tail_boom"
            ),
        ),
        (
            ('body = "bird"\nmount = "nose"', 'mount = "nose"'),
            (
                "s.toml:32: sensors.scalar[1].mount: helicopter has no mount 'nose'; allowed: nose_boom, "
                "nose_fluxgate, boom_left, boom_right, tail, cabin"
            ),
        ),
        (
            ('[tow]\nbird = "bird"\nsettle_s = 20.0\n', ""),
            (
                "s.toml:29: sensors.scalar[1].body: there is no bird; allowed: with a table [tow]\n"
                "s.toml:34: sensors.scalar[2].body: there is no bird; allowed: with a table [tow]\n"
                "s.toml:39: sensors.fluxgate[0].body: there is no bird; allowed: with a table [tow]\n"
                "s.toml:50: sensors.carrier_ins: without a bird, ins is in the carrier; allowed: with a table [tow]"
            ),
        ),
        (
            ('bird = "bird"\nsettle', 'bird = "brd"\nsettle'),
            (
                "s.toml:20: tow.bird: there is no bird 'brd'; allowed: bird, or a folder of your own by its path "
                "with a slash, such as ./mine (did you mean 'bird'?)"
            ),
        ),
        (
            ("settle_s = 20.0", "step_hz = 45"),
            (
                "s.toml:21: tow.step_hz: 45 is not allowed; allowed: a whole number from 30 to 1920, that is a "
                "multiple of 30"
            ),
        ),
        (
            ("speed_mps = 28.0", "speed_mps = 7.0"),
            "s.toml:9: start.speed_mps: helicopter cannot hold 7 m/s; allowed: 8 to 60",
        ),
        (
            ("settle_s = 20.0", "setle_s = 20.0"),
            (
                "s.toml:21: tow.setle_s: unknown key (did you mean 'settle_s'?); known: bird, rope, body, hook_m, "
                "gusts, settle_s, coupling, step_hz"
            ),
        ),
    ],
)
def test_mistakes_are_reported_with_file_and_line(here: Path, change: tuple[str, str], message: str) -> None:
    assert change[0] in TEXT
    Path("s.toml").write_text(TEXT.replace(*change))
    with pytest.raises(RequestError) as caught:
        load_scenario("s.toml")
    assert str(caught.value) == message


CESSNA = """\
schema = 1
seed = 1
aircraft = "c208b"

[start]
lat_deg = 45.3
lon_deg = -75.7
alt_m = 1000.0
speed_mps = 60.0

[pattern]
kind = "straight"
leg_m = 5000.0

[tow]
bird = "bird"
"""
PITCHING = """
[[pattern.maneuvers]]
axis = "pitch"
amplitude_deg = [2.0, 4.0]
period_s = 5.0
"""
END = """
[[sensors.scalar]]
name = "tail"
mount = "sgl_mag_1"
"""


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            CESSNA.replace("speed_mps = 60.0", "speed_mps = 85.0") + END,
            "s.toml:16: tow.bird: bird is not modeled at start.speed_mps = 85; allowed: 12 to 80",
        ),
        (
            CESSNA + 'coupling = "two_way"\nstep_hz = 240\n' + END,
            "s.toml:18: tow.step_hz: a rope that pulls is stepped with the flight model; allowed: flight.step_hz",
        ),
        (
            # 60 m/s times 4 degrees times 2 pi / 5 s are 0.54 g; 3.7 degrees are 0.497 g, 5.4 s 0.497 g.
            CESSNA + PITCHING.replace("[2.0, 4.0]", "4.0") + END,
            (
                "s.toml:16: tow.bird: pitch maneuvers of 4 deg in 5 s swing the hook by 0.54 g at 60 m/s and whip the "
                "rope; allowed: 0.35 g, up to 2.6 deg in 5 s, or a period of at least 7.7 s"
            ),
        ),
        (
            CESSNA.replace('"c208b"', '"uav"').replace("60.0", "25.0") + END.replace("sgl_mag_1", "tail"),
            "s.toml:15: tow: the file of uav names no hook; allowed: hook_m = [x, y, z], a place in its axes in m",
        ),
    ],
)
def test_what_a_cessna_cannot_tow_is_reported(here: Path, text: str, message: str) -> None:
    Path("s.toml").write_text(text)
    with pytest.raises(RequestError) as caught:
        load_scenario("s.toml")
    assert message in str(caught.value).splitlines()


def test_the_legs_that_are_not_flown_whip_nothing(here: Path) -> None:
    """Only the amplitudes that a leg has count: the second of a list is for a leg that a line does not have."""
    Path("s.toml").write_text(CESSNA + PITCHING + END)
    assert load_scenario("s.toml").scenario.tow is not None


# ---- what only the flight finds --------------------------------------------------------------------------------

SLACK = ("--set", "flight.sway={vertical_m=20.0}")
LIGHT = ("--set", "tow.body={mass_kg=20.0, drag_area_m2=2.0}")


@pytest.mark.parametrize(
    ("args", "code", "error"),
    [
        (
            LIGHT,
            2,
            (
                r"--set tow\.body: tow\.body\.mass_kg: 20 kg are too light for their drag and that of the rope: at "
                r"28 m/s the bird lifts off; allowed: up to 70 deg, that is a shorter or thinner rope\n"
            ),
        ),
        (
            ("--set", "tow.step_hz=30", "--set", "tow.rope={links=60}"),
            2,
            (
                r"--set tow\.step_hz: 30 steps a second bear 54 N in a rope of 60 links, but it was lost at t = "
                r"-\d+\.\d s; allowed: more steps, or fewer links\n"
            ),
        ),
        (
            SLACK,
            3,
            (
                r"the rope went slack at t = -?\d+\.\d s: the hook moved down or turned faster than the bird falls; "
                r"allowed: gentler maneuvers and gusts, less bank, or a heavier bird than 80 kg\n"
            ),
        ),
        (
            ("--set", "start.alt_m=350.0"),
            3,
            (
                r"the bird touched the ground at t = -4\.0 s, 3[12]\d m above the ellipsoid; allowed: a flight above "
                r"the ground, the rope's length included\n"
            ),
        ),
        (
            ("--set", "tow.gusts={speed_mps=10.0, length_m=30.0}"),
            3,
            r"the (air met the bird \d+ deg off its axis|rope went slack) at t = .*; allowed: .*\n",
        ),
        (("-o", "s.toml"), 2, r"s\.toml exists already; --force replaces it\n"),
    ],
)
def test_failures_are_plain_lines_and_leave_nothing(
    here: Path, capsys: pytest.CaptureFixture[str], args: tuple[str, ...], code: int, error: str
) -> None:
    assert cli.main(["generate", "s.toml", "-q", *args]) == code
    output = capsys.readouterr()
    assert re.fullmatch(error, output.err), output.err
    assert output.out == ""
    assert [path.name for path in here.iterdir()] == ["s.toml"]
    assert Path("s.toml").read_text() == TEXT


def test_a_long_rope_reaches_into_the_ground(here: Path) -> None:
    with pytest.raises(DataError, match=r"^the bird touched the ground at t = -4\.0 s, 2\d\d m above the ellipsoid"):
        simulate(load_scenario("s.toml", ["start.alt_m=500.0", "tow.rope.length_m=350.0", "tow.rope.links=20"]))

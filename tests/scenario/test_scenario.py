"""Scenarios: the shipped ones are sound, the wrong ones are told what is wrong."""

import math
import re
import shutil
from pathlib import Path

import pytest

from magsim import assets
from magsim.aircraft import load_aircraft
from magsim.errors import RequestError
from magsim.loading import load_scenario
from magsim.scenario import PatternBase, Scenario, parts_of
from magsim.simulation import simulate
from magsim.units import G0

GOOD = """\
schema = 1
seed = 1
aircraft = "c208b"

[start]
lat_deg = 16.7
lon_deg = 112.7
alt_m = 3000.0
speed_mps = 75.0

[pattern]
kind = "box"

[[pattern.maneuvers]]
axis = "pitch"
amplitude_deg = 5.0

[[sensors.scalar]]
name = "cabin"
mount = "cabin_center"
"""


BARE = GOOD.replace('[[pattern.maneuvers]]\naxis = "pitch"\namplitude_deg = 5.0\n\n', "")


@pytest.fixture
def write(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def put(text: str = GOOD) -> str:
        Path("s.toml").write_text(text)
        return "s.toml"

    return put


def problems(path: str, *overrides: str) -> list[str]:
    with pytest.raises(RequestError) as caught:
        load_scenario(path, overrides)
    return str(caught.value).split("\n")


@pytest.mark.parametrize("name", assets.list_scenarios())
def test_shipped_scenarios_are_sound(name):
    loaded = load_scenario(name)
    pattern, start = loaded.scenario.pattern, loaded.scenario.start
    assert loaded.name == Path(name).name
    assert loaded.text == (assets.ROOT / "scenarios" / f"{name}.toml").read_text()
    for part in (part for part in parts_of(pattern) if isinstance(part, PatternBase)):
        crew = (-0.3, 2.3) if part.allow_beyond_crew_g else (0.2, 1.8)
        for leg in range(part.legs * part.circuits):
            for swing in (swing for train in part.maneuvers for swing in train.swings):
                assert 2.5 <= swing.amplitude(leg) <= 15.0
                if swing.axis == "pitch":
                    rate = math.radians(swing.amplitude(leg)) * 2 * math.pi / swing.period(leg)
                    load = start.speed_mps * rate / G0
                    assert crew[0] - 1e-9 <= 1.0 - load
                    assert 1.0 + load <= crew[1] + 1e-9


def test_the_calibration_flight_is_that_of_paper_000():
    scenario = load_scenario("calibration_c208b").scenario
    start, pattern = scenario.start, scenario.pattern
    assert (start.lat_deg, start.lon_deg, start.alt_m, start.speed_mps) == (16.720, 112.729, 3000.0, 75.0)
    assert (pattern.kind, pattern.circuits, pattern.leg_m) == ("box", 2, 10_000.0)
    assert {train.axis for train in pattern.maneuvers} == {"pitch", "roll", "yaw"}
    assert scenario.recording.rate_hz == 10
    scalar, fluxgate = scenario.sensors.scalar[0], scenario.sensors.fluxgate[0]
    assert scalar.mount == "cabin_center"
    assert fluxgate.mount != scalar.mount
    for train in pattern.maneuvers:
        first = [train.amplitude(leg) for leg in range(4)]
        assert first != [train.amplitude(leg) for leg in range(4, 8)]


def test_the_world_of_paper_000_has_its_sources_and_sensors_alone():
    scenario = load_scenario("papers/000_simulated").scenario
    field = scenario.field
    assert (field.permanent.enabled, field.hinged.enabled, field.induced.enabled, field.eddy.enabled) == (
        True,
        False,
        True,
        True,
    )
    assert scenario.sensors.scalar[0].mount == scenario.sensors.fluxgate[0].mount == "cabin_center"
    fluxgate = scenario.sensors.fluxgate[0]
    for vector in (fluxgate.offset_nt, fluxgate.scale_error, fluxgate.nonorthogonality_deg, fluxgate.misalignment_deg):
        assert vector == (0.0, 0.0, 0.0)
    assert scenario.sensors.ins.model_dump() == type(scenario.sensors.ins)().model_dump()
    assert scenario.air.turbulence_severity == 0


def test_the_digest_is_over_the_meaning(write):
    digest = load_scenario(write()).digest
    assert len(digest) == 64
    assert load_scenario(write("# a comment\n" + GOOD.replace("3000.0", "3_000"))).digest == digest
    assert load_scenario(write(GOOD + "[air]\nturbulence_severity = 0\n")).digest == digest
    assert load_scenario(write(GOOD.replace("seed = 1", "seed = 2"))).digest != digest
    assert load_scenario(write(), ["seed=2"]).digest != digest


def test_every_mistake_in_one_pass_aircraft_limits_included(write):
    text = (
        GOOD.replace("3000.0", "9000.0")
        .replace("75.0", "300.0")
        .replace("= 5.0", "= [5.0, 50.0]")
        .replace('"cabin_center"', '"nose"')
        .replace("[pattern]", "wind = 3\n[pattern]")
    )
    mounts = ", ".join(load_scenario("calibration_c208b").aircraft.mounts)
    assert problems(write(text)) == [
        "s.toml:8: start.alt_m: 9000 m is above the ceiling of c208b; allowed: up to 7620",
        "s.toml:9: start.speed_mps: c208b cannot hold 300 m/s; allowed: 50 to 90",
        (
            "s.toml:11: start.wind: unknown key; "
            "known: lat_deg, lon_deg, alt_m, speed_mps, heading_deg, flap_deg, time_utc"
        ),
        (
            "s.toml:17: pattern.maneuvers[0].amplitude_deg: 50 deg is no pitch amplitude for c208b; "
            "allowed: above 0, up to 15"
        ),
        f"s.toml:21: sensors.scalar[0].mount: c208b has no mount 'nose'; allowed: {mounts}",
    ]


def test_an_unknown_aircraft_is_told_with_everything_else(write):
    text = GOOD.replace('"c208b"', '"c208"').replace("seed = 1", "seed = -1")
    first, second = problems(write(text))
    assert first == "s.toml:2: seed: -1 is not allowed; allowed: a whole number of 0 or more, below 9223372036854775808"
    known = ", ".join(assets.list_aircraft())
    own = "or a folder of your own by its path with a slash, such as ./mine"
    assert second == f"s.toml:3: aircraft: there is no aircraft 'c208'; allowed: {known}, {own} (did you mean 'c208b'?)"


@pytest.fixture
def own(write, tmp_path):
    """A folder of a user's own beside the scenario; the scenario that flies it."""
    shutil.copytree(assets.aircraft_dir("c208b"), tmp_path / "mine")
    return write(GOOD.replace('"c208b"', '"./mine"'))


def test_an_own_aircraft_lies_where_the_scenario_does(own, tmp_path, monkeypatch):
    loaded = load_scenario(own)
    assert (loaded.aircraft.name, loaded.scenario.aircraft) == ("mine", "mine")
    assert loaded.aircraft.digest == load_aircraft("c208b").digest
    monkeypatch.chdir(tmp_path / "mine")
    assert load_scenario("../s.toml").digest == loaded.digest
    # typed at the command line, a path begins in the working folder
    assert load_scenario("calibration_c208b", ["aircraft=../mine"]).aircraft.name == "mine"
    # where the folder lies does not count, what its files say does
    (tmp_path / "away").mkdir()
    shutil.move(tmp_path / "mine", tmp_path / "away" / "mine")
    monkeypatch.chdir(tmp_path)
    assert load_scenario(own, ["aircraft=away/mine"]).digest == loaded.digest
    with (tmp_path / "away" / "mine" / "magnetics.toml").open("a") as file:
        file.write("# heavier\n")
    assert load_scenario(own, ["aircraft=away/mine"]).digest != loaded.digest


def test_what_is_wrong_with_an_own_aircraft_is_told_with_everything_else(own):
    path = Path("mine/magnetics.toml")
    path.write_text(re.sub(r"mu_r = [\d.]+", "mu_r = 0.5", path.read_text(), count=1))
    Path("mine/facts.toml").unlink()
    (line,) = problems(own)
    assert line.startswith("s.toml:3: aircraft: mine: has no facts.toml; allowed: a folder with ")
    Path("mine/facts.toml").write_text("wings = 3\n")
    seed, *lines = problems(own, "seed=-1")[::-1]
    assert seed.startswith("--set seed: -1 is not allowed")
    assert all(line.startswith("s.toml:3: aircraft: mine/") for line in lines)
    assert any(re.search(r"magnetics.toml:\d+: steel\[0\].mu_r: 0.5 is not allowed; allowed: a num", s) for s in lines)
    assert any("facts.toml:1: wings: unknown key" in line for line in lines)


def test_an_aircraft_flies_instead_of_the_one_that_a_scenario_names():
    drone = load_aircraft("uav")
    loaded = load_scenario("papers/001_fom", aircraft=drone)
    assert loaded.aircraft is drone
    assert loaded.digest == load_scenario("papers/001_fom").digest
    with pytest.raises(RequestError, match="uav cannot hold"):
        load_scenario("calibration_c208b", aircraft=drone)


def test_maneuvers_must_fit_into_their_leg(write):
    (line,) = problems(write(), "pattern.leg_m=1000")
    assert line == (
        "s.toml:14: pattern.maneuvers: leg 1 needs 39 s for its maneuvers, but a leg of 1000 m takes 13 s at 75 m/s; "
        "allowed: leg_m of at least 2930, or shorter trains"
    )


def test_loads_are_checked_on_every_leg(write):
    text = GOOD.replace("= 5.0", "= [5.0, 15.0]\nperiod_s = 4.0")
    (line,) = problems(write(text))
    swing = 75.0 * math.radians(15.0) * 2.0 * math.pi / 4.0 / 9.80665
    assert line.startswith(
        f"s.toml:16: pattern.maneuvers[0].amplitude_deg: 15 deg of pitch in 4 s swings from {1 - swing:.2f} to "
        f"{1 + swing:.2f} g at 75 m/s; allowed for c208b: -1.52 to 3.8 g"
    )


def test_what_no_crew_flies_must_be_allowed(write):
    text = GOOD.replace("= 5.0", "= 5.0\nperiod_s = 5.0")
    (line,) = problems(write(text))
    assert line == (
        "s.toml:16: pattern.maneuvers[0].amplitude_deg: 5 deg of pitch in 5 s swings from 0.16 to 1.84 g at 75 m/s; "
        "allowed for a crew: 0.2 to 1.8 g (a period of at least 5.3 s, a smaller amplitude, or allow_beyond_crew_g = "
        "true)"
    )
    # V A 2 pi / T = 0.8 g is 5.24 s: the period that is named is allowed, one a tenth below it is not.
    load_scenario(write(), ["pattern.maneuvers[0].period_s=5.3"])
    assert problems("s.toml", "pattern.maneuvers[0].period_s=5.2")
    load_scenario("s.toml", ["pattern.maneuvers[0].period_s=5", "pattern.allow_beyond_crew_g=true"])


def test_the_legs_that_are_named_are_long_enough(write):
    needed = "leg_m of at least 2930"
    assert needed in problems(write(), "pattern.leg_m=1000")[0]
    load_scenario(write(), ["pattern.leg_m=2930"])
    assert problems("s.toml", "pattern.leg_m=2910")
    (line,) = problems("s.toml", "pattern.kind=cloverleaf", "pattern.leaf_m=3000", "pattern.maneuvers[0].cycles=12")
    leaf = float(line.split("leaf_m of at least ")[1].split(",")[0])
    overrides = ["pattern.kind=cloverleaf", "pattern.maneuvers[0].cycles=12"]
    load_scenario("s.toml", [*overrides, f"pattern.leaf_m={leaf}"])
    assert problems("s.toml", *overrides, f"pattern.leaf_m={leaf - 20.0}")


@pytest.mark.parametrize("leaf_m", [500.0, 2000.0, 3000.0])
def test_the_leaf_that_is_named_is_the_shortest(write, leaf_m):
    # How many trains fit before the center depends on the length, so a length that is enough need not be the shortest.
    text = GOOD.replace("amplitude_deg = 5.0", "amplitude_deg = 5.0\nperiod_s = 8.0")
    train = '[[pattern.maneuvers]]\naxis = "roll"\namplitude_deg = 8.0\nperiod_s = 5.0\n\n'
    write(text.replace("[[sensors", train + train.replace("roll", "yaw") + "[[sensors"))
    (line,) = problems("s.toml", "pattern.kind=cloverleaf", f"pattern.leaf_m={leaf_m}")
    leaf = float(line.split("leaf_m of at least ")[1].split(",")[0])
    load_scenario("s.toml", ["pattern.kind=cloverleaf", f"pattern.leaf_m={leaf}"])
    assert problems("s.toml", "pattern.kind=cloverleaf", f"pattern.leaf_m={leaf - 5.0}")


@pytest.mark.parametrize(
    ("kind", "heading", "allowed"),
    [("fom", 45.0, "0, 90, 180, 270"), ("fom_peak_to_peak", 1.0, "0, 90"), ("diamond", 0.0, "45, 135, 225, 315")],
)
def test_patterns_of_named_headings_have_them(write, kind, heading, allowed):
    text = BARE.replace('"box"', f'"{kind}"')
    (line,) = problems(write(text), f"start.heading_deg={heading}")
    assert f"the first leg of a {kind} cannot have the course {heading:g} deg" in line
    assert f"allowed: {allowed}" in line


def test_the_two_readings_of_the_figure_of_merit(write):
    box = load_scenario(write(BARE.replace('"box"', '"fom"'))).scenario.pattern
    half = load_scenario(write(BARE.replace('"box"', '"fom_peak_to_peak"'))).scenario.pattern
    assert [(t.axis, t.amplitude_deg, t.cycles, t.period_s) for t in box.maneuvers] == [
        ("roll", (10.0,), 3, (10.0,)),
        ("pitch", (5.0,), 3, (10.0,)),
        ("yaw", (5.0,), 3, (10.0,)),
    ]
    assert [(t.axis, t.amplitude_deg) for t in half.maneuvers] == [("roll", (5.0,)), ("pitch", (2.5,)), ("yaw", (2.5,))]
    (line,) = problems("s.toml", "pattern.kind=fom", "pattern.pitch_deg=40")
    assert "40 deg is no pitch amplitude for c208b; allowed: above 0, up to 15" in line
    (line,) = problems("s.toml", "pattern.kind=fom", "pattern.period_s=5")
    assert "pattern.pitch_deg: 5 deg of pitch in 5 s" in line


def test_parts_of_a_sequence_are_checked_each(write):
    text = BARE.replace(
        '[pattern]\nkind = "box"',
        """[pattern]
kind = "sequence"
[[pattern.parts]]
kind = "box"
[[pattern.parts]]
kind = "diamond"
heading_deg = 45.0
leg_m = 1000.0
[[pattern.parts.maneuvers]]
axis = "roll"
amplitude_deg = 10.0""",
    )
    (line,) = problems(write(text), "pattern.parts[0].turn=up")
    assert line == "--set pattern.parts[0].turn: 'up' is not allowed; allowed: 'right', 'left'"
    (line,) = problems("s.toml")
    assert line.startswith("s.toml:19: pattern.parts[1].maneuvers: leg 1 needs 39 s for its maneuvers")
    pattern = load_scenario("s.toml", ["pattern.parts[1].leg_m=5000"]).scenario.pattern
    assert (pattern.circuits, pattern.legs, len(parts_of(pattern))) == (2, 4, 2)


def test_checks_of_the_pattern_do_not_wait_for_the_sensors(write):
    found = problems(write(GOOD.replace('"cabin_center"', "3")), "pattern.leg_m=1000")
    assert [line.split(": ")[0] for line in found] == ["s.toml:14", "s.toml:20"]


@pytest.mark.parametrize(
    ("override", "text"),
    [
        ("recording.train_circuits=[1, 3]", "recording.train_circuits[1]: 3 is not flown; allowed: 1 to 1"),
        ("recording.valid_legs=[0]", "recording.valid_legs[0]: 0 is not flown; allowed: 1 to 4"),
        (
            "recording.rate_hz=7",
            "recording.rate_hz: 7 does not divide flight.step_hz = 120; allowed: a divisor",
        ),
        ("start.alt_m=-5", "--set start.alt_m: -5 is not allowed; allowed: a number above 0"),
        ("start.time_utc=2031-01-01T00:00:00Z", "IGRF-14 does not cover the year 2031; allowed: 1900 to 2029"),
        ("flight.log_hz=50", "50 is not a multiple of 10 that divides step_hz = 120"),
        ("pattern.maneuvers[0].period_s=1", "1 s is no maneuver period; allowed: 3 to 30"),
        ("sensors.scalar=[]", "--set sensors.scalar: has 0 entries; allowed: a list of one or more tables"),
        ("sensors.scalar[0].name=Cabin", "'Cabin' is not allowed; allowed: lower-case letters, digits and _"),
        ("air.turbulence_severity=8", "8 is not allowed; allowed: a whole number from 0 to 7"),
    ],
)
def test_impossible_values(write, override, text):
    (line,) = problems(write(), override)
    assert text in line


GUST = "{ at_s = 9.0, duration_s = 5.0, north_mps = 18.0 }"


@pytest.mark.parametrize(
    ("air", "text"),
    [
        (
            "wind_north_mps = 60.0\nwind_east_mps = -45.0\n",
            "air.wind_north_mps: a wind of 75 m/s is no slower than the airspeed of 75 m/s; allowed: together less",
        ),
        (
            'wind_east_mps = 70.0\n[air.shear]\nkind = "linear"\neast_per_s = 0.05\n',
            "air.shear: a wind that shear brings to 80.0 m/s at 3200 m is no slower than the airspeed of 75 m/s",
        ),
        (
            f"wind_east_mps = 40.0\ngusts = [{GUST}, {GUST.replace('9.0', '12.0')}]\n",
            "air.gusts: a wind of 40.0 m/s with gusts of 36.0 m/s is no slower than the airspeed of 75 m/s",
        ),
        (
            "wind_east_mps = -50.0\n[air.random_gusts]\nevery_s = 10.0\nspeed_mps = 30.0\n",
            "air.random_gusts: a wind of 50.0 m/s with gusts of 30.0 m/s is no slower than the airspeed of 75 m/s",
        ),
        (
            "[air.random_gusts]\nevery_s = 10.0\nspeed_mps = 3.0\nshortest_s = 5.0\nlongest_s = 4.0\n",
            "air.random_gusts.longest_s: 4 s is shorter than shortest_s; allowed: 5 or more",
        ),
        ('[air.shear]\nkind = "cubic"\n', "air.shear.kind: 'cubic' is not allowed; allowed: 'linear', 'log'"),
        ('turbulence_model = "karman"\n', "air.turbulence_model"),
        ("[[air.gusts]]\nat_s = 0.0\nduration_s = 5.0\n", "air.gusts[0].at_s: 0 is not allowed"),
    ],
)
def test_impossible_air(write, air, text):
    (line,) = problems(write(f"{GOOD}[air]\n{air}"))
    assert text in line


def test_gusts_that_do_not_meet_are_not_added(write):
    apart = "[[air.gusts]]\nat_s = 10.0\nduration_s = 2.0\neast_mps = 30.0\n"
    air = f"[air]\nwind_east_mps = 40.0\n{apart}{apart.replace('10.0', '12.0')}"
    loaded = load_scenario(write(GOOD + air))
    assert loaded.scenario.air.strongest_gust_mps() == 30.0


def test_the_kind_of_the_ground_is_told(write):
    (line,) = problems(write(GOOD + '\n[terrain]\nkind = "flatt"\n'))
    assert line.endswith("'flatt' is not allowed; allowed: 'flat', 'fractal', 'grid' (did you mean 'flat'?)")
    (line,) = problems(write(GOOD + '\n[terrain]\nkind = "flat"\nmean_m = 5.0\n'))
    assert line == "s.toml:24: terrain.mean_m: unknown key; known: geoid_m, kind, height_m"
    missing, unknown = problems(write(GOOD + '\n[terrain]\nkind = "grid"\nmeters = 5.0\n'))
    assert missing.startswith("s.toml:22: terrain.file: is missing; allowed: text, not empty (ESRI ASCII grid")
    assert unknown.startswith("s.toml:24: terrain.meters: unknown key; known: geoid_m, kind, file")


def test_what_only_the_flight_finds_is_placed_too(write):
    loaded = load_scenario(write(), ["start.speed_mps=51", "start.alt_m=7000"])
    assert loaded.placed("pattern.maneuvers[0].axis: no") == "s.toml:15: pattern.maneuvers[0].axis: no"
    assert loaded.placed("start.speed_mps: no") == "--set start.speed_mps: no"
    assert loaded.placed("flight.flaps[0].leg: no") == "flight.flaps[0].leg: no"
    assert loaded.placed("aircraft c208b: no") == "aircraft c208b: no"
    with pytest.raises(
        RequestError, match=r"^--set start.speed_mps: .* no straight and level flight at 51 m/s and 7000"
    ):
        simulate(loaded)


def test_names_of_sensors_differ(write):
    text = GOOD + '[[sensors.fluxgate]]\nname = "cabin"\nmount = "cabin_center"\n'
    (line,) = problems(write(text))
    assert "sensor names must differ, used twice: cabin" in line


def test_overrides_are_part_of_the_provenance(write):
    loaded = load_scenario(write(), ["start.alt_m=2500", "pattern.maneuvers[0].axis=roll"])
    assert loaded.scenario.start.alt_m == 2500.0
    assert loaded.overrides == ("start.alt_m=2500", "pattern.maneuvers[0].axis=roll")
    assert loaded.text == GOOD


def test_the_json_schema_knows_every_key_and_its_limits():
    schema = Scenario.model_json_schema()
    start = schema["$defs"]["Start"]["properties"]
    assert (start["lat_deg"]["minimum"], start["lat_deg"]["maximum"]) == (-90.0, 90.0)
    assert set(schema["required"]) == {"schema", "seed", "aircraft", "start", "pattern", "sensors"}
    train = schema["$defs"]["Train"]["properties"]
    assert {"type": "number"} in train["amplitude_deg"]["anyOf"]


def test_skin_is_asked_of_an_aircraft_that_has_none() -> None:
    with pytest.raises(RequestError, match=r"uav has no \[skin\] in its magnetics.toml; allowed: 'coils'"):
        load_scenario("papers/001_fom", overrides=['field.eddy.model="skin"'])
    assert load_scenario("papers/000_simulated").scenario.field.eddy.model == "coils"

"""Scenarios: the shipped ones are sound, the wrong ones are told what is wrong."""

import math
from pathlib import Path

import pytest

from magsim import assets
from magsim.errors import RequestError
from magsim.scenario import Scenario, load_scenario
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
    legs = 4 * pattern.circuits
    for leg in range(legs):
        for train in pattern.maneuvers:
            assert 5.0 <= train.amplitude(leg) <= 15.0
            if train.axis == "pitch":
                swing = start.speed_mps * math.radians(train.amplitude(leg)) * 2 * math.pi / train.period(leg) / G0
                assert 1.0 + swing <= 2.3
                assert 1.0 - swing >= -0.3


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
        "s.toml:11: start.wind: unknown key; known: lat_deg, lon_deg, alt_m, speed_mps, heading_deg, time_utc",
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
    assert second == f"s.toml:3: aircraft: there is no aircraft 'c208'; allowed: {known} (did you mean 'c208b'?)"


def test_maneuvers_must_fit_into_their_leg(write):
    (line,) = problems(write(), "pattern.leg_m=1000")
    assert line == (
        "s.toml:14: pattern.maneuvers: leg 1 needs 39 s for its maneuvers, but a leg of 1000 m takes 13 s at 75 m/s; "
        "allowed: shorter trains or longer legs"
    )


def test_loads_are_checked_on_every_leg(write):
    text = GOOD.replace("= 5.0", "= [5.0, 15.0]\nperiod_s = 4.0")
    (line,) = problems(write(text))
    swing = 75.0 * math.radians(15.0) * 2.0 * math.pi / 4.0 / 9.80665
    assert line.startswith(
        f"s.toml:16: pattern.maneuvers[0].amplitude_deg: 15 deg of pitch in 4 s swings from {1 - swing:.2f} to "
        f"{1 + swing:.2f} g at 75 m/s; allowed for c208b: -1.52 to 3.8 g"
    )


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
        ('[air.shear]\nkind = "cubic"\n', "air.shear.kind"),
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

"""Scenarios: the shipped ones are sound, and wrong values are reported."""

import math
from pathlib import Path

import pytest

from magsim import assets
from magsim.errors import RequestError
from magsim.loading import load_scenario
from magsim.scenario import PatternBase, Scenario, parts_of
from magsim.units import G0
from tests.support.scenarios import BARE, GOOD, problems


@pytest.mark.parametrize("name", assets.list_scenarios())
def test_shipped_scenarios_are_sound(name):
    loaded = load_scenario(name)
    pattern, start = loaded.scenario.pattern, loaded.scenario.start
    assert loaded.name == Path(name).name
    assert loaded.text == (assets.ROOT / "scenarios" / f"{name}.toml").read_text()
    for part in (part for part in parts_of(pattern) if isinstance(part, PatternBase)):
        crew = (-0.3, 2.3) if part.allow_beyond_crew_g else (0.2, 1.8)
        # nobody is aboard a drone
        most_deg = 20.0 if loaded.scenario.aircraft == "uav" else 15.0
        for leg in range(part.legs * part.circuits):
            for swing in (swing for train in part.maneuvers for swing in train.swings):
                assert 2.5 <= swing.amplitude(leg) <= most_deg
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


def test_the_calm_twin_is_the_calibration_flight_in_still_air():
    light, calm = (load_scenario(f"calibration_c208b{end}").scenario.model_dump() for end in ("", "_calm"))
    assert 0.5 <= light["air"]["turbulence_mps"] <= 1.0
    light["title"] = calm["title"]
    light["air"]["turbulence_mps"] = 0.0
    light["field"]["earth"]["departure"]["enabled"] = False
    assert light == calm


@pytest.mark.parametrize(
    "name",
    ["calibration_c208b_cloverleaf", "electronics_c208b", "geology_c208b", "patterns/survey", "patterns/drape"],
)
def test_surveys_and_calibrations_are_flown_in_light_air(name):
    air = load_scenario(name).scenario.air
    assert 0.5 <= air.turbulence_mps <= 1.0


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
    assert (scenario.air.turbulence_severity, scenario.air.turbulence_mps) == (0, 0.0)


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


def test_the_kind_of_the_ground_is_reported(write):
    (line,) = problems(write(GOOD + '\n[terrain]\nkind = "flatt"\n'))
    assert line.endswith("'flatt' is not allowed; allowed: 'flat', 'fractal', 'grid' (did you mean 'flat'?)")
    (line,) = problems(write(GOOD + '\n[terrain]\nkind = "flat"\nmean_m = 5.0\n'))
    assert line == "s.toml:24: terrain.mean_m: unknown key; known: geoid_m, kind, height_m"
    missing, unknown = problems(write(GOOD + '\n[terrain]\nkind = "grid"\nmeters = 5.0\n'))
    assert missing.startswith("s.toml:22: terrain.file: is missing; allowed: text, not empty (ESRI ASCII grid")
    assert unknown.startswith("s.toml:24: terrain.meters: unknown key; known: geoid_m, kind, file")


def test_names_of_sensors_differ(write):
    text = GOOD + '[[sensors.fluxgate]]\nname = "cabin"\nmount = "cabin_center"\n'
    (line,) = problems(write(text))
    assert "sensor names must differ, used twice: cabin" in line


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


@pytest.mark.parametrize(("part", "what"), [("flex", "mount with flex"), ("suspension", "part with a suspension")])
def test_what_moves_on_no_such_aircraft_is_refused(part, what):
    """The helicopter and its bird have neither; the Cessna has both."""
    setting = f"field.{part}.enabled=true"
    assert getattr(load_scenario("calibration_c208b", [setting]).scenario.field, part).enabled
    message = (
        rf"^--set field\.{part}\.enabled: there is no {what} in the magnetics.toml of helicopter and bird; allowed: "
    )
    with pytest.raises(RequestError, match=message + "false$"):
        load_scenario("papers/002_straight", [setting])


def test_steel_of_the_controls_is_refused_on_the_drone():
    message = r"controls\.enabled: there is no \[\[controls\]\] in the magnetics.toml of uav; allowed: false"
    with pytest.raises(RequestError, match=message):
        load_scenario("papers/001_fom", ["field.controls.enabled=true"])


@pytest.mark.parametrize("setting", ["scale=2.0", "seed=3"])
def test_a_departure_along_no_path_is_refused(setting):
    key = setting.split("=")[0]
    message = rf"^--set field\.earth\.departure\.{key}: [23] has no effect with along_path = false; allowed: "
    with pytest.raises(RequestError, match=message):
        load_scenario("calibration_c208b", ["field.earth.along_path=false", f"field.earth.departure.{setting}"])


@pytest.mark.parametrize(
    ("key", "wrong", "sound", "message"),
    [
        ("fluxgate[0].flexure_deg_g", 200.0, 0.3, r"more than an airframe bends; allowed: -10 to 10 on each axis"),
        ("ins.lever_error_m", 1000.0, 0.1, r"off the hull; allowed: -31.74 to 31.74 m on each axis"),
    ],
)
def test_absurd_vectors_of_instruments_are_refused(key, wrong, sound, message):
    load_scenario("calibration_c208b", [f"sensors.{key}=[0.0, {sound}, 0.0]"])
    with pytest.raises(RequestError, match=message):
        load_scenario("calibration_c208b", [f"sensors.{key}=[0.0, {wrong}, 0.0]"])


def test_maneuvers_are_stated_in_one_way():
    """On the command line one way takes the place of the other in the file."""
    crew = load_scenario("crew_c208b").scenario.pattern.maneuvers
    assert load_scenario("calibration_c208b", ["pattern.preset=crew"]).scenario.pattern.maneuvers == crew
    own = "pattern.maneuvers=[{axis='roll', amplitude_deg=5.0}]"
    (train,) = load_scenario("crew_c208b", [own]).scenario.pattern.maneuvers
    assert train.axis == "roll"
    assert len(load_scenario("crew_c208b", ["day=2"]).scenario.pattern.maneuvers) == 3  # checked again with the day's
    message = r"pattern\.maneuvers: preset = 'crew' states the maneuvers too; allowed: one of the two$"
    with pytest.raises(RequestError, match=message):
        load_scenario("crew_c208b", [own, "pattern.preset=crew"])

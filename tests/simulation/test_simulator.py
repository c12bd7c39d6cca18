"""Simulations that share a flight or a field give the same bytes as each alone; what they share is flown once."""

import copy
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from magsim.aircraft import load_aircraft
from magsim.errors import DataError
from magsim.field.background import crust, departure, main_field
from magsim.flight import fly
from magsim.loading import LoadedScenario, load_scenario
from magsim.recording import Recording
from magsim.scenario import Scenario
from magsim.simulation import Simulator, simulate, simulator
from magsim.simulation.dependence import FieldInputs, FlightInputs
from magsim.trajectory import Flight

TEXT = """\
schema = 1
seed = 1
aircraft = "helicopter"
[start]
lat_deg = 16.7
lon_deg = 112.7
alt_m = 200.0
speed_mps = 40.0
[terrain]
kind = "flat"
[air]
wind_north_mps = 0.0
wind_east_mps = 0.0
[pattern]
kind = "straight"
leg_m = 500.0
lead_s = 0.0
[field.crust]
modes = 20
[[sensors.scalar]]
name = "nose"
mount = "nose_boom"
noise_nt_rthz = 0.01
[[sensors.fluxgate]]
name = "flux"
mount = "nose_fluxgate"
[sensors.base]
name = "station"
"""

SPHERE = "kind='sphere',name='ore',north_m=200.0,east_m=0.0,susceptibility=0.1"

OF_THE_FLIGHT = {
    "seed": ("seed=2",),
    "start": ("start.alt_m=220.0", "start.time_utc=2025-06-01T10:00:00Z"),
    "terrain": ("terrain.height_m=20.0",),
    "pattern": ("pattern.leg_m=600.0", "pattern.bank_deg=20.0"),
    "flight": ("flight.log_hz=40",),
    "air": ("air.wind_north_mps=2.0",),
    "recording": ("recording.rate_hz=20",),
}
"""Changes after which it is flown anew."""

OF_THE_FIELD = {
    "individual": ("individual=3",),
    "day": ("day=3",),
    "field": (
        "field.induced.scale=2.0",
        "field.eddy.enabled=false",
        "field.memory.start='demagnetized'",
        "field.earth.departure.seed=3",
        "field.crust.seed=5",
        "field.variation={}",
        f"field.targets=[{{{SPHERE},depth_m=100.0,radius_m=50.0}}]",
    ),
    "sensors": ("sensors.scalar[0].mount='boom_left'",),
    "recording": ("recording.train_circuits=[]",),
}
"""Changes after which the field is computed anew for the same flight; the scenario states the wind of every day."""

OF_THE_INSTRUMENTS = {
    "title": ("title='again'",),
    "sensors": (
        "sensors.seed=7",
        "sensors.scalar[0].noise_nt_rthz=0.1",
        "sensors.scalar[0].name='other'",
        "sensors.fluxgate[0].offset_nt=[1.0, 2.0, 3.0]",
        "sensors.cabin={settled_c=30.0}",
        "sensors.base.height_m=3.0",
        "sensors.radar={}",
    ),
}
"""Changes after which the same field is read anew."""

TEXT_ALONE = {"schema_", "aircraft", "loading", "tow"}
"""Keys that are no matter of a kinematic carrier without a bird."""


@pytest.fixture(scope="module")
def base(tmp_path_factory: pytest.TempPathFactory) -> LoadedScenario:
    path = tmp_path_factory.mktemp("shared") / "line.toml"
    path.write_text(TEXT)
    helicopter = load_aircraft("helicopter")  # with one piece of its steel, which is solved fast
    light = helicopter.magnetics.model_copy(update={"steel": helicopter.magnetics.steel[-1:]})
    return load_scenario(path, aircraft=replace(helicopter, magnetics=light))


@pytest.fixture(scope="module")
def primed(base: LoadedScenario) -> Simulator:
    out = Simulator()
    out.simulate(base)
    return out


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    """How often a simulator flew, and computed a field."""
    count: Counter[str] = Counter()
    for name in ("fly", "compute_field"):
        work = getattr(simulator, name)

        def counting(*args: object, name: str = name, work: object = work, **options: object) -> object:
            count[name] += 1
            return work(*args, **options)

        monkeypatch.setattr(simulator, name, counting)
    return count


def assert_same(one: Recording, other: Recording) -> None:
    assert one.meta == other.meta
    assert one.name == other.name
    assert list(one.data) == list(other.data)
    for name in one.data:
        assert one[name].tobytes() == other[name].tobytes(), name


def changes(table: dict[str, tuple[str, ...]]) -> list[str]:
    return [change for of_key in table.values() for change in of_key]


def test_every_table_of_a_scenario_is_tried():
    tried = {*OF_THE_FLIGHT, *OF_THE_FIELD, *OF_THE_INSTRUMENTS, *TEXT_ALONE}
    assert tried == set(Scenario.model_fields)


@pytest.mark.parametrize("change", changes(OF_THE_FLIGHT))
def test_another_flight_is_flown(base, primed, counted, change):
    shared = copy.deepcopy(primed).simulate(base.changed([change]))
    assert counted == {"fly": 1, "compute_field": 1}
    assert_same(shared, simulate(base.changed([change])))


@pytest.mark.parametrize("change", changes(OF_THE_FIELD))
def test_another_field_is_computed_on_the_same_flight(base, primed, counted, change):
    shared = copy.deepcopy(primed).simulate(base.changed([change]))
    assert counted == {"compute_field": 1}
    assert_same(shared, simulate(base.changed([change])))


@pytest.mark.parametrize("change", changes(OF_THE_INSTRUMENTS))
def test_other_instruments_read_the_same_field(base, primed, counted, change):
    shared = copy.deepcopy(primed).simulate(base.changed([change]))
    assert not counted
    assert_same(shared, simulate(base.changed([change])))


def test_individuals_share_what_does_not_depend_on_places(base, primed, monkeypatch):
    """Main field and its departure are not computed again; the crust is, at mounts that scatter by millimeters."""
    simulator = copy.deepcopy(primed)
    calls: Counter[str] = Counter()
    for module, name in ((main_field, "earth_along"), (departure, "departure_of"), (crust, "crust_of")):
        work = getattr(module, name)

        def counting(*args: object, name: str = name, work: object = work) -> object:
            calls[name] += 1
            return work(*args)

        monkeypatch.setattr(module, name, counting)
    field_e = crust.CrustField.field_e
    asked: list[int] = []
    monkeypatch.setattr(crust.CrustField, "field_e", lambda self, at: (asked.append(len(at)), field_e(self, at))[1])
    simulator.simulate(base.changed(["individual=5"]))
    assert not calls
    assert len(asked) == 2  # two mounts; not the reference point
    simulator.simulate(base.changed(["individual=5", "field.induced.scale=2.0"]))
    assert len(asked) == 2


def test_fields_do_not_depend_on_what_was_asked_for_before(base):
    flight = simulator.fly_inputs(FlightInputs.of(base))
    arms = {"a": np.array([1.0, 0.2, 0.3]), "b": np.array([-2.0, 0.1, 0.0]), "c": np.array([0.5, 0.5, 0.5])}
    first, fresh = (simulator.backgrounds_of(base.scenario, flight, base.ground)["carrier"] for _ in range(2))
    first.at_mounts({"a": arms["a"]})
    first.at_mounts({"b": arms["b"], "c": arms["c"]})
    parts, wanted = first.at_mounts(arms), fresh.at_mounts(arms)
    assert first.center.tobytes() == fresh.center.tobytes()
    assert {name: part.tobytes() for name, part in parts.items()} == {n: p.tobytes() for n, p in wanted.items()}
    there = fresh.at({"b": arms["b"], "far": arms["b"]})
    assert {name: part[1].tobytes() for name, part in wanted.items()} == {n: p[0].tobytes() for n, p in there.items()}


def test_a_simulator_keeps_the_last_alone(base, counted):
    simulator = Simulator()
    for overrides in ((), ("seed=2",), ()):
        simulator.simulate(base.changed(overrides))
    assert counted == {"fly": 3, "compute_field": 3}


def test_a_simulator_goes_on_after_what_cannot_be_flown(base, primed, counted):
    simulator = copy.deepcopy(primed)
    inside = f"field.targets=[{{{SPHERE},depth_m=-100.0,radius_m=120.0}}]"
    with pytest.raises(DataError, match="is inside the sphere 'ore'"):
        simulator.simulate(base.changed([inside]))
    assert_same(simulator.simulate(base), simulate(base))
    assert counted == {"fly": 1, "compute_field": 3}


def flights_equal(one: Flight, other: Flight) -> None:
    assert (one.segments, one.maneuvers, one.notes) == (other.segments, other.maneuvers, other.notes)
    assert (one.duration_s, one.simulation_rate_hz) == (other.duration_s, other.simulation_rate_hz)
    for kind in ("controls", "switches", "rotors"):
        mine, others = getattr(one, kind), getattr(other, kind)
        assert {name: row.tobytes() for name, row in mine.items()} == {name: r.tobytes() for name, r in others.items()}
    for name in ("time_s", "lat_rad", "lon_rad", "alt_m", "velocity_n", "attitude", "rate_b", "reference_b"):
        assert getattr(one.carrier, name).tobytes() == getattr(other.carrier, name).tobytes()


@pytest.mark.parametrize("aircraft", ["c208b", "helicopter"])
def test_a_flight_sees_nothing_but_its_inputs(base, aircraft):
    mount = "cabin_center" if aircraft == "c208b" else "nose_boom"
    overrides = [f"aircraft='{aircraft}'", f"sensors.scalar[0].mount='{mount}'", "sensors.fluxgate=[]"]
    overrides += ["start.speed_mps=75.0", "start.alt_m=1000.0"] if aircraft == "c208b" else []
    loaded = base.changed([*overrides, "individual=2", "title='x'", "recording.train_circuits=[]"])
    whole = fly(loaded.scenario, loaded.aircraft, ground=loaded.ground, track=loaded.track)
    flights_equal(whole, simulator.fly_inputs(FlightInputs.of(loaded)))


def test_keys_count_what_the_aircraft_is(base):
    aircraft = base.aircraft
    heavier = replace(aircraft, facts=aircraft.facts.model_copy(update={"title": "another"}))
    bare = replace(aircraft, magnetics=aircraft.magnetics.model_copy(update={"permanent": ()}))
    flights = [FlightInputs.of(replace(base, aircraft=one)).key for one in (aircraft, heavier, bare)]
    fields = [FieldInputs.of(replace(base, aircraft=one)).key for one in (aircraft, heavier, bare)]
    assert flights[0] == flights[2] != flights[1]
    assert len(set(fields)) == 3


def test_a_day_brings_its_wind_where_none_is_stated(base, tmp_path):
    path = tmp_path / "line.toml"
    path.write_text(TEXT.replace("wind_north_mps = 0.0\nwind_east_mps = 0.0\n", ""))
    keys = {FlightInputs.of(load_scenario(path, [f"day={day}"])).key for day in (0, 1, 2)}
    assert len(keys) == 3


def test_days_share_a_flight_where_load_and_air_are_stated():
    stated = ["loading.payload_kg=500.0", "loading.fuel_kg=500.0", "air.wind_north_mps=0.0", "air.turbulence_mps=0.5"]
    settings = ["individual=3", *stated]
    days = [load_scenario("calibration_c208b", [*settings, f"day={day}"]) for day in (0, 1, 2)]
    assert len({FlightInputs.of(one).key for one in days}) == 1
    assert len({FieldInputs.of(one).key for one in days}) == 3
    for left_out in stated[:2]:
        kept = [setting for setting in settings if setting != left_out]
        keys = {FlightInputs.of(load_scenario("calibration_c208b", [*kept, f"day={day}"])).key for day in (1, 2)}
        assert len(keys) == 2


def test_instruments_of_the_flight_are_read_once(base, primed, monkeypatch):
    shared = copy.deepcopy(primed)
    read = Counter()
    work = simulator.read_of_the_flight
    monkeypatch.setattr(simulator, "read_of_the_flight", lambda flight: (read.update(["flight"]), work(flight))[1])
    for change in ("individual=6", "field.eddy.enabled=false", "sensors.scalar[0].noise_nt_rthz=0.3"):
        shared.simulate(base.changed([change]))
    assert not read
    for change in ("sensors.ins.attitude_noise_deg=0.1", "sensors.seed=9", "sensors.radar={}"):
        assert_same(shared.simulate(base.changed([change])), simulate(base.changed([change])))
    assert read == {"flight": 6}

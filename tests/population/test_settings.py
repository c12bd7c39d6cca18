"""What a day sets in a scenario: nothing that the scenario states, and only what it takes."""

import re

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.stats import kstest

from magsim.cli.info import info
from magsim.loading import LoadedScenario, load_scenario
from magsim.population import DAY, INDIVIDUAL, settings
from magsim.recording import Recording
from magsim.simulation import compute_fields, record
from tests.support.measured import flight
from tests.support.scenarios import GOOD

FLUX = """
[[sensors.fluxgate]]
name = "flux"
mount = "cabin_rear"
"""

DAYS = range(1, 41)


@pytest.fixture
def path(write) -> str:
    return write(GOOD + FLUX)


def _days(path: str, *overrides: str) -> list[LoadedScenario]:
    return [load_scenario(path, [f"day={day}", *overrides]) for day in DAYS]


def test_day_0_sets_nothing(path: str) -> None:
    plain, zero = load_scenario(path), load_scenario(path, ["day=0"])
    assert zero.scenario == plain.scenario
    assert zero.digest == plain.digest
    assert zero.aircraft.nominal is None


def test_the_seed_does_not_draw_the_day(path: str) -> None:
    one, other = load_scenario(path, ["day=3"]), load_scenario(path, ["day=3", "seed=77"])
    assert one.scenario.model_copy(update={"seed": 77}) == other.scenario
    assert one.aircraft.digest == other.aircraft.digest
    assert load_scenario(path, ["day=3", "individual=1"]).scenario.air != one.scenario.air


def test_what_the_scenario_states_stays(path: str) -> None:
    stated = [
        "loading.payload_kg=900",
        "air.wind_north_mps=0",
        "air.turbulence_mps=0",
        "field.variation.sq_nt=[1, 2, 3]",
        "sensors.cabin.settled_c=25",
        "sensors.fluxgate[0].offset_drift_nt_c=[0, 0, 0]",
    ]
    scenario = load_scenario(path, ["day=3", *stated]).scenario
    assert scenario.loading.payload_kg == 900.0
    assert scenario.loading.fuel_kg is not None
    assert scenario.air == load_scenario(path).scenario.air
    assert scenario.field.variation.sq_nt == (1.0, 2.0, 3.0)
    assert scenario.field.variation.pc3_nt != 0.5
    assert scenario.sensors.cabin.settled_c == 25.0
    assert scenario.sensors.cabin.start_c not in (20.0, 25.0)
    assert scenario.sensors.fluxgate[0].offset_drift_nt_c == (0.0, 0.0, 0.0)
    assert min(np.abs(scenario.sensors.fluxgate[0].scale_drift_ppm_c)) >= 20.0


def test_what_is_switched_off_stays_off_and_a_preset_states_its_values(path: str) -> None:
    off = load_scenario(
        path, ["day=3", "field.variation.enabled=false", 'sensors.fluxgate[0].preset="fluxgate_survey"']
    )
    assert not off.scenario.field.variation.enabled
    assert off.scenario.field.variation.sq_nt == (20.0, 40.0, 20.0)
    assert off.scenario.sensors.fluxgate[0].offset_drift_nt_c == (0.1, -0.1, 0.1)


def test_weather_scatters_as_stated(path: str) -> None:
    scenarios = [loaded.scenario for loaded in _days(path)]
    wind = np.array([scenario.air.wind_mps for scenario in scenarios]).ravel() / 75.0
    assert kstest(wind / DAY["wind"].size[0], "norm").pvalue > 0.01
    least, largest = DAY["turbulence"].size
    gusts = np.array([scenario.air.turbulence_mps for scenario in scenarios])
    assert kstest((gusts - least) / (largest - least), "uniform").pvalue > 0.01
    daily = np.log([scenario.field.variation.sq_nt[1] / 40.0 for scenario in scenarios])
    assert kstest(daily / DAY["daily"].size[0], "norm").pvalue > 0.01
    settled = np.array([scenario.sensors.cabin.settled_c for scenario in scenarios])
    mean, scatter = DAY["cabin"].size
    assert kstest((settled - mean) / scatter, "norm").pvalue > 0.01


def test_the_aircraft_takes_on_the_temperature_at_the_height_of_the_start(path: str) -> None:
    """Standard atmosphere, 6.5 K for each kilometer, and the departure of the day: seen in the skin's conductivity."""
    built = load_scenario(path).aircraft.magnetics.skin.parts[0].conductivity_spm

    def air_c(loaded: LoadedScenario) -> float:
        return 20.0 + (built / loaded.aircraft.magnetics.skin.parts[0].conductivity_spm - 1.0) / 0.002

    low, high = (load_scenario(path, ["day=3", f"start.alt_m={alt_m}"]) for alt_m in (1000, 3000))
    assert air_c(low) - air_c(high) == pytest.approx(13.0, abs=1e-6)
    departures = np.array([air_c(loaded) for loaded in _days(path)]) - (15.0 - 19.5)
    assert kstest(departures / DAY["air"].size[0], "norm").pvalue > 0.01


def test_loads_are_within_their_limits_and_drawn_again_where_they_are_not(path: str) -> None:
    for loaded in _days(path):
        facts = loaded.scenario.loading.apply(loaded.aircraft.facts)  # raises beyond mass or center of gravity
        assert 0.4 <= facts.mass.balance.fuel.value / facts.mass.balance.fuel_capacity.value <= 0.85
    # With so much aboard at most 615 kg of fuel are allowed, which a third of the draws exceed.
    heavy = [
        loaded.scenario.loading.fuel_kg
        for loaded in _days(path, "loading.payload_kg=1290", "loading.payload_aft_m=0.3")
    ]
    assert all(fuel is not None and 403.0 < fuel <= 615.0 for fuel in heavy)


def test_what_no_draw_of_a_day_fits_keeps_what_it_had(path: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(settings.GROUPS, "air", lambda *_: {"air": {"wind_north_mps": 90.0}})
    kept = load_scenario(path, ["day=1"]).scenario
    assert kept.air == load_scenario(path).scenario.air
    assert kept.loading.fuel_kg is not None


@pytest.mark.parametrize("name", ["papers/002_straight", "patterns/track"])
def test_what_cannot_be_moved_or_loaded_is_not(name: str) -> None:
    """No gust moves a kinematic carrier, and a logged track has its own air."""
    plain, later = load_scenario(name).scenario, load_scenario(name, ["day=3"]).scenario
    assert later.air.turbulence_mps == plain.air.turbulence_mps
    assert later.loading == plain.loading
    assert (later.air == plain.air) == (name == "patterns/track")
    assert later.field.variation is not None


def test_a_refit_turns_the_fluxgate_and_nothing_else(path: str) -> None:
    angles = ["sensors.fluxgate[0].misalignment_deg=[1, 2, 3]"]
    plain = load_scenario(path, angles)
    assert plain.scenario.sensors.fluxgate[0].misalignment_deg == (1.0, 2.0, 3.0)
    drawn = []
    for number in range(1, 61):
        refitted = load_scenario(path, [*angles, f"sensors.fluxgate[0].refit={number}"])
        assert refitted.aircraft.digest == plain.aircraft.digest
        assert refitted.scenario.air == plain.scenario.air
        drawn.append(np.subtract(refitted.scenario.sensors.fluxgate[0].misalignment_deg, (1.0, 2.0, 3.0)))
    assert kstest(np.concatenate(drawn) / INDIVIDUAL["refit"].size[0], "norm").pvalue > 0.01
    # It lasts: the same on every day, another on another individual.
    gates = [
        load_scenario(path, [*angles, "sensors.fluxgate[0].refit=2", *more]).scenario.sensors.fluxgate[0]
        for more in ([], ["day=1"], ["day=2"], ["individual=1"])
    ]
    first, *others, elsewhere = [gate.misalignment_deg for gate in gates]
    assert all(other == first for other in others)
    assert elsewhere != first


def test_further_settings_are_those_of_the_file_and_not_of_the_day(path: str) -> None:
    later = load_scenario(path, ["day=3"])
    assert later.changed(["day=4"]).digest == load_scenario(path, ["day=4"]).digest
    assert later.changed(["day=0"]).digest == load_scenario(path).digest
    assert later.text == load_scenario(path).text


def test_the_day_is_provenance_and_no_method_sees_it(write, tmp_path) -> None:
    text = GOOD.replace('"c208b"', '"uav"').replace("75.0", "25.0").replace("3000.0", "100.0")
    text = text.replace('"cabin_center"', '"nose_boom"').replace('kind = "box"', 'kind = "box"\nleg_m = 1500.0')
    text += '[field.hinged]\nat_rest = ["aileron_left", "aileron_right"]\n'
    loaded = load_scenario(write(text), ["individual=2", "day=3"])
    recording = record(loaded, flight(), compute_fields(loaded, flight()))
    assert (recording.meta["individual"], recording.meta["day"]) == (2, 3)
    assert recording.meta["digest"] == loaded.digest
    assert "variation_cabin_x_nt" in recording
    recording.write(tmp_path / "later.h5")
    assert Recording.read(tmp_path / "later.h5").meta["day"] == 3
    shown = CliRunner().invoke(info, [str(tmp_path / "later.h5")]).output
    assert re.search(r"^  individual +2$", shown, flags=re.MULTILINE)
    assert re.search(r"^  day +3$", shown, flags=re.MULTILINE)
    for copy in (recording.labeled(), recording.blind()):
        assert not {"individual", "day", "digest"} & set(copy.meta)

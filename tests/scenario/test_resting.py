"""Settings that are stated and rest: all models of scenario files, and what is told of them."""

from collections.abc import Iterator, Mapping
from typing import Any, get_args

import pytest
from pydantic import BaseModel

from magsim import assets, cli
from magsim.config import Strict
from magsim.errors import RequestError
from magsim.loading import load_scenario
from magsim.scenario import Scenario

RANDOM_TIMES = ("correlation_s", "wander_s", "drift_s")
"""How keys end that say how fast something random changes: each needs a size beside it."""


def models_in(annotation: object) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in get_args(annotation):
        yield from models_in(part)


def all_models() -> list[type[BaseModel]]:
    """Every model that a scenario file may hold."""
    found: list[type[BaseModel]] = [Scenario]
    for model in found:
        for info in model.model_fields.values():
            found += [below for below in models_in(info.annotation) if below not in found]
    return found


def where(model: type[BaseModel], wanted: type[BaseModel]) -> Iterator[str]:
    """Every place of a model below another, as key paths; lists are not entered."""
    for key, info in model.model_fields.items():
        for below in models_in(info.annotation):
            if below is wanted:
                yield key
            elif model in {Scenario, *models_in(Scenario.model_fields["field"].annotation)} or key == "earth":
                yield from (f"{key}.{rest}" for rest in where(below, wanted))


def values_of(model: type[BaseModel]) -> Mapping[str, str]:
    """A TOML value for each key but ``enabled`` that has a plain default."""
    out = {}
    for key, info in model.model_fields.items():
        value = info.get_default(call_default_factory=True)
        if key != "enabled" and isinstance(value, bool | int | float | str):
            out[key] = str(value).lower() if isinstance(value, bool) else repr(value)
    return out


SWITCHED = [model for model in all_models() if "enabled" in model.model_fields and model.__name__ != "FeederSetting"]


def resting(name: str, settings: Mapping[str, str]) -> tuple[str, ...]:
    return load_scenario(name, [f"{key}={value}" for key, value in settings.items()]).resting


@pytest.mark.parametrize("model", SWITCHED, ids=lambda model: model.__name__)
def test_keys_beside_a_switch_that_is_off_are_reported(model: type[BaseModel]):
    places = [path for path in where(Scenario, model) if path.startswith(("field.", "sensors."))]
    assert places
    for path in places:
        keys = values_of(model)
        if not keys:
            continue
        found = resting("papers/001_fom", {f"{path}.enabled": "false"} | {f"{path}.{k}": v for k, v in keys.items()})
        line = next(line for line in found if f"{path}: " in line)
        assert line.endswith("no effect with enabled = false")
        assert set(keys) <= set(line.split(": ", 2)[-1].split(" ha", maxsplit=1)[0].split(", "))
        assert not [line for line in resting("papers/001_fom", {f"{path}.enabled": "false"}) if f"{path}: " in line]


def test_a_feeder_that_is_off_has_no_parameters():
    base = "field.electronics.feeders.strobe"
    found = resting("electronics_c208b", {f"{base}.enabled": "false", f"{base}.current_a": "3.0"})
    wanted = "strobe: period_s, current_a have no effect with enabled = false"
    assert [line.split("feeders.")[1] for line in found] == [wanted]


def test_needs_name_keys_of_their_models():
    stated = [(model, key, needs) for model in all_models() for key, needs in getattr(model, "NEEDS", {}).items()]
    assert len(stated) >= 15
    for model, key, needs in stated:
        assert {key, *needs} <= set(model.model_fields), (model, key)


def test_every_time_of_something_random_needs_its_size():
    for model in all_models():
        for key in model.model_fields:
            if key.endswith(RANDOM_TIMES):
                assert issubclass(model, Strict)
                assert key in model.NEEDS, (model, key)


SENSORS: dict[str, tuple[dict[str, Any], str]] = {
    "field.variation": ({"drift_s": "60.0"}, "drift_nt"),
    "field.memory": ({"start": "'aligned'"}, "hysteresis or viscosity"),
    "field.earth.departure": ({"seed": "3"}, "scale"),
    "sensors.ins": ({"rate_correlation_s": "60.0", "rate_drift_dps": "0.0"}, "rate_drift_dps"),
    "sensors.barometer": ({"correlation_s": "60.0"}, "drift_pa"),
    "sensors.cabin": ({"wander_s": "60.0"}, "wander_c"),
    "sensors.scalar[0]": ({"relock_s": "1.0"}, "dead_polar_deg or dead_equator_deg or range_nt"),
}
OFF = {
    "field.variation": {"drift_nt": "0.0"},
    "field.memory": {"hysteresis": "false", "viscosity": "false"},
    "field.earth.departure": {"scale": "0.0"},
}
ON = {
    "field.variation": {"drift_nt": "1.0"},
    "field.memory": {"hysteresis": "true"},
    "field.earth.departure": {"scale": "2.0"},
    "sensors.ins": {"rate_drift_dps": "0.1"},
    "sensors.barometer": {"drift_pa": "1.0"},
    "sensors.cabin": {"wander_c": "1.0"},
    "sensors.scalar[0]": {"range_nt": "[20000.0, 80000.0]"},
}


@pytest.mark.parametrize("path", SENSORS)
def test_a_key_without_what_it_needs_is_reported(path: str):
    stated, needs = SENSORS[path]
    key = next(iter(stated))
    given = {f"{path}.{name}": value for name, value in (stated | OFF.get(path, {})).items()}
    lines = [line for line in resting("patterns/straight", given) if f"{path}: " in line]
    assert [line.split(f"{path}: ")[1] for line in lines] == [f"{key} has no effect without {needs}"]
    acting = given | {f"{path}.{name}": value for name, value in ON[path].items()}
    assert not [line for line in resting("patterns/straight", acting) if f"{path}: " in line]


@pytest.mark.parametrize(
    ("name", "settings", "wanted"),
    [
        ("electronics_c208b", {"field.electronics.enabled": "false"}, "sensors.electrical: "),
        (
            "patterns/straight",
            {"field.carrier.scale": "2.0"},
            "field.carrier: scale has no effect without a table [t",
        ),
        (
            "patterns/straight",
            {"sensors.cabin.warmup_s": "60.0"},
            "sensors.cabin: warmup_s has no effect where start",
        ),
        ("patterns/straight", {"field.crew.scale": "2.0"}, "field.crew: scale has no effect where nobody is aboard"),
        ("patterns/straight", {"air.shear": "{kind='log'}"}, "air: shear has no effect without wind_north_mps"),
        ("patterns/track", {"air.wind_east_mps": "5.0"}, "air: wind_east_mps has no effect on a logged track"),
        ("patterns/track", {"loading.fuel_kg": "500.0"}, "loading: fuel_kg has no effect on a logged track"),
        ("patterns/track", {"flight.warmup_s": "90.0"}, "flight: warmup_s has no effect on a logged track"),
        ("patterns/track", {"sensors.surfaces.lag_s": "0.1"}, "sensors.surfaces: lag_s has no effect on a track"),
        ("papers/002_straight", {"flight.leg_tolerance_m": "50.0"}, "flight: leg_tolerance_m has no effect on a kinem"),
        ("papers/002_straight", {"sensors.surfaces.lag_s": "0.1"}, "sensors.surfaces: lag_s has no effect on a kinem"),
        ("papers/000_simulated", {"sensors.fluxgate[0].offset_drift_nt_c": "[1.0, 0.0, 0.0]"}, "without a table [sen"),
    ],
)
def test_what_another_table_silences_is_reported(name: str, settings: Mapping[str, str], wanted: str):
    assert any(wanted in line for line in resting(name, settings))


@pytest.mark.parametrize("name", assets.list_scenarios())
def test_nothing_rests_in_a_shipped_scenario(name: str):
    assert load_scenario(name).resting == ()


def test_a_day_and_a_preset_state_nothing():
    assert resting("patterns/straight", {"field.crew.scale": "2.0", "day": "3"}) == ()
    assert resting("patterns/straight", {"sensors.ins.preset": "'ins_survey'", "day": "3"}) == ()


def test_generate_tells_it_before_it_flies(tmp_path, monkeypatch, capsys):
    def refuse(*_args: object, **_kwargs: object) -> None:
        msg = "not flown"
        raise RequestError(msg)

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("magsim.simulation.simulate", refuse)
    setting = ["--set", "field.crust={enabled=false, rms_nt=30.0}"]
    assert cli.main(["generate", "patterns/straight", *setting]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert lines[0].startswith("warning: ")
    assert lines[0].endswith("field.crust: rms_nt has no effect with enabled = false")
    assert lines[1] == "not flown"

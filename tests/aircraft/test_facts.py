"""Facts: read strictly, with unit and source, in body axes from the datum."""

import tomllib

import pytest
from pydantic import BaseModel, ValidationError

from magsim.aircraft.fact import CurveFact, Fact, RangeFact, VectorFact
from magsim.aircraft.facts import Facts
from magsim.units import INCH
from tests.support.paths import ROOT

FILE = ROOT / "aircraft" / "c208b" / "facts.toml"


@pytest.fixture
def raw() -> dict:
    return tomllib.loads(FILE.read_text(encoding="utf-8"))


def walk(node: object) -> list:
    """All facts of a model."""
    if isinstance(node, Fact | VectorFact | RangeFact | CurveFact):
        return [node]
    if isinstance(node, BaseModel):
        return [fact for name in type(node).model_fields for fact in walk(getattr(node, name))]
    return [fact for item in node for fact in walk(item)] if isinstance(node, tuple) else []


def test_every_number_has_a_source(raw: dict) -> None:
    facts = walk(Facts.model_validate(raw))
    assert len(facts) > 80
    assert all(fact.source.strip() and fact.unit for fact in facts)
    assert 20 < sum(fact.source.startswith("estimate") for fact in facts) < len(facts)


def test_stations_agree_with_the_handbook(raw: dict) -> None:
    # POH p. 6-23: the aft limit, 40.33 % of the mean chord, is fuselage station 204.35 in.
    facts = Facts.model_validate(raw)
    geometry = facts.geometry
    aft = geometry.mean_chord_leading_edge.value + 0.4033 * geometry.mean_chord.value
    assert aft / INCH == pytest.approx(204.35, abs=0.01)
    quarter = geometry.mean_chord_leading_edge.value + 0.25 * geometry.mean_chord.value
    assert facts.datum.station.value == pytest.approx(quarter, abs=1e-6)


def test_center_of_gravity_is_behind_the_datum(raw: dict) -> None:
    x, y, z = Facts.model_validate(raw).cg_b
    assert x == pytest.approx(-0.02 * 1.68656, abs=1e-5)
    assert (y, z) == pytest.approx((0.0, -0.05), abs=1e-5)


def test_limits(raw: dict) -> None:
    limits = Facts.model_validate(raw).limits
    assert limits.alt_m == 7620.0
    assert limits.load_factor == (-1.52, 3.8)
    assert limits.amplitude_deg.keys() == {"pitch", "roll", "yaw"}
    assert min(limits.amplitude_deg.values()) >= 15.0


@pytest.mark.parametrize(
    ("group", "name", "value", "message"),
    [
        ("geometry", "span", {"value": 52.1, "unit": "ft", "source": "x y"}, "unit 'ft'; allowed: 'm'"),
        ("geometry", "span", {"value": -1.0, "unit": "m", "source": "x y z"}, "allowed: above 0"),
        ("geometry", "span", {"value": 15.0, "unit": "m"}, "source"),
        ("geometry", "wingspan", {"value": 15.0, "unit": "m", "source": "x y z"}, "wingspan"),
        ("limits", "true_airspeed", {"value": [90.0, 50.0], "unit": "m/s", "source": "x y z"}, "not below"),
        ("mass", "mass", {"value": float("nan"), "unit": "kg", "source": "x y z"}, "finite"),
    ],
)
def test_bad_facts_are_reported(raw: dict, group: str, name: str, value: dict, message: str) -> None:
    raw[group][name] = value
    with pytest.raises(ValidationError, match=message):
        Facts.model_validate(raw)


def test_a_curve_rises(raw: dict) -> None:
    raw["engine"]["propeller"]["chord"]["at"][1] = -1.0
    with pytest.raises(ValidationError, match="do not rise"):
        Facts.model_validate(raw)

"""The departure of the main field along a flight, at a base station, and in scenario files."""

import numpy as np
import pytest

from magsim.columns import BACKGROUND
from magsim.earth import LocalFrame
from magsim.errors import RequestError
from magsim.field import compute_field, load_response
from magsim.field.background.departure import departure_of, vector_along
from magsim.field.background.station import station_field
from magsim.loading import load_scenario
from magsim.scenario import BaseStation, Earth
from magsim.terrain import TangentPlane
from tests.field.background.test_background import (
    AIRCRAFT,
    GROUND,
    INSIDE,
    at_own_place,
    flight,
    scenario,
)
from tests.support.paths import ROOT

__all__ = ["flight"]

OFF = {"earth": {"departure": {"enabled": False}}}


@pytest.fixture(scope="module")
def truths(flight):
    response = load_response(AIRCRAFT)
    return {
        name: compute_field(scenario(**field), AIRCRAFT, flight, response, ground=GROUND)
        for name, field in (("on", {}), ("off", OFF), ("uniform", {"earth": {"along_path": False}}))
    }


def test_the_departure_at_each_own_place(truths, flight):
    field, truth = departure_of(scenario()), truths["on"]
    vector_e = vector_along(field, scenario(), truth.time_s)[INSIDE]
    for mount in truth.mounts:
        exact = at_own_place(flight, truth, mount, lambda place_e: field.expanded(place_e)[0] + vector_e, INSIDE)
        assert np.abs(truth.part("departure", mount)[INSIDE] - exact).max() < 1e-4
    apart = truth.part("departure", "sgl_mag_1") - truth.part("departure", "cabin_center")
    assert 0.05 < np.abs(apart).max() < 5.0


def test_it_is_a_part_of_the_background_and_changes_no_other(truths):
    on, off = truths["on"], truths["off"]
    assert set(on.parts_b) - set(off.parts_b) == {"departure"}
    assert "departure" in BACKGROUND
    np.testing.assert_array_equal(on.parts_b["earth"], off.parts_b["earth"])
    difference = on.background("sgl_mag_1") - off.background("sgl_mag_1")
    np.testing.assert_allclose(difference, on.part("departure", "sgl_mag_1"), rtol=0, atol=1e-9)
    # The steel answers the field that is there, not the model's.
    assert np.abs(on.parts_b["induced"] - off.parts_b["induced"]).max() > 0.1


def test_a_uniform_world_has_none(truths):
    assert "departure" not in truths["uniform"].parts_b


def test_twice_the_scale_is_twice_the_field(truths, flight):
    double = scenario(earth={"departure": {"scale": 2.0}})
    truth = compute_field(double, AIRCRAFT, flight, load_response(AIRCRAFT), ground=GROUND)
    np.testing.assert_allclose(truth.parts_b["departure"], 2.0 * truths["on"].parts_b["departure"], rtol=1e-12)


def test_a_base_station_has_the_departure_of_its_own_place():
    station, time = BaseStation(north_m=-3000.0, east_m=500.0, height_m=3.0), np.arange(-480, 7200) / 120.0
    with_it, without = (station_field(station, scenario(**field), GROUND, time) for field in ({}, OFF))
    field = departure_of(scenario())
    frame, place_e = _frame(station)
    exact = (field.expanded(place_e[None])[0] + vector_along(field, scenario(), time)) @ frame.T
    np.testing.assert_allclose(with_it - without, exact, rtol=0, atol=1e-9)


def _frame(station: BaseStation) -> tuple[np.ndarray, np.ndarray]:
    lat, lon = TangentPlane(*np.radians([52.2, 9.8])).geodetic(np.array(station.north_m), np.array(station.east_m))
    frame = LocalFrame(float(lat), float(lon), 124.0 + station.height_m)
    return frame.rot_ne, frame.origin_e


def test_shipped_scenarios_have_it_and_the_papers_worlds_have_not():
    papers = sorted((ROOT / "scenarios/papers").glob("*.toml"))
    assert len(papers) >= 5
    # what stands for real flights has a field beside its model, and those papers' networks are to find it
    real = {"000_lines", "004_scss2"}
    assert {path.stem for path in papers if load_scenario(str(path)).scenario.field.earth.departs} == real
    for path in (path for path in papers if path.stem not in real):
        earth = load_scenario(str(path)).scenario.field.earth
        assert not earth.departs
        assert earth.description == "IGRF-14, without departure from the model"
    for name in ("calibration_c208b", "geology_c208b"):
        earth = load_scenario(name).scenario.field.earth
        assert earth.departs
        assert earth.description == "IGRF-14 with the departure of world 0"


def test_a_departure_without_gradient_is_refused():
    uniform = ("field.earth.along_path=false",)
    earth = load_scenario("calibration_c208b", uniform).scenario.field.earth
    assert not earth.departs
    assert "everywhere, without gradient" in earth.description
    assert Earth.model_validate(earth.model_dump()) == earth
    with pytest.raises(RequestError, match="no effect with along_path = false; allowed: along_path = true"):
        load_scenario("calibration_c208b", (*uniform, "field.earth.departure.enabled=true"))

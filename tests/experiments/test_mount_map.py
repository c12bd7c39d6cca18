"""The mount map against the flights that it predicts."""

import json
import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from magsim import assets, signals
from magsim.aircraft import Aircraft, load_aircraft
from magsim.aircraft.magnetics import Skin
from magsim.cli import main
from magsim.errors import RequestError
from magsim.experiments import mount_report
from magsim.experiments.mount_grid import Extent, grid, plane
from magsim.experiments.mount_map import FlightSeries, predict
from magsim.experiments.mount_report import flight_of, flown_aircraft, make_map, write_page
from magsim.experiments.recorded import background
from magsim.field import load_response, obstacles, outline, response_at
from magsim.field.geometry.meshes import box_surface
from magsim.field.parts import PARTS
from magsim.loading import load_scenario
from magsim.recording import Recording
from magsim.scenario import FieldSettings
from magsim.simulation import simulate
from tests.benchmarks.aircraft_levels import vehicle
from tests.support import scores

MOUNTS = {"cabin": "cabin_center", "tail": "sgl_mag_1", "ceiling": "sgl_mag_5"}
SENSORS = ",".join(f'{{name="{name}",mount="{mount}",noise_nt_rthz=0.0}}' for name, mount in MOUNTS.items())


@pytest.fixture(scope="module")
def aircraft():
    return load_aircraft("c208b")


@pytest.fixture(scope="module")
def recording() -> Recording:
    short = [
        "pattern.leg_m=9000.0",
        "pattern.period_s=6.0",
        "field.earth.departure.enabled=false",  # a map knows the model's main field alone
        f"sensors.scalar=[{SENSORS}]",
    ]
    return simulate(load_scenario("patterns/fom", short))


def signatures(recording: Recording, sensor: str) -> tuple[np.ndarray, dict]:
    """In-band interference of a simulated flight over the maneuvers, and the cells of its figure of merit."""
    band = signals.band_pass(recording[f"interference_{sensor}_nt"], recording.rate_hz)
    mask = signals.off_ends(recording.time_s) & (recording["turn"] == 0) & (recording["maneuver"] != 0)
    return band[mask], scores.peaks(band[mask], recording["leg_heading_deg"][mask], recording["maneuver"][mask])


def test_prediction_is_what_the_flight_records(aircraft, recording):
    places = {sensor: aircraft.mounts[mount] for sensor, mount in MOUNTS.items()}
    found = predict(aircraft, recording, places)
    assert found.cells == 12
    for row, sensor in enumerate(found.names):
        band, cells = signatures(recording, sensor)
        assert found.std_nt[row] == pytest.approx(band.std(), rel=0.02)
        assert found.fom_nt[row] == pytest.approx(sum(cells), rel=0.02)
        assert found.fom_left_nt[row] < 0.2 * found.fom_nt[row]


OFF = {"enabled": False}


def errors(aircraft: Aircraft, recording: Recording, **settings: dict) -> dict[str, float]:
    """Error of the predicted signature at each sensor, over the standard deviation of the projection that was flown."""
    places = {sensor: aircraft.mounts[mount] for sensor, mount in MOUNTS.items()}
    series = FlightSeries(recording, aircraft, FieldSettings.model_validate(settings))
    found = series.signatures(response_at(aircraft, places))
    rows = signals.off_ends(recording.time_s) & (recording["turn"] == 0) & (recording["maneuver"] != 0)
    out = {}
    for row, sensor in enumerate(places):
        band = signals.band_pass(recording[f"projection_{sensor}_nt"], recording.rate_hz)[rows]
        out[sensor] = (found[:, row] - band).std() / band.std()
    return out


def test_the_signature_row_by_row_with_propeller_and_memory(aircraft, recording):
    """The flight has every part on; a prediction without memory or without the propeller is worse."""
    whole = errors(aircraft, recording)
    assert max(whole.values()) < 1.5e-3
    without_memory, without_propeller = (
        errors(aircraft, recording, memory=OFF),
        errors(aircraft, recording, propeller=OFF),
    )
    assert without_memory["cabin"] > 20.0 * whole["cabin"]
    assert without_memory["ceiling"] > 20.0 * whole["ceiling"]
    assert without_propeller["cabin"] > 4.0 * whole["cabin"]
    assert without_propeller["tail"] > 3.0 * whole["tail"]


def test_parts_scale_as_in_a_scenario(aircraft, recording):
    """Every part, linear and turning, is multiplied by its scale; the sum over parts is the whole."""
    places = {"cabin": aircraft.mounts["cabin_center"]}
    response = response_at(aircraft, places)

    def signature(**scales: float) -> np.ndarray:
        settings = {name: {"enabled": name in scales, "scale": scales.get(name, 1.0)} for name in PARTS}
        return FlightSeries(recording, aircraft, FieldSettings.model_validate(settings)).signatures(response)

    whole = signature(**dict.fromkeys(PARTS, 1.0))
    np.testing.assert_allclose(sum(signature(**{name: 1.0}) for name in PARTS), whole, atol=1e-9 * whole.std())
    for name in PARTS:
        np.testing.assert_allclose(signature(**{name: -2.0}), -2.0 * signature(**{name: 1.0}), rtol=1e-9, atol=1e-12)


def test_currents_of_the_drone_count():
    """The motor's current swings with the throttle: nothing else leaves so much after Tolles-Lawson."""
    loaded = load_scenario("papers/001_fom", ["sensors.scalar[0].noise_nt_rthz=0.0"])
    flight, drone = simulate(loaded), loaded.aircraft
    sensor = loaded.scenario.sensors.scalar[0]
    found = predict(drone, flight, {sensor.name: drone.mounts[sensor.mount]})
    band, _ = signatures(flight, sensor.name)
    assert found.std_nt[0] == pytest.approx(band.std(), rel=0.02)
    silent = {name: column for name, column in flight.data.items() if not name.startswith(("cur_", "true_cur_"))}
    quiet = Recording(flight.name, flight.time_s, silent, flight.meta)
    without = predict(drone, quiet, {sensor.name: drone.mounts[sensor.mount]})
    assert without.std_left_nt[0] < 0.5 * found.std_left_nt[0]


def test_blind_recording_serves_as_well(aircraft, recording):
    """A real flight has attitude and labels but no truth."""
    survey = recording.labeled()
    place = {"cabin": aircraft.mounts["cabin_center"]}
    known, blind = predict(aircraft, recording, place), predict(aircraft, survey, place)
    assert blind.std_nt[0] == pytest.approx(known.std_nt[0], rel=0.01)


def test_background_has_the_strength_of_the_truth(recording):
    strength = np.linalg.norm(background(recording), axis=1)
    assert np.abs(strength - recording["clean_cabin_nt"]).max() < 0.05


def test_tolles_lawson_takes_a_linear_aircraft_away(aircraft, recording):
    """Without moving surfaces, currents, memory and lag the signature is linear in the 18 terms."""
    moving = ("surface_", "cur_", "true_surface_", "true_cur_")
    still = {name: column for name, column in recording.data.items() if not name.startswith(moving)}
    flight = Recording(recording.name, recording.time_s, still, recording.meta)
    plain = aircraft.magnetics.model_copy(update={"skin": None, "coils": (), "memory": None})
    found = predict(replace(aircraft, magnetics=plain), flight, {"cabin": aircraft.mounts["cabin_center"]})
    assert found.std_nt[0] > 5.0
    assert found.std_left_nt[0] < 1e-5 * found.std_nt[0]


def test_recordings_without_maneuvers_are_refused(aircraft, recording):
    flat = Recording(recording.name, recording.time_s, {**recording.data, "maneuver": np.zeros(len(recording))}, {})
    with pytest.raises(RequestError, match="no labeled maneuvers"):
        FlightSeries(flat, aircraft)
    undated = Recording(recording.name, recording.time_s, recording.data, {})
    with pytest.raises(RequestError, match="no start_utc"):
        FlightSeries(undated, aircraft)
    with pytest.raises(RequestError, match="no place"):
        predict(aircraft, recording, {})


def test_grid_is_inside_near_and_on_booms():
    box = box_surface((0.0, 0.0, 0.0), (10.0, 2.0, 2.0), 0.5)
    body = Extent(box.vertices, box)
    assert body.length_m == pytest.approx(10.0)
    points, inside = grid(body, 0.3)
    truly = np.all(np.abs(points) < (5.0, 1.0, 1.0), axis=1)
    np.testing.assert_array_equal(inside, truly)
    assert inside.sum() > 500
    assert points[:, 0].min() < -7.5  # a boom behind
    assert points[:, 0].max() > 7.5
    for spacing in (0.02, 1e-300, math.nan, math.inf, 3.0):
        with pytest.raises(RequestError, match="--spacing"):
            grid(body, spacing)


@pytest.mark.parametrize("name", [*assets.list_aircraft(), *assets.list_birds()])
def test_an_aircraft_without_skin_and_outline_is_known_by_its_parts(name):
    whole = vehicle(name)
    bare = replace(whole, magnetics=whole.magnetics.model_copy(update={"skin": None, "outline": None}))
    body = Extent.of(bare, None)
    known = [*whole.mounts.values(), *(dipole.position_m for dipole in whole.magnetics.permanent)]
    assert np.all(body.box[0] <= np.min(known, axis=0))
    assert np.all(body.box[1] >= np.max(known, axis=0))
    assert not body.inside(np.zeros((1, 3)))[0]


def test_the_outline_of_the_drone_is_drawn_and_nothing_else():
    drone = load_aircraft("uav")
    shells = outline(drone.magnetics.outline)
    assert np.ptp(shells.extent_m, axis=0)[1] == pytest.approx(drone.facts.geometry.span.value, rel=1e-3)
    bare = replace(drone, magnetics=drone.magnetics.model_copy(update={"outline": None}))
    with_it, without = load_response(drone), load_response(bare)
    for name in ("permanent_nt", "induced", "field", "wiring_nt_per_a"):
        np.testing.assert_array_equal(getattr(with_it, name), getattr(without, name))
    np.testing.assert_array_equal(
        obstacles(drone, shells.surface.vertices[:9]), obstacles(bare, shells.surface.vertices[:9])
    )
    body = Extent.of(drone, shells.surface)
    assert body.inside(np.array([[0.0, 0.0, 0.0], [0.0, 1.0, -0.08], [0.0, 1.0, 0.2]])).tolist() == [True, True, False]
    across, _, _ = plane(body, 0.1, 1)
    assert across[0] < -1.05
    assert across[-1] > 1.75  # the mount at the end of the long boom


def test_shells_that_are_not_sound_are_refused(aircraft, recording):
    table = aircraft.magnetics.skin.model_dump()
    table["parts"][0]["sections"][6]["height_m"] = 3.0
    crossing = aircraft.magnetics.model_copy(update={"skin": Skin.model_validate(table)})
    with pytest.raises(RequestError, match="aircraft c208b: skin parts 'fuselage' and 'wing' touch or cross at "):
        make_map(replace(aircraft, magnetics=crossing), recording)


def test_plane_holds_the_datum():
    box = box_surface((0.0, 0.0, 0.0), (10.0, 2.0, 2.0), 0.5)
    across, up, points = plane(Extent(box.vertices, box), 0.5, 1)
    assert points.shape == (len(across), len(up), 3)
    assert not points[..., 1].any()
    np.testing.assert_array_equal(points[:, 0, 0], across)
    np.testing.assert_array_equal(points[0, :, 2], up)


def test_a_flight_too_short_for_a_map_is_refused(aircraft, recording):
    rows = slice(0, np.flatnonzero(recording["maneuver"])[0] + 20)  # all maneuvers are at its end
    short = Recording("short", recording.time_s[rows], {k: v[rows] for k, v in recording.data.items()}, recording.meta)
    with pytest.raises(
        RequestError, match=r"no maneuver of recording 'short' is on a leg, 30 s off .*; allowed: a longer"
    ):
        predict(aircraft, short, {"cabin": aircraft.mounts["cabin_center"]})


def test_the_map_is_of_the_individual_that_flew(aircraft, recording):
    """The day's air is that of the start's height, which the first row keeps within some meters."""
    assert flown_aircraft(aircraft, recording) is aircraft
    meant = load_scenario("patterns/fom", ["individual=3", "day=2"]).aircraft
    for meta in ({"individual": 3, "day": 2}, {"individual": 3, "day": 0}):
        flown = flown_aircraft(aircraft, replace(recording, meta={**recording.meta, **meta}))
        if meta["day"]:
            for mine, its in zip(flown.magnetics.permanent, meant.magnetics.permanent, strict=True):
                np.testing.assert_allclose(mine.moment_am2, its.moment_am2, rtol=1e-3)
        else:
            assert flown.magnetics == load_scenario("patterns/fom", ["individual=3"]).aircraft.magnetics
    other = {**recording.meta, "individual": 3, "aircraft": "uav"}
    assert flown_aircraft(aircraft, replace(recording, meta=other)) is aircraft


@pytest.fixture(scope="module")
def whole(aircraft, recording):
    return make_map(aircraft, recording, spacing_m=0.8)


def test_best_places_are_the_quietest_and_apart(whole):
    for inside in (True, False):
        best = whole.best(4, inside=inside)
        assert [place.fom_nt for place in best] == sorted(place.fom_nt for place in best)
        assert best[0].fom_nt == whole.places.fom_nt[whole.inside == inside].min()
        gaps = [math.dist(a.position_m, b.position_m) for a in best for b in best if a is not b]
        assert min(gaps) >= 3.0 * whole.spacing_m
    names = [place.name for place in whole.table(2)]
    assert names[: len(whole.mounts.names)][0] == "sgl_mag_1"  # the stinger
    assert names[-2:] == ["outside 1", "outside 2"]


def test_table_and_json_hold_the_same(whole):
    text, data = whole.to_text(3), json.loads(whole.to_json(3))
    assert data["cells"] == 12
    for place in data["places"]:
        line = next(line for line in text.splitlines() if line.startswith(f"{place['name']} "))
        assert f"{place['fom_nt']:.4g}" in line


def test_page_needs_nothing_else(whole, tmp_path):
    from matplotlib.figure import Figure

    target = tmp_path / "map.html"
    write_page(whole, Figure(), target, count=2)
    text = target.read_text(encoding="utf-8")
    assert "data:image/png;base64," in text
    assert "http" not in text
    assert text.count("<tr>") == 1 + len(whole.table(2))
    with pytest.raises(RequestError, match="exists"):
        write_page(whole, Figure(), target)


def test_command_prints_the_table_and_draws(recording, tmp_path, monkeypatch, capsys):
    """With a skin drawn coarsely: a place is predicted over each of its triangles."""
    monkeypatch.setattr(mount_report, "outline", partial(outline, element_m=1.5))
    monkeypatch.chdir(tmp_path)
    recording.write("fom.h5")
    assert main(["map", "c208b", "--flight", "fom.h5", "--spacing", "3", "--top", "1", "-o", "map.png"]) == 0
    printed = capsys.readouterr().out
    assert "sgl_mag_1" in printed
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")
    assert main(["map", "c208b", "--flight", "fom.h5", "-o", "map.png"]) == 2
    assert main(["map", "c208b", "--flight", "fom.h5", "-o", "map.pdf"]) == 2
    assert "allowed" not in capsys.readouterr().out


def test_wrong_flights_are_refused(aircraft):
    with pytest.raises(RequestError, match=r"no scenario|there is no"):
        flight_of(aircraft, "no_such_flight")

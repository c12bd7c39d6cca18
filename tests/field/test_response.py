"""The aircraft's response: the same bits however it is made, and levels beside the published ones."""

from pathlib import Path

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from magsim.aircraft import Aircraft, Magnetics, load_aircraft
from magsim.errors import RequestError
from magsim.field import AircraftResponse, compute_response, load_response, response_at
from magsim.field.metal.steel.model import load_steel
from magsim.field.sources.dipoles import dipole_field
from magsim.population import individual_of

ARRAYS = ("positions_m", "permanent_nt", "induced", "tau_s", "drive", "field")


@pytest.fixture(scope="module")
def aircraft() -> Aircraft:
    return load_aircraft("c208b")


@pytest.fixture(scope="module")
def response(aircraft: Aircraft) -> AircraftResponse:
    return compute_response(aircraft)


def _bytes(response: AircraftResponse) -> list[bytes]:
    return [getattr(response, name).tobytes() for name in ARRAYS]


def test_same_bits_on_two_threads_from_an_empty_and_a_full_cache(
    aircraft: Aircraft, response: AircraftResponse, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MAGSIM_CACHE", str(tmp_path / "cache"))
    with threadpool_limits(limits=2):
        first = load_response(aircraft)
    kept = list((tmp_path / "cache" / "response").iterdir())
    assert len(kept) == 1
    assert _bytes(first) == _bytes(load_response(aircraft)) == _bytes(response)
    # The key is the content: another moment is another entry.
    changed = aircraft.magnetics.model_dump(by_alias=True)
    changed["permanent"][0]["moment_am2"] = (1.0, 2.0, 3.0)
    other = Aircraft(aircraft.name, aircraft.facts, Magnetics.model_validate(changed))
    assert _bytes(load_response(other)) != _bytes(first)
    assert len(list((tmp_path / "cache" / "response").iterdir())) == 2


def test_arrays_cannot_be_written_to(response: AircraftResponse) -> None:
    for name in ARRAYS:
        with pytest.raises(ValueError, match="read-only"):
            getattr(response, name)[...] = 0.0


def test_parts_that_touch_are_told_with_the_name_of_the_aircraft(aircraft: Aircraft) -> None:
    settings = aircraft.magnetics.model_dump(by_alias=True)
    twin = dict(settings["steel"][0], name="twin")
    settings["steel"] = [settings["steel"][0], twin]
    broken = Aircraft("c208b", aircraft.facts, Magnetics.model_validate(settings))
    with pytest.raises(RequestError, match=r"aircraft c208b: steel parts 'fuel_tank' and 'twin' touch or cross at \("):
        compute_response(broken)


def test_an_aircraft_of_wood_is_silent(aircraft: Aircraft) -> None:
    settings = aircraft.magnetics.model_dump(by_alias=True)
    settings.update(permanent=[], suspensions={}, rotating=[], hinged=[], controls=[], steel=[], coils=[], skin=None)
    wood = compute_response(Aircraft("wood", aircraft.facts, Magnetics.model_validate(settings)))
    assert not np.any(wood.permanent_nt)
    assert not np.any(wood.induced)
    assert not np.any(wood.eddy_slow_s)


def test_coil_of_real_wire(aircraft: Aircraft) -> None:
    """One loop of known wire: E = -S F / R with R = length / (conductivity section)."""
    settings = aircraft.magnetics.model_dump(by_alias=True)
    loop = {
        "name": "ring",
        "vertices_m": [[2.0, 1.0, -1.0], [2.0, 1.0, 1.0], [2.0, -1.0, 1.0], [2.0, -1.0, -1.0]],
        "wire_radius_m": 0.01,
        "conductivity_spm": 1.74e7,
        "section_m2": 1e-3,
        "source": "a test",
    }
    settings.update(
        permanent=[], suspensions={}, rotating=[], hinged=[], controls=[], steel=[], coils=[loop], skin=None
    )
    response = compute_response(Aircraft("ring", aircraft.facts, Magnetics.model_validate(settings)))
    resistance = 8.0 / (1.74e7 * 1e-3)
    # A square of side a on its axis: B = mu0 I a^2 / (2 pi (z^2 + a^2/4) sqrt(z^2 + a^2/2)).
    on_axis = 2e-7 * 4.0 / ((4.0 + 1.0) * np.sqrt(4.0 + 2.0))
    slow = response.eddy_slow_s[response.mounts.index("cabin_center")]
    assert slow[0, 0] == pytest.approx(-on_axis * 4.0 / resistance, rel=1e-9)


def test_mirrored_coils_keep_the_aircraft_symmetric(aircraft: Aircraft) -> None:
    """In the plane of symmetry a field along x or z makes none along y."""
    response = load_response(aircraft, "coils")
    slow = response.eddy_slow_s[response.mounts.index("cabin_center")]
    assert max(abs(slow[0, 1]), abs(slow[1, 0]), abs(slow[1, 2]), abs(slow[2, 1])) < 1e-9 * np.abs(slow).max()


def test_levels_in_the_tail_beside_published_ones(response: AircraftResponse) -> None:
    """MagNav.jl, test_data_TL.mat, a stinger: permanent (-1.6, 11.1, -1.1) nT, induced 1.7e-4, eddy 0.037 ms."""
    row = response.mounts.index("sgl_mag_1")
    for value, published in (
        (np.linalg.norm(response.permanent_nt[row]), 11.3),
        (np.abs(response.induced[row]).max(), 1.7e-4),
        (np.abs(response.eddy_slow_s[row]).max(), 0.037e-3),
    ):
        assert published / 4.0 < value < published * 4.0


def test_levels_in_the_cabin_beside_published_ones(aircraft: Aircraft, response: AircraftResponse) -> None:
    """Paper 000: 306 nT RMS of all interference in the cabin; a stylized closed skin of its own has 7, 9, 12 ms."""
    row = response.mounts.index("cabin_center")
    assert 100.0 < np.linalg.norm(response.permanent_nt[row]) < 1000.0
    # A level flight on four headings where paper 000 flew: 43012 nT, inclination 23 degrees.
    headings = np.radians(np.arange(0.0, 360.0, 90.0))
    dip = np.radians(23.0)
    ambient = 43012.0 * np.column_stack(
        [np.cos(dip) * np.cos(headings), -np.cos(dip) * np.sin(headings), np.full(4, np.sin(dip))]
    )
    whole = ambient + response.permanent_nt[row] + ambient @ response.induced[row].T
    rms = np.sqrt(np.mean((np.linalg.norm(whole, axis=1) - 43012.0) ** 2))
    assert 306.0 / 1.5 < rms < 306.0 * 1.5
    np.testing.assert_allclose(np.diag(response.eddy_slow_s[row]), [-6.9e-3, -9.1e-3, -12.3e-3], rtol=0.3)
    coils = load_response(aircraft, "coils")
    assert 1e-4 < np.abs(coils.eddy_slow_s[row]).max() < 1.5e-3


def test_permanent_field_is_the_sum_of_the_dipoles(aircraft: Aircraft, response: AircraftResponse) -> None:
    total = sum(
        dipole_field(np.array(d.position_m), np.array(d.moment_am2), response.positions_m)
        for d in aircraft.magnetics.permanent
    )
    np.testing.assert_allclose(response.permanent_nt, total, rtol=1e-13)


def test_response_at_mounts_and_places_is_the_steel_there(aircraft: Aircraft, response: AircraftResponse) -> None:
    model, point = load_steel(aircraft), np.array([[0.3, -0.9, 0.4]])
    field = model.at(response.positions_m)
    np.testing.assert_array_equal(field.induced, response.induced)
    assert not np.any(field.reaction_nt)
    one = response_at(aircraft, {"somewhere": point[0]})
    np.testing.assert_array_equal(one.induced, model.at(point).induced)
    quick = model.at(point, gradient=False)
    np.testing.assert_array_equal(quick.induced, one.induced)
    assert np.all(np.isnan(quick.induced_gradient))


def test_what_the_file_allows_the_mesh_allows(aircraft: Aircraft) -> None:
    """Places that keep the element size of a plain shape are never refused for its mesh."""
    places = np.random.default_rng(2).uniform([-2.6, -0.8, -0.4], [4.5, 0.8, 1.2], (4000, 3))
    found = [aircraft.magnetics.obstacle(tuple(place.tolist())) for place in places]
    meshes = load_steel(aircraft).obstacles(places)
    assert sum(mesh is not None for mesh in meshes) > 100
    assert not [mesh for text, mesh in zip(found, meshes, strict=True) if text is None and mesh is not None]


def test_an_individual_is_asked_for_some_of_its_mounts_and_a_type_for_all(aircraft: Aircraft) -> None:
    some = ("cabin_rear", "sgl_mag_1")
    assert load_response(aircraft, mounts=some).mounts == tuple(aircraft.mounts)
    one = individual_of(aircraft, 3)
    part, whole = load_response(one, mounts=some), load_response(one)
    assert part.mounts == tuple(name for name in aircraft.mounts if name in some)
    rows = whole.rows(part.mounts)
    for name in ("positions_m", "permanent_nt", "induced", "field", "wiring_nt_per_a", "hanging"):
        expected = getattr(whole, name)[rows]
        np.testing.assert_allclose(getattr(part, name), expected, rtol=1e-10, atol=1e-12 * np.abs(expected).max())

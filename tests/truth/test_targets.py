"""Bodies in the ground against magpylib, closed forms and each other."""

import magpylib as magpy
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from magsim.earth import decimal_year, ecef_from_geodetic, igrf, rot_ne_at
from magsim.field.background.prism import prism_field
from magsim.field.background.targets import source_of, sources_of
from magsim.field.sources.dipoles import dipole_field
from magsim.scenario import Scenario
from magsim.terrain import Flat, Ground, TangentPlane
from magsim.units import MU0, NT_PER_T

HALF_M, MAGNETIZATION_APM = np.array([750.0, 10.0, 200.0]), np.array([0.3, -0.5, 1.0])
GROUND = Ground(Flat(80.0), 44.0)
START = {"lat_deg": 52.2, "lon_deg": 9.8, "alt_m": 244.0, "speed_mps": 70.0}


def scenario(*targets: dict) -> Scenario:
    return Scenario.model_validate(
        {
            "schema": 1,
            "seed": 1,
            "aircraft": "c208b",
            "start": START,
            "pattern": {"kind": "box"},
            "field": {"targets": list(targets)},
            "sensors": {"scalar": [{"name": "tail", "mount": "sgl_mag_1"}]},
        }
    )


def outside(count: int, spread: float) -> np.ndarray:
    points = np.random.default_rng(4).normal(size=(count, 3)) * HALF_M * spread
    return points[(np.abs(points) > 1.01 * HALF_M).any(axis=1)]


@pytest.mark.parametrize("spread", [1.0, 3.0])
def test_prism_agrees_with_magpylib(spread):
    points = outside(500, spread)
    ours = prism_field(HALF_M, MAGNETIZATION_APM, points)
    magnet = magpy.magnet.Cuboid(dimension=2.0 * HALF_M, magnetization=MAGNETIZATION_APM)
    theirs = magnet.getB(points) * NT_PER_T * (MU0 / magpy.mu_0)
    error = np.linalg.norm(ours - theirs, axis=1) / np.linalg.norm(theirs, axis=1)
    assert error.max() < 1e-9


def test_prism_in_line_with_its_faces_and_edges():
    """Places where single terms of the closed form are singular are the limit of their neighbors."""
    a, b, c = HALF_M
    points = np.array([[a, b, 3 * c], [a, 5 * b, c], [5 * a, b, c], [a, 0, -2 * c], [0, b, 2 * c], [-a, -b, -2 * c]])
    field = prism_field(HALF_M, MAGNETIZATION_APM, points)
    near = prism_field(HALF_M, MAGNETIZATION_APM, points * (1.0 + 1e-9))
    np.testing.assert_allclose(field, near, rtol=0, atol=1e-6 * np.abs(field).max())


def test_prism_is_a_dipole_far_away_and_cubes_add_up():
    far = np.random.default_rng(2).normal(size=(50, 3))
    far *= 60e3 / np.linalg.norm(far, axis=1)[:, None]
    dipole = dipole_field(np.zeros(3), MAGNETIZATION_APM * 8.0 * HALF_M.prod(), far)
    error = np.abs(prism_field(HALF_M, MAGNETIZATION_APM, far) - dipole).max()
    assert error < 1e-3 * np.abs(dipole).max()  # (750 m / 60 km)^2 of it
    points, half = outside(200, 2.0), np.array([HALF_M[0] / 2.0, *HALF_M[1:]])
    parts = sum(
        prism_field(half, MAGNETIZATION_APM, points - np.array([side * half[0], 0.0, 0.0])) for side in (1.0, -1.0)
    )
    np.testing.assert_allclose(parts, prism_field(HALF_M, MAGNETIZATION_APM, points), rtol=0, atol=1e-8)


def test_prism_field_has_no_divergence_and_no_curl():
    points, step = np.random.default_rng(6).normal(size=(300, 3)) * 2.0 * HALF_M, 0.02
    points = points[(np.abs(points) > HALF_M + 20.0).any(axis=1)]
    slopes = np.stack(
        [
            (
                prism_field(HALF_M, MAGNETIZATION_APM, points + step * unit)
                - prism_field(HALF_M, MAGNETIZATION_APM, points - step * unit)
            )
            / (2.0 * step)
            for unit in np.eye(3)
        ],
        axis=2,
    )
    biggest = np.abs(slopes).max()
    assert np.abs(np.trace(slopes, axis1=1, axis2=2)).max() < 1e-5 * biggest
    assert np.abs(slopes - np.swapaxes(slopes, 1, 2)).max() < 1e-5 * biggest


DIKE = {
    "kind": "prism",
    "name": "dike",
    "north_m": 1900.0,
    "east_m": -700.0,
    "depth_m": 230.0,
    "length_m": 1500.0,
    "width_m": 20.0,
    "height_m": 400.0,
    "heading_deg": 110.0,
    "susceptibility": 0.03,
    "remanence_apm": [0.3, 0.1, 1.0],
}


def main_field_at(lat: float, lon: float, alt: float) -> np.ndarray:
    return np.asarray(igrf(lat, lon, alt, decimal_year(scenario().start.time_utc)))


def test_a_dike_stands_where_and_how_it_is_told():
    """The whole way of a prism: place, depth, heading, main field, against magpylib in local axes."""
    [dike] = sources_of(scenario(DIKE), GROUND)
    plane = TangentPlane(np.radians(52.2), np.radians(9.8))
    lat, lon = (float(v) for v in plane.geodetic(np.array(1900.0), np.array(-700.0)))
    magnetization = 0.03 * main_field_at(lat, lon, 124.0 - 230.0) / (MU0 * NT_PER_T) + DIKE["remanence_apm"]
    turn = Rotation.from_euler("z", 110.0, degrees=True)
    magnet = magpy.magnet.Cuboid(dimension=(1500.0, 20.0, 400.0), magnetization=turn.inv().apply(magnetization))
    magnet.orientation = turn
    # Straight above the center the heights of the ellipsoid are those of the local axes.
    for height in (10.0, 120.0, 500.0):
        position_e = ecef_from_geodetic(lat, lon, 124.0 + height)
        got = rot_ne_at(lat, lon) @ dike.field_e(position_e[None])[0]
        wanted = magnet.getB((0.0, 0.0, -(230.0 + height))) * NT_PER_T * (MU0 / magpy.mu_0)
        np.testing.assert_allclose(got, wanted, rtol=0, atol=1e-9 * np.linalg.norm(wanted))
    # 600 m along its heading it is still there, 600 m across it is not.
    heading = np.radians(110.0)
    up = np.array([0.0, 0.0, -300.0])
    along, across = (600.0 * np.array([np.cos(a), np.sin(a), 0.0]) for a in (heading, heading + np.pi / 2))
    sizes = [np.linalg.norm(dike.field_e(dike.frame.position(p + up)[None])) for p in (along, across)]
    assert sizes[0] > 3.0 * sizes[1]


def test_a_sphere_is_the_dipole_that_demagnetization_leaves():
    """Jackson, section 5.11: m = 4 pi R^3 (mu_r - 1) / (mu_r + 2) H, plus its remanence times its volume."""
    sphere = {"kind": "sphere", "name": "ore", "lat_deg": 52.21, "lon_deg": 9.81, "depth_m": 60.0, "radius_m": 25.0}
    sphere |= {"susceptibility": 5.0, "remanence_apm": [1.0, -2.0, 0.5]}
    [ore] = sources_of(scenario(sphere), GROUND)
    lat, lon = np.radians([52.21, 9.81])
    strength = main_field_at(lat, lon, 64.0) / (MU0 * NT_PER_T)
    moment = 4.0 * np.pi * 25.0**3 * (5.0 / 8.0) * strength + 4.0 / 3.0 * np.pi * 25.0**3 * np.array([1.0, -2.0, 0.5])
    np.testing.assert_allclose(ore.moment_am2, moment, rtol=1e-12)
    magnet = magpy.magnet.Sphere(diameter=50.0, magnetization=moment / (4.0 / 3.0 * np.pi * 25.0**3))
    place_n = np.array([40.0, -30.0, -180.0])
    got = ore.frame.rot_ne @ ore.field_e(ore.frame.position(place_n)[None])[0]
    wanted = magnet.getB(place_n) * NT_PER_T * (MU0 / magpy.mu_0)
    np.testing.assert_allclose(got, wanted, rtol=0, atol=1e-9 * np.linalg.norm(wanted))


def test_a_body_is_felt_along_the_axes_of_the_place_where_it_is_felt():
    """A dipole 50 km away, in Earth-fixed axes with nothing but its formula."""
    wreck = {"kind": "dipole", "name": "far", "lat_deg": 52.6, "lon_deg": 10.2, "depth_m": 0.0}
    [far] = sources_of(scenario(wreck | {"moment_am2": [1e9, 2e9, 3e9]}), GROUND)
    lat, lon = np.radians([52.6, 10.2])
    source_e, moment_e = ecef_from_geodetic(lat, lon, 124.0), rot_ne_at(lat, lon).T @ [1e9, 2e9, 3e9]
    point_e = ecef_from_geodetic(*np.radians([52.2, 9.8]), 244.0)
    np.testing.assert_allclose(far.field_e(point_e[None])[0], dipole_field(source_e, moment_e, point_e), rtol=1e-9)


def test_distances_and_bounds():
    sources = {
        "dipole": source_of(scenario(DIPOLE).field.targets[0], scenario(DIPOLE), GROUND),
        "prism": source_of(scenario(DIKE).field.targets[0], scenario(DIKE), GROUND),
    }
    dipole, prism = sources["dipole"], sources["prism"]
    above = np.array([[0.0, 0.0, -50.0], [0.0, 30.0, -40.0], [0.0, 0.0, 0.2]])
    np.testing.assert_allclose(dipole.distance(dipole.frame.position(above)), [49.5, 49.5, -0.3], atol=1e-6)
    # The prism: 200 m below its center's height is its bottom; 10 m across its heading is its face.
    heading = np.radians(110.0)
    across = np.array([-np.sin(heading), np.cos(heading), 0.0])
    places = np.array([[0.0, 0.0, -320.0], 14.0 * across, 6.0 * across, 13.0 * across + [0.0, 0.0, 204.0]])
    np.testing.assert_allclose(prism.distance(prism.frame.position(places)), [120.0, 4.0, -4.0, 5.0], atol=1e-6)
    for source in sources.values():
        random = np.random.default_rng(8).normal(size=(3000, 3)) * 500.0
        place_e = source.frame.position(random)
        distance = source.distance(place_e)
        keep = distance > 1.0
        size = np.linalg.norm(source.field_e(place_e[keep]), axis=1)
        assert (size <= source.strongest_nt(distance[keep])).all()


DIPOLE = {
    "kind": "dipole",
    "name": "wreck",
    "north_m": 0.0,
    "east_m": 0.0,
    "depth_m": 5.0,
    "moment_am2": [2e4, 0.0, 6e4],
}

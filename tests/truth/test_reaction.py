"""What a dipole induces in the steel beside it, against the exact series of a sphere."""

from collections.abc import Callable

import numpy as np
import pytest

from magsim.field.geometry.meshes import ball, icosphere
from magsim.field.metal.steel.induced import ClosedBody, InducedModel, Part, Sheet, Solid
from magsim.field.metal.steel.reaction import dipole_charge
from tests.support import bodies

RADIUS = 0.5
POINTS = 1.5 * RADIUS * bodies.directions(30)
MOMENTS = {"along": np.array([0.0, 0.0, 1.0]), "across": np.array([1.0, 0.0, 0.0])}


def _reaction(model: InducedModel, position: np.ndarray, moment: np.ndarray) -> np.ndarray:
    return model.response(POINTS, dipole_charge(model, position, moment)[:, None])[..., 0]


def _error(model: InducedModel, factors: Callable[[int], float], distance: float, moment: np.ndarray) -> float:
    position = np.array([0.0, 0.0, distance * RADIUS])
    exact = bodies.dipole_beside_sphere(factors, RADIUS, position, moment, POINTS)
    return float(np.linalg.norm(_reaction(model, position, moment) - exact) / np.linalg.norm(exact))


def test_the_exact_series_shorts_the_field_along_a_perfect_sphere() -> None:
    position, moment = np.array([0.3, 0.2, 0.6]), np.array([0.3, -1.0, 0.5])
    surface = RADIUS * bodies.directions()
    ray = surface - position
    dist = np.linalg.norm(ray, axis=1, keepdims=True)
    direct = (3.0 * ray * (ray @ moment)[:, None] / dist**2 - moment) / (4.0 * np.pi * dist**3)
    factors = bodies.solid_factors(1e9)
    whole = direct + bodies.dipole_beside_sphere(factors, RADIUS, position, moment, surface, degrees=300)
    assert np.abs(np.cross(surface, whole)).max() < 1e-7 * RADIUS * np.abs(whole).max()


@pytest.mark.parametrize("mu", [1.1, 5.0, 100.0])
@pytest.mark.parametrize("way", MOMENTS)
def test_dipole_beside_a_sphere_by_its_surface(mu: float, way: str) -> None:
    model = InducedModel([ClosedBody(icosphere(2, RADIUS, keep="volume"), mu - 1.0)])
    assert _error(model, bodies.solid_factors(mu), 2.0, MOMENTS[way]) < 0.012
    assert _error(model, bodies.solid_factors(mu), 4.0, MOMENTS[way]) < 0.003


@pytest.mark.parametrize("mu", [1.1, 5.0, 100.0])
def test_dipole_beside_a_solid_sphere(mu: float) -> None:
    model = InducedModel([Solid(ball(2, RADIUS * np.arange(1, 4) / 3), mu - 1.0)])
    for moment in MOMENTS.values():
        assert _error(model, bodies.solid_factors(mu), 2.0, moment) < 0.012


@pytest.mark.parametrize("chi", [0.1, 4.0, 99.0])
def test_dipole_beside_a_sphere_of_sheet(chi: float) -> None:
    model = InducedModel([Sheet(icosphere(2, RADIUS, keep="area"), 0.005, chi)])
    for moment in MOMENTS.values():
        assert _error(model, bodies.sheet_factors(chi, 0.005, RADIUS), 2.0, moment) < 0.025


@pytest.mark.parametrize("kind", ["surface", "sheet"])
def test_converges_with_the_square_of_the_element(kind: str) -> None:
    position = np.array([0.0, 0.0, 1.5 * RADIUS])
    moment = MOMENTS["across"]
    factors = bodies.solid_factors(50.0) if kind == "surface" else bodies.sheet_factors(49.0, 0.01, RADIUS)
    exact = bodies.dipole_beside_sphere(factors, RADIUS, position, moment, POINTS)
    errors = []
    for subdivisions in (1, 2):
        part: Part = ClosedBody(icosphere(subdivisions, RADIUS, keep="volume"), 49.0)
        if kind == "sheet":
            part = Sheet(icosphere(subdivisions, RADIUS, keep="area"), 0.01, 49.0)
        errors.append(np.linalg.norm(_reaction(InducedModel([part]), position, moment) - exact))
    assert errors[0] / errors[1] > 3.5, errors


def test_superposition_and_no_net_charge() -> None:
    near, far = icosphere(1, 0.3, keep="volume"), icosphere(1, 0.2, keep="area")
    apart = type(far)(far.vertices + np.array([0.8, 0.0, 0.0]), far.triangles)
    model = InducedModel([ClosedBody(near, 99.0), Sheet(apart, 0.001, 300.0)])
    position = np.array([0.45, 0.5, 0.1])
    charges = np.stack([dipole_charge(model, position, moment) for moment in np.eye(3)], axis=1)
    both = dipole_charge(model, position, np.array([1.0, -2.0, 0.5]))
    np.testing.assert_allclose(both, charges @ [1.0, -2.0, 0.5], atol=1e-12 * np.abs(both).max())
    for part in (0, 1):
        rows = model.part == part
        net = model.panels.areas[rows] @ charges[rows]
        assert np.abs(net).max() < 1e-11 * (model.panels.areas[rows] @ np.abs(charges[rows])).max()

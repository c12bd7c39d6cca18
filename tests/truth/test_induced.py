"""The FE-BEM solver against exact bodies, and the invariants that every solution has."""

import numpy as np
import pytest

from magsim.field.geometry.meshes import (
    Tetrahedra,
    TriangleMesh,
    ball,
    boundary,
    box_surface,
    cylinder,
    disc_grid,
    icosphere,
)
from magsim.field.metal.steel.induced import ClosedBody, InducedModel, Sheet, Solid, charge_gradient
from tests.support import bodies
from tests.support.meshes import shell_solid

RADIUS, MU = 0.5, 100.0


def _field_error(model: InducedModel, alpha: float, distance: float) -> float:
    points = distance * bodies.directions()
    return bodies.field_error(model.response(points), alpha, points)


def _sphere(subdivisions: int, layers: int, mu: float = MU) -> InducedModel:
    radii = RADIUS * np.arange(1, layers + 1) / layers
    return InducedModel([Solid(ball(subdivisions, radii), mu - 1.0)])


def _sphere_moment(mu: float) -> float:
    return bodies.sphere_moment(mu, RADIUS)


@pytest.fixture(scope="module")
def spheres() -> list[InducedModel]:
    return [_sphere(subdivisions, layers) for subdivisions, layers in ((1, 2), (2, 3), (3, 4))]


def test_sphere_of_320_triangles(spheres: list[InducedModel]) -> None:
    assert len(spheres[1].panels) == 320
    assert _field_error(spheres[1], _sphere_moment(MU), 1.5 * RADIUS) < 0.003
    assert _field_error(spheres[1], _sphere_moment(MU), 3.0 * RADIUS) < 0.00024
    np.testing.assert_allclose(np.diag(spheres[1].moment()), _sphere_moment(MU), rtol=1.6e-4)


def test_sphere_converges_with_the_square_of_the_element(spheres: list[InducedModel]) -> None:
    errors = np.array([_field_error(model, _sphere_moment(MU), 1.5 * RADIUS) for model in spheres])
    orders = np.log2(errors[:-1] / errors[1:])
    assert np.all(orders > 1.8), (errors, orders)


@pytest.mark.parametrize("mu", [1.0 + 1e-6, 2.0, 100.0])
def test_sphere_by_its_surface_alone(mu: float) -> None:
    model = InducedModel([ClosedBody(icosphere(2, RADIUS, keep="volume"), mu - 1.0)])
    assert _field_error(model, _sphere_moment(mu), 1.5 * RADIUS) < 0.003
    np.testing.assert_allclose(np.diag(model.moment()), _sphere_moment(mu), rtol=2e-4)
    areas, charge = model.panels.areas, model.uniform
    assert np.abs(areas @ charge).max() < 1e-11 * (areas @ np.abs(charge)).max()


def test_surface_of_a_block_is_the_block() -> None:
    """Tetrahedra and the closed surface of the same cylinder differ by less than either errs."""
    solid = cylinder((0.0, 0.0, 0.0), (0.0, 0.6, 0.8), radius=0.2, length=0.8, rings=4, layers=8)
    surface = TriangleMesh(solid.vertices, boundary(solid))
    used, triangles = np.unique(surface.triangles, return_inverse=True)
    body = ClosedBody(TriangleMesh(solid.vertices[used], triangles.reshape(-1, 3)), 9.0)
    points = np.array([[0.5, 0.0, 0.1], [0.1, 0.6, 0.6]])
    filled, hollow = (InducedModel([part]).response(points) for part in (Solid(solid, 9.0), body))
    np.testing.assert_allclose(hollow, filled, atol=0.01 * np.abs(filled).max())


def test_hollow_body_is_a_thick_shell() -> None:
    """A sphere with a hollow: two closed surfaces, the inner one turned inward."""
    outer, inner = icosphere(2, RADIUS, keep="volume"), icosphere(2, 0.7 * RADIUS, keep="volume")
    vertices = np.vstack([outer.vertices, inner.vertices])
    triangles = np.vstack([outer.triangles, inner.triangles[:, ::-1] + len(outer.vertices)])
    model = InducedModel([ClosedBody(TriangleMesh(vertices, triangles), 4.0)])
    exact = bodies.shell_moment(5.0, 0.7 * RADIUS, RADIUS)
    np.testing.assert_allclose(np.diag(model.moment()), exact, rtol=2e-3)


def test_sphere_of_strong_iron() -> None:
    assert _field_error(_sphere(2, 3, mu=1000.0), _sphere_moment(1000.0), 1.5 * RADIUS) < 0.003


def test_prolate_spheroid() -> None:
    mesh = ball(2, RADIUS * np.arange(1, 4) / 3)
    stretched = Tetrahedra(mesh.vertices * [3.0, 1.0, 1.0], mesh.cells, mesh.layer)
    alpha = InducedModel([Solid(stretched, MU - 1.0)]).moment()
    np.testing.assert_allclose(np.diag(alpha), bodies.spheroid_moments(MU, 3.0, RADIUS), rtol=3e-4)


def test_layered_sphere_converges_to_the_exact_moment() -> None:
    """A core of mu 100 up to 0.7 in a shell of mu 5: wrong in the limit without charge on the interface."""
    core, shell, inner, outer = 100.0, 5.0, 0.7, 1.0
    exact = bodies.layered_moment(core, shell, inner, outer)
    errors = []
    for subdivisions, layers in ((1, 2), (2, 4)):
        radii = np.concatenate([inner * np.arange(1, layers + 1) / layers, np.linspace(inner, outer, layers + 1)[1:]])
        mesh = ball(subdivisions, radii)
        chi = np.where(mesh.layer < layers, core - 1.0, shell - 1.0)
        model = InducedModel([Solid(mesh, chi)])
        assert len(model.panels) == 2 * 20 * 4**subdivisions
        errors.append(abs(model.moment()[0, 0] / exact - 1.0))
    assert errors[0] < 0.0272
    assert errors[1] < 0.0102
    assert errors[0] / errors[1] > 2.0


def test_thick_shell_of_prisms() -> None:
    exact = bodies.shell_moment(200.0, 0.95 * RADIUS, RADIUS)
    model = InducedModel([Solid(shell_solid(2, 0.95 * RADIUS, RADIUS), 199.0)])
    assert _field_error(model, exact, 1.5 * RADIUS) < 0.01
    inside = model.response(np.zeros((1, 3)))[0] + np.eye(3)
    shielded = bodies.shell_inside(200.0, 0.95 * RADIUS, RADIUS)
    np.testing.assert_allclose(inside, shielded * np.eye(3), atol=0.05 * shielded)


def test_thin_sheet_is_a_shell_of_the_same_thickness() -> None:
    """1 mm of steel on a sphere of 0.5 m; the radius of the sheet is that of its middle."""
    model = InducedModel([Sheet(icosphere(2, 0.4995, keep="area"), 0.001, 199.0)])
    exact = bodies.shell_moment(200.0, 0.499, 0.5)
    assert _field_error(model, exact, 0.75) < 0.0138
    assert _field_error(model, exact, 1.5) < 0.0108


def test_permeable_disc_converges_to_its_exact_moment() -> None:
    """chi t -> infinity, field in the plane: m = 16/3 a^3; the charge is singular at the rim, so the order is 1."""
    errors = []
    for rings in (4, 8, 16):
        flat, triangles = disc_grid(rings, 1.0)
        vertices = np.column_stack([flat, np.zeros(len(flat))])
        alpha = InducedModel([Sheet(TriangleMesh(vertices, triangles), 1.0, 1e7)]).moment()
        np.testing.assert_allclose(alpha[0, 0], alpha[1, 1], rtol=1e-6)
        assert abs(alpha[2, 2]) < 1e-9
        errors.append(abs(alpha[0, 0] / (16.0 / 3.0) - 1.0))
    assert errors[0] < 0.158
    assert errors[2] < 0.032
    assert errors[0] / errors[1] > 1.7
    assert errors[1] / errors[2] > 1.7


def test_rings_graded_toward_the_rim_restore_the_second_order() -> None:
    errors = []
    for rings in (4, 8):
        flat, triangles = disc_grid(rings, 1.0)
        alpha = InducedModel([Sheet(TriangleMesh(bodies.graded_disc(flat), triangles), 1.0, 1e7)]).moment()
        errors.append(abs(alpha[0, 0] / (16.0 / 3.0) - 1.0))
    assert errors[1] < 0.01
    assert np.log2(errors[0] / errors[1]) > 1.8


def test_the_sense_of_a_sheet_does_not_matter() -> None:
    mesh = box_surface((0.0, 0.0, 0.0), (1.0, 0.8, 0.6), 0.25)
    mixed = mesh.triangles.copy()
    mixed[::3] = mixed[::3, ::-1]
    one, other = (InducedModel([Sheet(m, 0.001, 99.0)]).moment() for m in (mesh, TriangleMesh(mesh.vertices, mixed)))
    np.testing.assert_allclose(one, other, atol=1e-12 * one.max())


TANK = box_surface((-1.8, 0.0, 0.4), (1.0, 0.8, 0.6), 0.1)
ENGINE = cylinder((3.4, 0.0, 0.0), (1.0, 0.0, 0.0), radius=0.24, length=1.4, rings=3, layers=8)


@pytest.fixture(scope="module")
def aircraft() -> InducedModel:
    return InducedModel([Sheet(TANK, 0.0015, 199.0), Solid(ENGINE, 99.0)])


def test_no_net_charge(aircraft: InducedModel) -> None:
    areas, charge = aircraft.panels.areas, aircraft.uniform
    assert np.abs(areas @ charge).max() < 1e-11 * (areas @ np.abs(charge)).max()


def test_polarizability_is_symmetric_and_positive(aircraft: InducedModel) -> None:
    alpha = aircraft.moment()
    assert np.abs(alpha - alpha.T).max() < 1e-13 * np.abs(alpha).max()
    assert np.linalg.eigvalsh(alpha).min() > 0.0


def test_polarizability_rises_with_the_permeability() -> None:
    eigenvalues = np.array(
        [np.linalg.eigvalsh(InducedModel([Sheet(TANK, 0.0015, mu - 1.0)]).moment()) for mu in (10, 100, 1000, 1e7, 1e9)]
    )
    assert np.all(np.diff(eigenvalues, axis=0) > 0.0)
    np.testing.assert_allclose(eigenvalues[-1], eigenvalues[-2], rtol=1e-3)


def _weak_error(rings: int, layers: int) -> float:
    """Error of D / chi for mu -> 1 against the volume integral of the dipole kernel, 4 points in each cell."""
    mesh = cylinder((3.4, 0.0, 0.0), (1.0, 0.0, 0.0), radius=0.24, length=1.4, rings=rings, layers=layers)
    points = np.array([[2.2, 0.3, 0.4], [3.5, 0.9, -0.2], [4.6, -0.6, 0.5]])
    response = InducedModel([Solid(mesh, 1e-6)]).response(points) / 1e-6
    corners = mesh.vertices[mesh.cells]
    volumes = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6.0
    a, b = 0.5854101966249685, 0.1381966011250105
    nodes = np.einsum("qc,ecx->eqx", np.full((4, 4), b) + (a - b) * np.eye(4), corners).reshape(-1, 3)
    weights = np.repeat(volumes / 4.0, 4)
    kernels = (bodies.dipole_tensor(np.eye(3), point - nodes) for point in points)
    exact = np.stack([np.einsum("q,qij->ij", weights, kernel) for kernel in kernels])
    return float((np.abs(response - exact).max(axis=(1, 2)) / np.abs(exact).max(axis=(1, 2))).max())


def test_weak_material_is_a_cloud_of_dipoles() -> None:
    coarse, fine = _weak_error(3, 8), _weak_error(5, 14)
    assert coarse < 2e-3
    assert fine < 1e-3
    assert coarse / fine > 2.5


def test_superposition_of_ambient_fields(aircraft: InducedModel) -> None:
    ambient = np.array([0.3, -1.2, 0.7])
    together = aircraft.charge(-(aircraft.nodes @ ambient)[:, None])[:, 0]
    np.testing.assert_allclose(together, aircraft.uniform @ ambient, atol=1e-12 * np.abs(together).max())


def test_far_field_is_that_of_the_moment() -> None:
    model = InducedModel([Sheet(box_surface((0.0, 0.0, 0.0), (1.0, 0.8, 0.6), 0.1), 0.0015, 199.0)])
    points = 20.0 * bodies.directions()
    exact = bodies.dipole_tensor(model.moment(), points)
    error = np.linalg.norm(model.response(points) - exact, axis=(1, 2)) / np.linalg.norm(exact, axis=(1, 2))
    assert error.max() < 0.005


def test_parts_far_apart_do_not_feel_each_other_and_near_ones_do() -> None:
    far, alone = box_surface((900.0, 0.0, 0.0), (1.0, 0.8, 0.6), 0.25), box_surface((0, 0, 0), (1.0, 0.8, 0.6), 0.25)
    near = box_surface((1.1, 0.0, 0.0), (1.0, 0.8, 0.6), 0.25)
    one = InducedModel([Sheet(alone, 0.0015, 199.0)]).moment()
    apart = InducedModel([Sheet(alone, 0.0015, 199.0), Sheet(far, 0.0015, 199.0)]).moment()
    close = InducedModel([Sheet(alone, 0.0015, 199.0), Sheet(near, 0.0015, 199.0)]).moment()
    np.testing.assert_allclose(apart, 2.0 * one, rtol=1e-6, atol=1e-6 * one.max())
    # In line with the field two magnets help each other, side by side they weaken each other.
    assert close[0, 0] > 2.05 * one[0, 0]
    assert close[1, 1] < 1.98 * one[1, 1]


def test_gradient_by_finite_differences(aircraft: InducedModel) -> None:
    points = np.array([[0.0, 0.0, 0.0], [-3.0, 0.2, 0.1], [2.2, -0.4, 0.3]])
    exact, step = charge_gradient(aircraft.panels, aircraft.uniform, points), 1e-3
    for axis, e in enumerate(step * np.eye(3)):
        at = [aircraft.response(points + k * e) for k in (-2, -1, 1, 2)]
        slope = (at[0] - 8 * at[1] + 8 * at[2] - at[3]) / (12 * step)
        scale = np.abs(exact).max(axis=(1, 2, 3))[:, None, None]
        assert np.abs((slope - exact[..., axis]) / scale).max() < 1e-6
    # For each ambient field the induced field has neither sources nor currents: i and j of (p, i, k, j).
    scale = np.abs(exact).max()
    assert np.abs(np.einsum("piki->pk", exact)).max() < 1e-12 * scale
    assert np.abs(exact - np.swapaxes(exact, 1, 3)).max() < 1e-12 * scale


# Ottawa, level, heading north; printed for a prototype of the same method and the same stylized parts.
OTTAWA = np.array([18193.0, -4077.0, 49954.0])


@pytest.mark.parametrize(
    ("mu", "whole", "along"), [(100.0, 200.0, -180.0), (200.0, 339.0, -298.0), (1000.0, 785.0, -654.0)]
)
def test_tank_in_the_cabin_as_another_program_has_it(mu: float, whole: float, along: float) -> None:
    field = InducedModel([Sheet(TANK, 0.0015, mu - 1.0)]).response(np.zeros((1, 3)))[0] @ OTTAWA
    assert np.linalg.norm(field) == pytest.approx(whole, abs=0.01 * whole)
    assert field @ OTTAWA / np.linalg.norm(OTTAWA) == pytest.approx(along, abs=0.01 * whole)


def test_a_finer_tank_changes_nothing() -> None:
    points = np.array([[0.0, 0.0, 0.0], [-3.0, 0.0, 0.0], [-11.2, 0.0, -0.4]])
    fine = box_surface((-1.8, 0.0, 0.4), (1.0, 0.8, 0.6), 0.05)
    coarse, better = (InducedModel([Sheet(mesh, 0.0015, 199.0)]).response(points) for mesh in (TANK, fine))
    scale = np.abs(better).max(axis=(1, 2), keepdims=True)
    assert np.abs((coarse - better) / scale).max() < 2e-3


def test_aluminum_fuselage_is_nothing() -> None:
    skin = box_surface((-1.0, 0.0, 0.0), (8.0, 1.6, 1.6), 0.4)
    field = InducedModel([Sheet(skin, 0.001, 2.2e-5)]).response(np.zeros((1, 3)))[0] @ OTTAWA
    assert 0.0 < np.linalg.norm(field) < 0.001


def test_touching_parts_are_refused() -> None:
    left, right = box_surface((0, 0, 0), (1, 1, 1), 0.5), box_surface((1, 0, 0), (1, 1, 1), 0.5)
    with pytest.raises(ValueError, match="touch or overlap"):
        InducedModel([Sheet(left, 0.001, 99.0), Sheet(right, 0.001, 99.0)])


def test_nothing_to_magnetize_is_refused() -> None:
    with pytest.raises(ValueError, match="no soft-magnetic part"):
        InducedModel([])

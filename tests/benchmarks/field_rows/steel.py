"""Steel: bodies with exact answers, and what every solution must be."""

import time

import numpy as np
from threadpoolctl import threadpool_limits

from magsim.aircraft import load_aircraft
from magsim.field.geometry.meshes import Tetrahedra, TriangleMesh, ball, box_surface, disc_grid, icosphere
from magsim.field.metal.steel.induced import ClosedBody, InducedModel, Part, Sheet, Solid, charge_gradient
from magsim.field.metal.steel.meshing import check_apart, steel_parts
from magsim.field.metal.steel.reaction import dipole_charge
from tests.benchmarks.rows import Row, at_least, at_most, stated
from tests.support import bodies
from tests.support.meshes import shell_solid
from tests.support.steel_kinds import ALL_KINDS, steel

RADIUS, MU = 0.5, 100.0
OTTAWA = np.array([18193.0, -4077.0, 49954.0])


def _error_pct(parts: list[Part], alpha: float, distance: float) -> float:
    points = distance * bodies.directions()
    return 100.0 * bodies.field_error(InducedModel(parts).response(points), alpha, points)


def _ball(subdivisions: int, layers: int) -> Tetrahedra:
    return ball(subdivisions, RADIUS * np.arange(1, layers + 1) / layers)


def _exact_bodies() -> list[Row]:
    exact, near = bodies.sphere_moment(MU, RADIUS), 1.5 * RADIUS
    errors = [_error_pct([Solid(_ball(k, k + 1), MU - 1.0)], exact, near) for k in (1, 2, 3)]
    closed = _error_pct([ClosedBody(icosphere(3, RADIUS, keep="volume"), MU - 1.0)], exact, near)
    thick = Solid(shell_solid(3, 0.95 * RADIUS, RADIUS), 199.0)
    thin = Sheet(icosphere(3, 0.4995, keep="area"), 0.001, 199.0)
    mesh = _ball(3, 3)
    long = Solid(Tetrahedra(mesh.vertices * [3.0, 1.0, 1.0], mesh.cells, mesh.layer), MU - 1.0)
    moments = np.diag(InducedModel([long]).moment()) / bodies.spheroid_moments(MU, 3.0, RADIUS) - 1.0
    return [
        at_most("sphere_320_error_pct", errors[1], "%", 0.2),
        at_most("sphere_1280_error_pct", errors[2], "%", 0.05),
        at_least("sphere_order", float(np.log2(np.divide(errors[:2], errors[1:])).min()), "", 1.8),
        at_most("sphere_by_its_surface_1280_error_pct", closed, "%", 0.05),
        at_most("shell_error_pct", _error_pct([thick], bodies.shell_moment(200.0, 0.475, 0.5), near), "%", 0.2),
        at_most("sheet_error_pct", _error_pct([thin], bodies.shell_moment(200.0, 0.499, 0.5), near), "%", 0.5),
        at_most("spheroid_moment_error_pct", 100.0 * float(np.abs(moments).max()), "%", 0.01),
    ]


def _disc_error(rings: int) -> float:
    """Of the in-plane moment 16/3 a^3 of a disc that shorts every field, with rings graded as sheets are."""
    flat, triangles = disc_grid(rings, 1.0)
    sheet = Sheet(TriangleMesh(bodies.graded_disc(flat), triangles), 1.0, 1e7)
    return abs(InducedModel([sheet]).moment()[0, 0] / (16.0 / 3.0) - 1.0)


def _edges_and_layers() -> list[Row]:
    coarse, fine = _disc_error(8), _disc_error(16)
    inner = 0.7
    mesh = ball(3, np.concatenate([inner * np.arange(1, 5) / 4, np.linspace(inner, 1.0, 5)[1:]]))
    chi = np.where(mesh.layer < 4, 99.0, 4.0)
    layered = InducedModel([Solid(mesh, chi)]).moment()[0, 0] / bodies.layered_moment(100.0, 5.0, inner, 1.0) - 1.0
    return [
        stated("permeable_disc_moment_error_pct", 100.0 * fine, "%"),
        at_least("permeable_disc_order", float(np.log2(coarse / fine)), "", 1.8),
        at_most("layered_sphere_moment_error_pct", 100.0 * abs(layered), "%", 0.6),
    ]


def _beside(part: Part, factors: object) -> float:
    """Error of the field of what a dipole at 1.5 radii, across, induces; over the exact one at 1.5 radii."""
    position, moment = np.array([0.0, 0.0, 1.5 * RADIUS]), np.array([1.0, 0.0, 0.0])
    points = 1.5 * RADIUS * bodies.directions(30)
    model = InducedModel([part])
    got = model.response(points, dipole_charge(model, position, moment)[:, None])[..., 0]
    exact = bodies.dipole_beside_sphere(factors, RADIUS, position, moment, points)
    return 100.0 * float(np.linalg.norm(got - exact) / np.linalg.norm(exact))


def _reactions() -> list[Row]:
    solid, surface = Solid(_ball(3, 4), MU - 1.0), ClosedBody(icosphere(3, RADIUS, keep="volume"), MU - 1.0)
    sheet = Sheet(icosphere(3, RADIUS, keep="area"), 0.005, MU - 1.0)
    return [
        at_most("dipole_beside_sphere_error_pct", _beside(solid, bodies.solid_factors(MU)), "%", 0.5),
        at_most("dipole_beside_surface_error_pct", _beside(surface, bodies.solid_factors(MU)), "%", 0.5),
        at_most("dipole_beside_sheet_error_pct", _beside(sheet, bodies.sheet_factors(99.0, 0.005, RADIUS)), "%", 1.0),
    ]


def _invariants() -> list[Row]:
    """Of the steel of the Cessna 208B, in the cabin."""
    model = InducedModel(list(steel_parts(load_aircraft("c208b").magnetics.steel).values()))
    alpha, cabin = model.moment(), np.zeros((1, 3))
    ambient = np.array([0.3, -1.2, 0.7])
    together = model.charge(-(model.nodes @ ambient)[:, None])[:, 0]
    slope = charge_gradient(model.panels, model.uniform, cabin)[0]
    scale = np.abs(slope).max()
    response = model.response(cabin)[0]
    charges = np.stack([dipole_charge(model, cabin[0], moment) for moment in np.eye(3)], axis=1)
    reciprocal = np.abs(model.moment(charges).T - response).max() / np.abs(response).max()
    tank = InducedModel([Sheet(box_surface((0.0, 0.0, 0.0), (1.0, 0.8, 0.6), 0.1), 0.0015, 199.0)])
    far = 20.0 * bodies.directions()
    dipole = bodies.dipole_tensor(tank.moment(), far)
    off = 100.0 * float(np.abs(tank.response(far) - dipole).max() / np.abs(dipole).max())
    return [
        at_most("polarizability_asymmetry", float(np.abs(alpha - alpha.T).max() / np.abs(alpha).max()), "", 1e-12),
        at_least("polarizability_least_eigenvalue_m3", float(np.linalg.eigvalsh(alpha).min()), "m^3", 0.0),
        at_most(
            "superposition_error",
            float(np.abs(together - model.uniform @ ambient).max() / np.abs(together).max()),
            "",
            1e-12,
        ),
        at_most("induced_gradient_divergence", float(np.abs(np.einsum("iki->k", slope)).max() / scale), "", 1e-12),
        at_most("induced_gradient_curl", float(np.abs(slope - np.swapaxes(slope, 0, 2)).max() / scale), "", 1e-12),
        at_most("reciprocity_error_pct", 100.0 * float(reciprocal), "%", 0.5),
        at_most("far_field_error_pct", off, "%", 0.5),
    ]


def _fuselage() -> Row:
    skin = Sheet(box_surface((-1.0, 0.0, 0.0), (8.0, 1.6, 1.6), 0.4), 0.001, 2.2e-5)
    field = InducedModel([skin]).response(np.zeros((1, 3)))[0] @ OTTAWA
    return at_most("aluminum_fuselage_nt", float(np.linalg.norm(field)), "nT", 0.001)


def _time() -> Row:
    """Processor time for tank, engine, firewall, seat rails, engine mount, gear legs and ballast, on one thread."""
    with threadpool_limits(limits=1):
        start = time.process_time()
        parts = steel_parts(steel(*ALL_KINDS))
        check_apart(parts)
        model = InducedModel(list(parts.values()))
        model.response(np.zeros((1, 3)))
        return at_most("steel_of_all_kinds_s", time.process_time() - start, "s", 10.0)


def rows() -> list[Row]:
    """All figures of the induced field."""
    return [*_exact_bodies(), *_edges_and_layers(), *_reactions(), *_invariants(), _fuselage(), _time()]

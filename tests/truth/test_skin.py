"""Eddy currents in thin shells against exact answers, and what the matrices of every shell must be."""

import numpy as np
import pytest
from scipy.linalg import eigh

from magsim.field.geometry.meshes import TriangleMesh, disc_grid, icosphere
from magsim.field.metal.eddy import reduce_to_modes, slow_limit
from magsim.field.metal.skin.shells import ThinShells, driven_modes, phasor_streams, stream_field
from magsim.units import MU0
from tests.support.skins import time_constants

RADIUS, CONDUCTANCE = 0.8, 1.74e4
TAU_1 = MU0 * CONDUCTANCE * RADIUS / 3.0


def _sphere(subdivisions: int) -> ThinShells:
    return ThinShells(icosphere(subdivisions, RADIUS, keep="area"), CONDUCTANCE)


def _join(*meshes: TriangleMesh) -> TriangleMesh:
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    triangles = [mesh.triangles + start for mesh, start in zip(meshes, starts, strict=False)]
    return TriangleMesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(triangles))


@pytest.fixture(scope="module")
def spheres() -> list[ThinShells]:
    return [_sphere(subdivisions) for subdivisions in (1, 2, 3)]


@pytest.mark.parametrize(("degree", "first", "limit"), [(1, 0, 0.002), (2, 3, 0.01), (3, 8, 0.02)])
def test_time_constants_of_a_spherical_shell(spheres: list[ThinShells], degree: int, first: int, limit: float) -> None:
    """mu0 sigma t a / (2 l + 1), each 2 l + 1 times; the error falls with the square of the element."""
    exact = MU0 * CONDUCTANCE * RADIUS / (2 * degree + 1)
    errors = []
    for sphere in spheres:
        tau = time_constants(sphere, 15)[first : first + 2 * degree + 1]
        assert np.ptp(tau) < 0.03 * exact
        errors.append(1.0 - tau.mean() / exact)
    assert 0.0 < errors[2] < limit
    assert np.log2(errors[1] / errors[2]) > 1.8


@pytest.mark.parametrize("frequency_hz", [1.0, 100.0])
def test_spherical_shell_in_a_swinging_field(spheres: list[ThinShells], frequency_hz: float) -> None:
    """m = -(2 pi a^3 / mu0) B_0 i w tau / (1 + i w tau), and outside the field of that dipole."""
    omega = 2j * np.pi * frequency_hz
    modes = driven_modes(spheres[2], 4)
    gain = -omega / (1.0 + omega * modes.tau_s)
    moment = np.einsum("ki,k,kj->ij", modes.drive, gain, modes.drive)
    exact = -2.0 * np.pi * RADIUS**3 / MU0 * omega * TAU_1 / (1.0 + omega * TAU_1)
    assert np.abs(moment - exact * np.eye(3)).max() < 0.003 * abs(exact)
    unit = np.array([[0.48, 0.6, 0.64], [1.0, 0.0, 0.0], [0.0, -0.6, 0.8]])
    distance = 1.5 * RADIUS
    dipole = MU0 * exact / (4.0 * np.pi * distance**3) * (3.0 * unit[:, :, None] * unit[:, None, :] - np.eye(3))
    fields = stream_field(spheres[2].surface, modes.streams, distance * unit)
    got = np.einsum("pik,k,kj->pij", fields, gain, modes.drive)
    assert np.abs(got - dipole).max() < 0.004 * np.abs(dipole).max()


def test_uniform_field_inside_a_sphere_with_a_linear_stream_function(spheres: list[ThinShells]) -> None:
    """psi = M z is the surface current of a uniformly magnetized sphere: inside B = 2/3 mu0 M."""
    surface = spheres[2].surface
    inside = np.array([[0.0, 0.0, 0.0], [0.3, -0.2, 0.25], [-0.1, 0.4, -0.2]])
    field = stream_field(surface, surface.vertices[:, 2:], inside)[..., 0]
    assert np.abs(field - 2.0 / 3.0 * MU0 * np.array([0.0, 0.0, 1.0])).max() < 0.004 * MU0


def test_two_concentric_shells_that_touch_nowhere() -> None:
    """Each sees the other's flux: for l = 1 the time constants are the eigenvalues of a matrix of two by two."""
    inner, outer, thick = 0.5, 0.8, 3.0e4
    mesh = _join(icosphere(3, inner, keep="area"), icosphere(3, outer, keep="area"))
    count = len(mesh.triangles) // 2
    shells = ThinShells(mesh, np.repeat([thick, CONDUCTANCE], count))
    matrix = (
        MU0 / 3.0 * np.array([[thick * inner, thick * inner], [CONDUCTANCE * inner**3 / outer**2, CONDUCTANCE * outer]])
    )
    exact = np.sort(np.linalg.eigvals(matrix).real)[::-1]
    modes = driven_modes(shells, 4)
    got = modes.tau_s[np.argsort(-np.linalg.norm(modes.drive, axis=1))][:6]
    np.testing.assert_allclose(np.sort(got)[::-1], np.repeat(exact, 3), rtol=0.004)


@pytest.mark.parametrize(("rings", "limit"), [(4, 0.02), (8, 0.006), (16, 0.0015)])
def test_disc_in_a_slowly_changing_field(rings: int, limit: float) -> None:
    """m = -(pi sigma t a^4 / 8) dB/dt: no current leaves through the rim."""
    flat, triangles = disc_grid(rings, RADIUS)
    disc = ThinShells(TriangleMesh(np.column_stack([flat, np.zeros(len(flat))]), triangles), CONDUCTANCE)
    modes = driven_modes(disc, 1)
    assert len(modes.tau_s) == 1
    moment = np.einsum("ki,kj->ij", modes.drive, modes.drive)
    exact = np.pi * CONDUCTANCE * RADIUS**4 / 8.0
    assert abs(moment[2, 2] / exact - 1.0) < limit
    assert np.abs(moment[:2]).max() < 1e-12 * exact


def test_ring_with_a_hole() -> None:
    """m = -(pi sigma t (b^4 - a^4) / 8) dB/dt: the current flows around the hole, where psi is one unknown."""
    flat, triangles = disc_grid(16, RADIUS)
    away = np.linalg.norm(flat[triangles], axis=2).max(axis=1) > 0.51 * np.linalg.norm(flat, axis=1).max()
    used, number = np.unique(triangles[away], return_inverse=True)
    ring = TriangleMesh(np.column_stack([flat[used], np.zeros(len(used))]), number.reshape(-1, 3))
    shells = ThinShells(ring, CONDUCTANCE)
    rim = np.flatnonzero(np.isclose(np.linalg.norm(flat[used], axis=1), np.linalg.norm(flat[used], axis=1).min()))
    assert len(np.unique(shells.unknowns[rim])) == 1
    modes = driven_modes(shells, 1)
    hole = np.linalg.norm(flat[used], axis=1).min()
    exact = np.pi * CONDUCTANCE * (RADIUS**4 - hole**4) / 8.0
    assert float((modes.drive**2).sum()) == pytest.approx(exact, rel=0.002)


def test_matrices_are_symmetric_and_positive(spheres: list[ThinShells]) -> None:
    sphere = spheres[1]
    for matrix in (sphere.inductance, sphere.resistance.toarray()):
        np.testing.assert_allclose(matrix, matrix.T, rtol=0.0, atol=1e-15 * np.abs(matrix).max())
        assert np.linalg.eigvalsh(matrix).min() > 0.0
    assert len(sphere.inductance) == len(sphere.surface.vertices) - 1


def test_energy_of_a_linear_stream_function(spheres: list[ThinShells]) -> None:
    """psi = M z on a sphere: half psi L psi is the energy of the field of a magnetized sphere, 4/9 pi mu0 M^2 a^3."""
    sphere = spheres[2]
    psi = sphere.surface.vertices[:, 2] - sphere.surface.vertices[sphere.unknowns < 0, 2]
    free = psi[sphere.unknowns >= 0]
    assert 0.5 * free @ sphere.inductance @ free == pytest.approx(4.0 / 9.0 * np.pi * MU0 * RADIUS**3, rel=0.004)


def test_few_driven_modes_give_what_all_modes_give() -> None:
    """Eighteen modes beside the whole eigenproblem, on a body without symmetry, near it and far away."""
    mesh = icosphere(2, 1.0)
    bent = mesh.vertices * [1.6, 0.7, 0.5] + 0.1 * mesh.vertices[:, [1, 2, 0]] ** 2
    shells = ThinShells(TriangleMesh(bent, mesh.triangles), np.linspace(1.0, 2.0, len(mesh.triangles)) * 1e4)
    points = np.array([[0.1, 0.1, 0.0], [1.2, 0.0, 0.1], [3.0, 2.0, 1.0], [-4.0, 0.3, 0.2]])
    every = reduce_to_modes(shells.inductance, shells.resistance.toarray(), shells.flux, shells.field(points))
    few = driven_modes(shells, 6)
    assert len(few.tau_s) == 18
    fields = stream_field(shells.surface, few.streams, points)
    assert every.tau_s[0] >= few.tau_s[0] * (1.0 - 1e-9)
    np.testing.assert_allclose(-np.einsum("sik,kj->sij", fields, few.drive), slow_limit(every), atol=1e-10 * 0.02)
    for frequency_hz, limit in ((0.5, 1e-9), (5.0, 1e-7), (50.0, 1e-2)):
        omega = 2j * np.pi * frequency_hz
        exact = np.einsum("sik,k,kj->sij", every.field, -omega / (1.0 + omega * every.tau_s), every.drive)
        got = np.einsum("sik,k,kj->sij", fields, -omega / (1.0 + omega * few.tau_s), few.drive)
        error = np.linalg.norm(got - exact, axis=(1, 2)) / np.linalg.norm(exact, axis=(1, 2))
        assert error.max() < limit


def test_phasor_and_longest_time_constants_beside_dense_algebra(spheres: list[ThinShells]) -> None:
    sphere = spheres[1]
    omega = 2j * np.pi * 3.0
    resistance = sphere.resistance.toarray()
    exact = sphere.spread @ np.linalg.solve(resistance + omega * sphere.inductance, -omega * sphere.flux)
    np.testing.assert_allclose(phasor_streams(sphere, 3.0), exact, atol=1e-9 * np.abs(exact).max())
    tau = eigh(sphere.inductance, resistance, eigvals_only=True)[::-1]
    np.testing.assert_allclose(time_constants(sphere, 8), tau[:8], rtol=1e-9)
    with pytest.raises(ValueError, match="lag too far"):
        phasor_streams(sphere, 100.0)

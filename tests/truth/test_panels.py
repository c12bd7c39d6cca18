"""Integrals over triangles against quadrature, finite differences and closed forms."""

import numpy as np
import pytest

from magsim.field.geometry.meshes import box_surface, icosphere
from magsim.field.geometry.panels import (
    RULE_7,
    RULE_28,
    Panels,
    gradient,
    hessian,
    mutual_potentials,
    potential,
    solid_angle,
)

CORNERS = np.array(
    [
        [[0.0, 0.0, 0.0], [1.0, 0.1, 0.2], [0.3, 0.9, -0.1]],
        [[0.5, -0.2, 0.4], [0.7, 1.1, 0.1], [-0.9, 0.2, 0.3]],
        [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 0.05, 0.0]],
    ]
)


@pytest.fixture(scope="module")
def panels() -> Panels:
    return Panels(CORNERS)


@pytest.fixture(scope="module")
def points() -> np.ndarray:
    return np.random.default_rng(3).normal(size=(40, 3)) * 1.5 + [0.0, 0.0, 0.4]


def _refined(corners: np.ndarray, levels: int) -> np.ndarray:
    triangles = corners[None]
    for _ in range(levels):
        a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        triangles = np.concatenate([np.stack(part, axis=1) for part in parts])
    return triangles


def test_potential_against_brute_quadrature(panels: Panels, points: np.ndarray) -> None:
    exact = potential(panels, points)
    for t, corners in enumerate(CORNERS):
        fine = Panels(_refined(corners, 5))
        nodes = fine.points(RULE_7[0])
        weights = fine.areas[:, None] * RULE_7[1]
        for p, point in enumerate(points):
            brute = (weights / np.linalg.norm(nodes - point, axis=-1)).sum()
            assert exact[p, t] == pytest.approx(brute, rel=1e-6)


def test_potential_of_a_far_point(panels: Panels) -> None:
    point = np.array([[300.0, -400.0, 1200.0]])
    np.testing.assert_allclose(potential(panels, point)[0], panels.areas / 1300.0, rtol=2e-3)


def test_gradient_by_finite_differences(panels: Panels, points: np.ndarray) -> None:
    step, exact = 1e-3, gradient(panels, points)
    for axis, e in enumerate(step * np.eye(3)):
        at = [potential(panels, points + k * e) for k in (-2, -1, 1, 2)]
        slope = (at[0] - 8 * at[1] + 8 * at[2] - at[3]) / (12 * step)
        assert np.abs(slope - exact[..., axis]).max() < 1e-7 * np.abs(exact).max()


def test_hessian_by_finite_differences(panels: Panels, points: np.ndarray) -> None:
    step, exact = 1e-3, hessian(panels, points)
    for axis, e in enumerate(step * np.eye(3)):
        at = [gradient(panels, points + k * e) for k in (-2, -1, 1, 2)]
        slope = (at[0] - 8 * at[1] + 8 * at[2] - at[3]) / (12 * step)
        assert np.abs(slope - exact[..., axis]).max() < 1e-7 * np.abs(exact).max()
    scale = np.abs(exact).max()
    assert np.abs(exact - np.swapaxes(exact, -1, -2)).max() < 1e-12 * scale
    assert np.abs(np.trace(exact, axis1=-2, axis2=-1)).max() < 1e-12 * scale


def test_numbering_of_corners_does_not_count(panels: Panels, points: np.ndarray) -> None:
    for order in ([1, 2, 0], [1, 0, 2]):
        other = Panels(CORNERS[:, order])
        np.testing.assert_allclose(potential(other, points), potential(panels, points), rtol=1e-12)
        np.testing.assert_allclose(gradient(other, points), gradient(panels, points), atol=1e-12)


def test_finite_on_edges_and_corners(panels: Panels) -> None:
    on = np.concatenate([CORNERS.reshape(-1, 3), CORNERS.mean(axis=1), CORNERS[:, :2].mean(axis=1)])
    assert np.all(np.isfinite(potential(panels, on)))
    assert np.all(np.isfinite(gradient(panels, on)))


def test_solid_angle_of_a_closed_box() -> None:
    mesh = box_surface((0.2, -0.1, 0.3), (1.0, 0.8, 0.6), 0.25)
    box = Panels(mesh.vertices[mesh.triangles])
    inside, outside = np.array([[0.25, -0.3, 0.45]]), np.array([[1.2, 0.4, -0.3]])
    assert solid_angle(box, inside).sum() == pytest.approx(-4.0 * np.pi, abs=1e-12)
    assert solid_angle(box, outside).sum() == pytest.approx(0.0, abs=1e-12)


def test_gauss_on_a_charged_sphere() -> None:
    mesh = icosphere(3, 1.0, keep="area")
    sphere = Panels(mesh.vertices[mesh.triangles])
    inside = potential(sphere, np.array([[0.1, 0.2, -0.3]])).sum()
    outside = potential(sphere, np.array([[0.0, 1.2, 1.6]])).sum()
    assert inside == pytest.approx(4.0 * np.pi, rel=5e-3)
    assert outside == pytest.approx(4.0 * np.pi / 2.0, rel=1e-5)


def test_charge_matrix_of_a_unit_square() -> None:
    """The double integral of 1/r over a unit square is 4 (ln(1 + sqrt 2) + (1 - sqrt 2) / 3)."""
    exact = 4.0 * (np.log(1.0 + np.sqrt(2.0)) + (1.0 - np.sqrt(2.0)) / 3.0)
    errors = []
    for cells in (1, 2, 4):
        grid = np.linspace(0.0, 1.0, cells + 1)
        corners = []
        for i in range(cells):
            for j in range(cells):
                a, b = (grid[i], grid[j], 0.0), (grid[i + 1], grid[j], 0.0)
                c, d = (grid[i + 1], grid[j + 1], 0.0), (grid[i], grid[j + 1], 0.0)
                corners += [(a, b, c), (a, c, d)]
        matrix = mutual_potentials(Panels(np.array(corners)))
        errors.append(abs(matrix.sum() * 4.0 * np.pi / exact - 1.0))
    assert errors[0] < 1e-3
    assert errors[2] < 2e-4


def test_charge_matrix_of_a_sphere() -> None:
    """Uniform charge on a sphere of radius a and area A has the energy A^2 / (4 pi a)."""
    mesh = icosphere(3, 0.7)
    panels = Panels(mesh.vertices[mesh.triangles])
    matrix = mutual_potentials(panels)
    area = panels.areas.sum()
    assert matrix.sum() == pytest.approx(area**2 / (4.0 * np.pi * 0.7), rel=5e-3)
    np.testing.assert_array_equal(matrix, matrix.T)
    assert np.linalg.eigvalsh(matrix).min() > 0.0


def test_charge_matrix_against_all_inner_integrals_exact() -> None:
    mesh = icosphere(2, 1.0)
    panels = Panels(mesh.vertices[mesh.triangles])
    points = panels.points(RULE_28[0])
    exact = np.stack(
        [
            area / (4.0 * np.pi) * RULE_28[1] @ potential(panels, own)
            for area, own in zip(panels.areas, points, strict=True)
        ]
    )
    exact = (exact + exact.T) / 2.0
    assert np.abs(mutual_potentials(panels) - exact).max() < 2e-4 * exact.max()


@pytest.mark.parametrize("rule", [RULE_7, RULE_28], ids=["7", "28"])
def test_rules_integrate_polynomials_of_degree_five(rule: tuple[np.ndarray, np.ndarray]) -> None:
    # Over a triangle of unit area, the mean of b0^i b1^j b2^k is 2 i! j! k! / (i + j + k + 2)!
    for i, j, k, exact in ((5, 0, 0, 1 / 21), (2, 2, 1, 8 / 5040), (3, 1, 1, 12 / 5040), (0, 0, 0, 1.0)):
        value = (rule[1] * np.prod(rule[0] ** [i, j, k], axis=1)).sum()
        assert value == pytest.approx(exact, rel=1e-12)


def test_coinciding_triangles_are_refused() -> None:
    with pytest.raises(ValueError, match="touch or overlap"):
        mutual_potentials(Panels(np.concatenate([CORNERS, CORNERS[:1]])))

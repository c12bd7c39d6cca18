"""Bodies whose magnetization is known in closed form; moments for an ambient field of 1 A/m, in m^3."""

from collections.abc import Callable

import numpy as np
from numpy.polynomial.legendre import legder, legval


def directions(count: int = 12) -> np.ndarray:
    """Unit vectors all over the sphere, (count, 3)."""
    points = np.random.default_rng(5).normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def dipole_tensor(alpha: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Field of the moments ``alpha e_k`` at the origin, (p, 3, 3): J. D. Jackson, Classical Electrodynamics, (5.56)."""
    dist = np.linalg.norm(points, axis=1)
    unit = points / dist[:, None]
    kernel = 3.0 * np.einsum("pi,pj->pij", unit, unit) - np.eye(3)
    return np.einsum("pij,jk->pik", kernel, alpha) / (4.0 * np.pi * dist**3)[:, None, None]


def sphere_moment(mu: float, radius: float) -> float:
    """Solid sphere."""
    return 4.0 * np.pi * radius**3 * (mu - 1.0) / (mu + 2.0)


def shell_moment(mu: float, inner: float, outer: float) -> float:
    """Spherical shell (Jackson, section 5.12)."""
    return 4.0 * np.pi * (2 * mu + 1) * (mu - 1) * (outer**3 - inner**3) / _shell_below(mu, inner, outer)


def shell_inside(mu: float, inner: float, outer: float) -> float:
    """Field inside a spherical shell over the ambient one (Jackson, section 5.12)."""
    return 9.0 * mu / _shell_below(mu, inner, outer)


def _shell_below(mu: float, inner: float, outer: float) -> float:
    return (2 * mu + 1) * (mu + 2) - 2 * (inner / outer) ** 3 * (mu - 1) ** 2


def layered_moment(core: float, shell: float, inner: float, outer: float) -> float:
    """Sphere of one material up to ``inner`` in a shell of another up to ``outer``."""
    q = (inner / outer) ** 3
    above = (shell - 1) * (core + 2 * shell) + q * (2 * shell + 1) * (core - shell)
    below = (shell + 2) * (core + 2 * shell) + 2 * q * (shell - 1) * (core - shell)
    return 4.0 * np.pi * outer**3 * above / below


def spheroid_moments(mu: float, ratio: float, radius: float) -> np.ndarray:
    """Prolate spheroid along x, half axes ``ratio * radius`` and ``radius``: along x, y, z (J. A. Osborn, 1945)."""
    e = np.sqrt(1.0 - 1.0 / ratio**2)
    axial = (1 - e**2) / e**3 * (np.arctanh(e) - e)
    factors = np.array([axial, (1 - axial) / 2, (1 - axial) / 2])
    return 4.0 / 3.0 * np.pi * radius**3 * ratio * (mu - 1.0) / (1.0 + factors * (mu - 1.0))


def solid_factors(mu: float) -> Callable[[int], float]:
    """What a permeable sphere returns of the ambient potential of degree l: continuity of it and of ``mu H_r``."""
    return lambda n: n * (mu - 1.0) / (n * mu + n + 1.0)


def sheet_factors(chi: float, thickness: float, radius: float) -> Callable[[int], float]:
    """The same for a sphere of thin sheet: charge ``chi t`` times the surface Laplacian of the total potential."""

    def factor(n: int) -> float:
        kappa = chi * thickness * n * (n + 1) / (radius * (2 * n + 1))
        return kappa / (1.0 + kappa)

    return factor


def dipole_beside_sphere(
    factors: Callable[[int], float],
    radius: float,
    position: np.ndarray,
    moment: np.ndarray,
    points: np.ndarray,
    *,
    degrees: int = 150,
) -> np.ndarray:
    """Field H that a sphere around the origin adds to that of a dipole outside of it, (p, 3) [A/m].

    In spherical harmonics about the center an ambient potential ``a r^l`` brings ``-a f_l R^(2l+1) r^-(l+1)``
    outside. The potential of the dipole is ``m . grad_p`` of ``1 / (4 pi |x - p|)``, so the field is
    ``grad_x (m . grad_p) sum_l f_l F_l`` with ``F_l = R^(2l+1) (r p)^-(l+1) P_l(cos) / 4 pi``, a function of
    ``c = x.p`` and ``q = r^2 p^2`` alone.
    """
    m, p = np.asarray(moment, dtype=float), np.asarray(position, dtype=float)
    field = np.zeros((len(points), 3))
    r2, p2 = np.einsum("ni,ni->n", points, points), p @ p
    c, q, mx, mp = points @ p, r2 * p2, points @ m, m @ p
    s = np.sqrt(q)
    for n in range(1, degrees + 1):
        series = np.eye(n + 1)[n]
        scale = factors(n) / (4.0 * np.pi * radius) * (radius**2 / s) ** (n + 1)
        f = scale * legval(c / s, series)
        f_c = scale / s * legval(c / s, legder(series))
        f_cc = scale / q * legval(c / s, legder(series, 2)) if n > 1 else np.zeros_like(c)
        f_q = -0.5 * ((n + 1) * f + c * f_c) / q
        f_cq = -0.5 * ((n + 2) * f_c + c * f_cc) / q
        f_qq = 0.5 * ((n + 1) * (f / q - f_q) + c * (f_c / q - f_cq)) / q
        field += f_c[:, None] * m + mx[:, None] * (f_cc[:, None] * p + 2.0 * (p2 * f_cq)[:, None] * points)
        field += 2.0 * mp * (r2 * f_cq)[:, None] * p
        field += 2.0 * mp * (2.0 * r2 * p2 * f_qq + 2.0 * f_q)[:, None] * points
    return field


def field_error(response: np.ndarray, alpha: float, points: np.ndarray) -> float:
    """Largest error of the field vector over the largest field at that place, over three ambient fields.

    Parameters
    ----------
    response : (p, 3, 3)
        Computed at the points.
    alpha : float [m^3]
        Moment of the exact body, which has a dipole's field outside.
    points : (p, 3) [m]
    """
    exact = dipole_tensor(alpha * np.eye(3), points)
    return float((np.linalg.norm(response - exact, axis=1) / np.linalg.norm(exact, axis=1)).max())


def graded_disc(flat: np.ndarray) -> np.ndarray:
    """Points of an even disc (n, 2) moved outward so that its rings lie at sines of equal steps, (n, 3)."""
    radius = np.linalg.norm(flat, axis=1)
    share = radius / radius.max()
    return np.column_stack([flat * (0.5 * np.pi * np.sinc(0.5 * share))[:, None], np.zeros(len(flat))])

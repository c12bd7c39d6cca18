"""Magnetization that the ambient field induces in soft iron: finite elements joined to boundary elements.

The reduced potential ``phi`` lives on the nodes of the steel (P1), the magnetic charge ``sigma`` on its surface
triangles (P0); the air outside is exact::

    V sigma = M phi,      K phi + M^T sigma = -K psi_0

``psi_0`` is the potential of the ambient field. Thin sheets carry their potential constant through the thickness.
All parts interact. Inside, fields are in A/m for an ambient field of 1 A/m, so responses have no unit.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.linalg import LinAlgError, cho_factor, cho_solve, cholesky, solve_triangular
from scipy.sparse.linalg import splu

from magsim.field.meshes import Surface, Tetrahedra
from magsim.field.panels import Panels, gradient, hessian, mutual_potentials


@dataclass(frozen=True)
class Sheet:
    """Thin soft-magnetic sheet: a surface, its thickness [m] and its susceptibility ``mu_r - 1``."""

    mesh: Surface
    thickness_m: float
    chi: float


@dataclass(frozen=True)
class Solid:
    """Soft-magnetic body: tetrahedra and their susceptibility, one number or one for each cell."""

    mesh: Tetrahedra
    chi: float | np.ndarray


def _sheet_stiffness(sheet: Sheet, offset: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Entries of K of a sheet: values, rows, columns."""
    triangles = sheet.mesh.triangles
    panels = Panels(sheet.mesh.vertices[triangles])
    # The edge opposite to node i is e_i = P_{i+2} - P_{i+1}; grad w_i = (n x e_i) / (2 A).
    opposite = np.roll(panels.corners, -2, axis=1) - np.roll(panels.corners, -1, axis=1)
    grads = np.cross(panels.normals[:, None, :], opposite) / (2.0 * panels.areas[:, None, None])
    weight = sheet.chi * sheet.thickness_m * panels.areas
    return _entries(weight, grads, triangles + offset)


def _solid_stiffness(solid: Solid, offset: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Entries of K of a solid: values, rows, columns."""
    cells = solid.mesh.cells
    corners = solid.mesh.vertices[cells]
    jacobian = corners[:, 1:] - corners[:, :1]
    others = np.swapaxes(np.linalg.inv(jacobian), 1, 2)
    grads = np.concatenate([-others.sum(axis=1, keepdims=True), others], axis=1)
    weight = np.broadcast_to(solid.chi, len(cells)) * np.abs(np.linalg.det(jacobian)) / 6.0
    return _entries(weight, grads, cells + offset)


def _entries(weight: np.ndarray, grads: np.ndarray, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    local = weight[:, None, None] * np.einsum("eix,ejx->eij", grads, grads)
    shape = local.shape
    rows = np.broadcast_to(nodes[:, :, None], shape)
    return local.ravel(), rows.ravel(), np.broadcast_to(nodes[:, None, :], shape).ravel()


def charge_faces(cells: np.ndarray, chi: np.ndarray) -> np.ndarray:
    """Faces of tetrahedra that carry charge: the boundary, and inner faces where the susceptibility jumps.

    Parameters
    ----------
    cells : (e, 4) int
    chi : (e,)

    Returns
    -------
    (t, 3) int
        Orientation is free: the potential of a charge layer does not depend on it.
    """
    faces = np.concatenate([np.delete(cells, corner, axis=1) for corner in range(4)])
    owner = np.tile(np.arange(len(cells)), 4)
    keys = np.sort(faces, axis=1)
    order = np.lexsort(keys.T[::-1])
    keys, owner = keys[order], owner[order]
    starts = np.flatnonzero(np.r_[True, np.any(keys[1:] != keys[:-1], axis=1)])
    counts = np.diff(np.r_[starts, len(keys)])
    if counts.max() > 2:
        msg = "a face belongs to more than two tetrahedra: the mesh is not conforming"
        raise ValueError(msg)
    partner = owner[np.minimum(starts + 1, len(owner) - 1)]
    return keys[starts[(counts == 1) | (chi[owner[starts]] != chi[partner])]]


class InducedModel:
    """Soft-magnetic parts, discretized and factorized; solves for any ambient potential.

    Parameters
    ----------
    parts : sequence of Sheet or Solid
        They may not touch each other; bodies that touch belong into one mesh with a susceptibility for each cell.

    Attributes
    ----------
    nodes : (n, 3) [m]
    panels : Panels
        The ``t`` triangles that carry charge.

    Raises
    ------
    ValueError
        If the parts touch, or there are none.
    """

    def __init__(self, parts: Sequence[Sheet | Solid]) -> None:
        if not parts:
            msg = "there is no soft-magnetic part to magnetize"
            raise ValueError(msg)
        entries, vertices, faces, offset = [], [], [], 0
        for part in parts:
            if isinstance(part, Sheet):
                entries.append(_sheet_stiffness(part, offset))
                faces.append(part.mesh.triangles + offset)
            else:
                entries.append(_solid_stiffness(part, offset))
                chi = np.broadcast_to(part.chi, len(part.mesh.cells))
                faces.append(charge_faces(part.mesh.cells, chi) + offset)
            vertices.append(part.mesh.vertices)
            offset += len(part.mesh.vertices)
        self.nodes = np.concatenate(vertices)
        triangles = np.concatenate(faces)
        self.panels = Panels(self.nodes[triangles])
        value, row, column = (np.concatenate(items) for items in zip(*entries, strict=True))
        self._stiffness = sparse.csr_array((value, (row, column)), shape=(offset, offset))
        self._factorize(triangles)

    def _factorize(self, triangles: np.ndarray) -> None:
        """Schur complement on the surface nodes: (K_bb - K_bi K_ii^-1 K_ib + M^T V^-1 M) phi_b = r."""
        surface = np.unique(triangles)
        self._surface, self._inner = surface, np.setdiff1d(np.arange(len(self.nodes)), surface)
        mass = np.zeros((len(triangles), len(surface)))
        rows = np.repeat(np.arange(len(triangles)), 3)
        np.add.at(mass, (rows, np.searchsorted(surface, triangles.ravel())), np.repeat(self.panels.areas / 3.0, 3))
        try:
            self._root = cholesky(mutual_potentials(self.panels), lower=True)
        except LinAlgError as error:
            msg = "soft-magnetic bodies touch or overlap; leave a gap between them or merge their meshes"
            raise ValueError(msg) from error
        self._half = solve_triangular(self._root, mass, lower=True)
        matrix = self._stiffness[surface][:, surface].toarray() + self._half.T @ self._half
        self._lower = None
        if len(self._inner):
            coupling = self._stiffness[self._inner][:, surface]
            self._coupling = coupling.tocsr()
            self._lower = splu(self._stiffness[self._inner][:, self._inner].tocsc())
            matrix -= coupling.T @ self._lower.solve(coupling.toarray())
        self._schur = cho_factor(matrix, lower=True)

    def charge(self, potential: np.ndarray) -> np.ndarray:
        """Surface charge for given ambient potentials.

        Parameters
        ----------
        potential : (n, k) [A]
            ``psi_0`` at the nodes, one column for each ambient field ``H_0 = -grad psi_0``.

        Returns
        -------
        (t, k) [A/m]
        """
        right = -(self._stiffness @ potential)
        reduced = right[self._surface]
        if self._lower is not None:
            reduced = reduced - self._coupling.T @ self._lower.solve(right[self._inner])
        phi = cho_solve(self._schur, reduced)
        return solve_triangular(self._root, self._half @ phi, lower=True, trans="T")

    @cached_property
    def uniform(self) -> np.ndarray:
        """Surface charge for uniform ambient fields of 1 A/m along x, y and z, (t, 3) [A/m]."""
        return self.charge(-self.nodes)

    def response(self, points: np.ndarray, charge: np.ndarray | None = None) -> np.ndarray:
        """Field of the charge, by default of a unit uniform field: ``D`` with ``B_induced = D B_0``.

        Parameters
        ----------
        points : (p, 3) [m]
            In the air.
        charge : (t, k) [A/m], optional

        Returns
        -------
        (p, 3, k)
            [A/m] for each ambient field; ``(p, 3, 3)`` without unit by default.
        """
        charge = self.uniform if charge is None else charge
        return np.stack(
            [-np.einsum("ti,tk->ik", gradient(self.panels, p[None])[0], charge) / (4.0 * np.pi) for p in points]
        )

    def response_gradient(self, points: np.ndarray) -> np.ndarray:
        """Derivatives ``dD_ik/dx_j`` of ``response``, indexed (p, i, k, j) [1/m]."""
        return np.stack(
            [-np.einsum("tij,tk->ikj", hessian(self.panels, p[None])[0], self.uniform) / (4.0 * np.pi) for p in points]
        )

    def moment(self, charge: np.ndarray | None = None) -> np.ndarray:
        """Magnetic moment of the charge, (3, k) [A m^2]; by default the polarizability ``alpha`` (3, 3) [m^3]."""
        charge = self.uniform if charge is None else charge
        return np.einsum("t,ti,tk->ik", self.panels.areas, self.panels.centroids, charge)

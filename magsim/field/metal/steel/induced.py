"""Magnetization that the ambient field induces in soft iron: finite elements joined to boundary elements.

The reduced potential ``phi`` lives on the nodes of the steel (P1), the magnetic charge ``sigma`` on its surface
triangles (P0); the air outside is exact::

    V sigma = M phi,      K phi + M^T sigma = -K psi_0

``psi_0`` is the potential of the ambient field. Thin sheets carry their potential constant through the thickness;
a homogeneous body may be given by its surface alone. All parts interact. Inside, fields are in A/m for an ambient
field of 1 A/m, so responses have no unit.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy import sparse
from scipy.linalg import LinAlgError, cho_factor, cho_solve, cholesky, solve_triangular
from scipy.sparse.linalg import splu

from magsim.field.geometry.meshes import Tetrahedra, TriangleMesh
from magsim.field.geometry.panels import Panels, gradient, hat_slopes, hessian, mutual_potentials
from magsim.field.metal.steel.interior import interior_stiffness


@dataclass(frozen=True)
class Sheet:
    """Thin soft-magnetic sheet: a surface, its thickness [m] and its susceptibility ``mu_r - 1``."""

    mesh: TriangleMesh
    thickness_m: float
    chi: float


@dataclass(frozen=True)
class Solid:
    """Soft-magnetic body: tetrahedra and their susceptibility, one number or one for each cell."""

    mesh: Tetrahedra
    chi: float | np.ndarray


@dataclass(frozen=True)
class ClosedBody:
    """Homogeneous soft-magnetic body: its closed surface, outward, and its susceptibility."""

    mesh: TriangleMesh
    chi: float


Part = Sheet | Solid | ClosedBody


def _sheet_stiffness(sheet: Sheet, offset: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the entries of K of a sheet: values, rows, columns."""
    triangles = sheet.mesh.triangles
    panels = Panels(sheet.mesh.vertices[triangles])
    weight = sheet.chi * sheet.thickness_m * panels.areas
    return _entries(weight, hat_slopes(panels), triangles + offset)


def cell_slopes(mesh: Tetrahedra) -> tuple[np.ndarray, np.ndarray]:
    """Return slopes (e, 4, 3) [1/m] of the four linear functions of each cell, and volumes (e,) [m^3]."""
    corners = mesh.vertices[mesh.cells]
    jacobian = corners[:, 1:] - corners[:, :1]
    others = np.swapaxes(np.linalg.inv(jacobian), 1, 2)
    slopes = np.concatenate([-others.sum(axis=1, keepdims=True), others], axis=1)
    return slopes, np.abs(np.linalg.det(jacobian)) / 6.0


def _solid_stiffness(solid: Solid, offset: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the entries of K of a solid: values, rows, columns."""
    slopes, volumes = cell_slopes(solid.mesh)
    return _entries(np.broadcast_to(solid.chi, len(volumes)) * volumes, slopes, solid.mesh.cells + offset)


def _stiffness(part: Part, offset: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the sparse entries of K of a part: values, rows, columns; none of a body, whose K is full."""
    if isinstance(part, Sheet):
        return _sheet_stiffness(part, offset)
    if isinstance(part, Solid):
        return _solid_stiffness(part, offset)
    return np.zeros(0), np.zeros(0, dtype=int), np.zeros(0, dtype=int)


def charge_triangles(part: Part) -> np.ndarray:
    """Return the triangles of a part that carry charge, (t, 3) int."""
    if isinstance(part, Solid):
        return charge_faces(part.mesh.cells, np.broadcast_to(part.chi, len(part.mesh.cells)))
    return part.mesh.triangles


def _entries(weight: np.ndarray, grads: np.ndarray, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    local = weight[:, None, None] * np.einsum("eix,ejx->eij", grads, grads)
    shape = local.shape
    rows = np.broadcast_to(nodes[:, :, None], shape)
    return local.ravel(), rows.ravel(), np.broadcast_to(nodes[:, None, :], shape).ravel()


def charge_faces(cells: np.ndarray, chi: np.ndarray) -> np.ndarray:
    """Return the charged faces of tetrahedra: the boundary, and inner faces where the susceptibility jumps.

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


def charge_field(panels: Panels, charge: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the field of charged triangles, (p, 3, k) [A/m].

    Parameters
    ----------
    panels : Panels
        ``t`` triangles.
    charge : (t, k) [A/m]
    points : (p, 3) [m]
        Off the triangles. Each is worked on alone, so that its bits do not depend on the others.
    """
    out = np.empty((len(points), 3, charge.shape[1]))
    for number, p in enumerate(points):
        out[number] = -np.einsum("ti,tk->ik", gradient(panels, p[None])[0], charge) / (4.0 * np.pi)
    return out


def charge_gradient(panels: Panels, charge: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the derivatives by the place of ``charge_field``, indexed (p, i, k, j) [A/m^2]."""
    out = np.empty((len(points), 3, charge.shape[1], 3))
    for number, p in enumerate(points):
        out[number] = -np.einsum("tij,tk->ikj", hessian(panels, p[None])[0], charge) / (4.0 * np.pi)
    return out


@dataclass(frozen=True)
class Condensed:
    """Equations of several parts on the ``b`` nodes of their surfaces: ``(outside + stiffness) u = outside x``.

    ``u`` is the whole potential, ``u - x`` the reduced one, for an ambient field along ``x``.

    Attributes
    ----------
    nodes : (b, 3) [m]
    outside : (b, b) [m]
        ``M^T V^-1 M``: what the air around answers.
    layer : (t, b) [1/m]
        ``V^-1 M``: the charge for a reduced potential.
    places : list of (p,) int
        The nodes of each part.
    stiffness : list of (p, p) [m]
        ``K_bb - K_bi K_ii^-1 K_ib`` of each part.
    """

    nodes: np.ndarray
    outside: np.ndarray
    layer: np.ndarray
    places: list[np.ndarray]
    stiffness: list[np.ndarray]


class InducedModel:
    """Soft-magnetic parts, discretized and factorized; solves for any ambient potential.

    Parameters
    ----------
    parts : sequence of Sheet, Solid or ClosedBody
        They may not touch each other; bodies that touch belong into one mesh with a susceptibility for each cell.

    Attributes
    ----------
    parts : tuple of Sheet, Solid or ClosedBody
    starts : (parts + 1,) int
        Number of the first node of each part, and of all nodes.
    nodes : (n, 3) [m]
    panels : Panels
        The ``t`` triangles that carry charge.
    part : (t,) int
        Number of the part that a triangle belongs to.

    Raises
    ------
    ValueError
        If the parts touch, or there are none.
    """

    def __init__(self, parts: Sequence[Part]) -> None:
        if not parts:
            msg = "there is no soft-magnetic part to magnetize"
            raise ValueError(msg)
        starts = np.cumsum([0, *(len(part.mesh.vertices) for part in parts)])
        faces = [charge_triangles(part) for part in parts]
        self.parts, self.starts = tuple(parts), starts
        self.nodes = np.concatenate([part.mesh.vertices for part in parts])
        triangles = np.concatenate([face + start for face, start in zip(faces, starts, strict=False)])
        self.panels = Panels(self.nodes[triangles])
        self.part = np.repeat(np.arange(len(parts)), [len(face) for face in faces])
        entries = [_stiffness(part, start) for part, start in zip(parts, starts, strict=False)]
        value, row, column = (np.concatenate(items) for items in zip(*entries, strict=True))
        self._stiffness = sparse.csr_array((value, (row, column)), shape=(len(self.nodes), len(self.nodes)))
        try:
            single = mutual_potentials(self.panels)
            self._full = [
                (slice(starts[i], starts[i + 1]), part.chi * self._body(i, part, single))
                for i, part in enumerate(parts)
                if isinstance(part, ClosedBody)
            ]
            self._factorize(triangles, single)
        except LinAlgError as error:
            msg = "soft-magnetic bodies touch or overlap; leave a gap between them or merge their meshes"
            raise ValueError(msg) from error

    def _body(self, number: int, part: ClosedBody, single: np.ndarray) -> np.ndarray:
        own = np.flatnonzero(self.part == number)
        return interior_stiffness(part.mesh, single[np.ix_(own, own)])

    def _factorize(self, triangles: np.ndarray, single: np.ndarray) -> None:
        """Factorize the Schur complement on surface nodes: (K_bb - K_bi K_ii^-1 K_ib + M^T V^-1 M) phi_b = r."""
        surface = np.unique(triangles)
        self._surface, self._inner = surface, np.setdiff1d(np.arange(len(self.nodes)), surface)
        mass = np.zeros((len(triangles), len(surface)))
        rows = np.repeat(np.arange(len(triangles)), 3)
        np.add.at(mass, (rows, np.searchsorted(surface, triangles.ravel())), np.repeat(self.panels.areas / 3.0, 3))
        self._root = cholesky(single, lower=True)
        self._half = solve_triangular(self._root, mass, lower=True)
        matrix = self._stiffness[surface][:, surface].toarray() + self._half.T @ self._half
        for nodes, full in self._full:
            at = np.searchsorted(surface, np.arange(nodes.start, nodes.stop))
            matrix[np.ix_(at, at)] += full
        self._lower = None
        if len(self._inner):
            coupling = self._stiffness[self._inner][:, surface]
            self._coupling = coupling.tocsr()
            self._lower = splu(self._stiffness[self._inner][:, self._inner].tocsc())
            matrix -= coupling.T @ self._lower.solve(coupling.toarray())
        self._schur = cho_factor(matrix, lower=True)

    def condensed(self) -> "Condensed":
        """Return the equations on the nodes of the surface alone, part by part."""
        places, stiffness = [], []
        full = {nodes.start: matrix for nodes, matrix in self._full}
        for start, stop in pairwise(self.starts):
            own = np.arange(start, stop)
            outer, inner = np.intersect1d(own, self._surface), np.intersect1d(own, self._inner)
            matrix = full[start] if start in full else self._stiffness[outer][:, outer].toarray()
            if len(inner):
                coupling = self._stiffness[inner][:, outer].toarray()
                matrix = matrix - coupling.T @ splu(self._stiffness[inner][:, inner].tocsc()).solve(coupling)
            places.append(np.searchsorted(self._surface, outer))
            stiffness.append(matrix)
        layer = solve_triangular(self._root, self._half, lower=True, trans="T")
        return Condensed(self.nodes[self._surface], self._half.T @ self._half, layer, places, stiffness)

    def stiff(self, potential: np.ndarray) -> np.ndarray:
        """Apply K to potentials at the nodes, (n, k)."""
        out = self._stiffness @ potential
        for nodes, full in self._full:
            out[nodes] += full @ potential[nodes]
        return out

    def charge(self, potential: np.ndarray) -> np.ndarray:
        """Return the surface charge for given ambient potentials.

        Parameters
        ----------
        potential : (n, k) [A]
            ``psi_0`` at the nodes, one column for each ambient field ``H_0 = -grad psi_0``.

        Returns
        -------
        (t, k) [A/m]
        """
        return self.solve(-self.stiff(potential))

    def solve(self, right: np.ndarray, defect: np.ndarray | None = None) -> np.ndarray:
        """Solve ``K phi + M^T sigma = right`` and ``V sigma = M phi - defect`` for the surface charge.

        Parameters
        ----------
        right : (n, k) [A m]
        defect : (t, k) [A m^2], optional

        Returns
        -------
        (t, k) [A/m]
        """
        reduced = right[self._surface]
        if self._lower is not None:
            reduced = reduced - self._coupling.T @ self._lower.solve(right[self._inner])
        short = 0.0 if defect is None else solve_triangular(self._root, defect, lower=True)
        if defect is not None:
            reduced = reduced + self._half.T @ short
        phi = cho_solve(self._schur, reduced)
        return solve_triangular(self._root, self._half @ phi - short, lower=True, trans="T")

    @cached_property
    def uniform(self) -> np.ndarray:
        """Surface charge for uniform ambient fields of 1 A/m along x, y and z, (t, 3) [A/m]."""
        return self.charge(-self.nodes)

    def response(self, points: np.ndarray, charge: np.ndarray | None = None) -> np.ndarray:
        """Return the field of the charge, by default of a unit uniform field: ``D`` with ``B_induced = D B_0``.

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
        return charge_field(self.panels, self.uniform if charge is None else charge, points)

    def moment(self, charge: np.ndarray | None = None) -> np.ndarray:
        """Return the moment of the charge, (3, k) [A m^2]; by default the polarizability ``alpha`` (3, 3) [m^3]."""
        charge = self.uniform if charge is None else charge
        return np.einsum("t,ti,tk->ik", self.panels.areas, self.panels.centroids, charge)

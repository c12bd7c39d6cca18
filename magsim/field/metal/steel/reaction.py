"""What a permanent dipole induces in the steel beside it.

The potential of the dipole takes the place of the ambient one. It bends within an element, so it is not enough to know
it at the nodes. Two forms know it exactly: its flux through the steel (for weak material the answer itself), and its
potential on the charged triangles (for strong material, which shorts it). Each is consistent, so any shares of the
two sum to a consistent answer; a part takes the share of the first that its own field leaves over,
``1 / mu_r`` for a body and ``1 / (1 + chi t / d)`` for a sheet at the distance ``d``.
"""

import numpy as np

from magsim.field.geometry.panels import RULE_7, Panels, hat_slopes
from magsim.field.metal.steel.induced import InducedModel, Part, Sheet, Solid, cell_slopes

RULE_4 = np.full((4, 4), 0.1381966011250105) + (0.5854101966249685 - 0.1381966011250105) * np.eye(4)
"""Barycentric points in a tetrahedron, equal weights, degree 2."""


def dipole_potential(position: np.ndarray, moment: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the magnetic scalar potential of a dipole, (...,) [A]."""
    ray = points - position
    return np.einsum("...x,x->...", ray, moment) / (4.0 * np.pi * np.linalg.norm(ray, axis=-1) ** 3)


def _field(position: np.ndarray, moment: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the field of a dipole, (..., 3) [A/m]."""
    ray = points - position
    dist = np.linalg.norm(ray, axis=-1, keepdims=True)
    along = np.einsum("...x,x->...", ray, moment)[..., None]
    return (3.0 * along * ray / dist**2 - moment) / (4.0 * np.pi * dist**3)


def _flux(part: Part, position: np.ndarray, moment: np.ndarray) -> np.ndarray:
    """Return the integral of ``chi H_0 . grad w`` for each node of a part, (n,) [A m], by quadrature."""
    vertices, out = part.mesh.vertices, np.zeros(len(part.mesh.vertices))
    if isinstance(part, Solid):
        slopes, volumes = cell_slopes(part.mesh)
        mean = _field(position, moment, np.einsum("qc,ecx->eqx", RULE_4, vertices[part.mesh.cells])).mean(axis=1)
        weight = np.broadcast_to(part.chi, len(volumes)) * volumes
        np.add.at(out, part.mesh.cells, np.einsum("e,ecx,ex->ec", weight, slopes, mean))
        return out
    panels = Panels(vertices[part.mesh.triangles])
    field = _field(position, moment, panels.points(RULE_7[0]))
    if isinstance(part, Sheet):
        mean = np.einsum("q,tqx->tx", RULE_7[1], field)
        weight = part.chi * part.thickness_m * panels.areas
        np.add.at(out, part.mesh.triangles, np.einsum("t,tcx,tx->tc", weight, hat_slopes(panels), mean))
        return out
    through = np.einsum("tqx,tx->tq", field, panels.normals)
    hats = np.einsum("q,tq,qc->tc", RULE_7[1], through, RULE_7[0])
    np.add.at(out, part.mesh.triangles, part.chi * panels.areas[:, None] * hats)
    # No flux comes from nowhere: what quadrature leaves is spread over the surface.
    share = np.zeros(len(out))
    np.add.at(share, part.mesh.triangles, panels.areas[:, None] / 3.0)
    return out - out.sum() * share / share.sum()


def _weak_share(part: Part, position: np.ndarray) -> float:
    """Return the share of the dipole's field that the part's own field leaves, from 0 to 1."""
    if isinstance(part, Sheet):
        dist = np.linalg.norm(part.mesh.vertices - position, axis=1).min()
        return float(1.0 / (1.0 + part.chi * part.thickness_m / dist))
    return float(1.0 / (1.0 + np.mean(part.chi)))


def dipole_charge(model: InducedModel, position: np.ndarray, moment: np.ndarray) -> np.ndarray:
    """Return the surface charge that a dipole induces in all parts, (t,) [A/m].

    Parameters
    ----------
    model : InducedModel
    position, moment : (3,) [m], [A m^2]
        In the air, no closer to the steel than its elements are large.
    """
    shares = np.array([_weak_share(part, position) for part in model.parts])
    flux = np.concatenate([_flux(part, position, moment) for part in model.parts])
    by_node = np.repeat(shares, np.diff(model.starts))
    at_nodes = dipole_potential(position, moment, model.nodes)
    right = by_node * flux - (1.0 - by_node) * model.stiff(at_nodes[:, None])[:, 0]
    points, panels = model.panels.points(RULE_7[0]), model.panels
    true = np.einsum("q,tq->t", RULE_7[1], dipole_potential(position, moment, points))
    linear = dipole_potential(position, moment, panels.corners).mean(axis=1)
    defect = (1.0 - shares)[model.part] * panels.areas * (true - linear)
    return model.solve(right[:, None], defect[:, None])[:, 0]

"""Eddy currents in a thin conducting skin, by a stream function on its triangles.

The current per width is ``J = grad psi x n`` [A/m] with ``psi`` [A] linear on each triangle, so it has no divergence.
Ohm's law and induction make the circuit ``L dpsi/dt + R psi = -F dB_0/dt`` and the field ``B = S psi``: the same
form as that of loops of wire, with one unknown for each node. It holds where the metal is thin beside the skin depth:
0.17 m for aluminum at 0.5 Hz.
"""

from dataclasses import dataclass
from functools import cached_property, reduce

import numpy as np
from scipy import sparse
from scipy.linalg import eigh
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from magsim.field.geometry.meshes import TriangleMesh
from magsim.field.geometry.panels import Panels, gradient, mutual_potentials
from magsim.units import MU0

CHUNK = 400_000
"""Pairs of point and triangle that a field is computed for at a time."""

DEPENDENT = 1e-9
"""Share of a vector that must be new for it to extend the basis of the modes."""


@dataclass(frozen=True)
class Seams:
    """Joints of sheets along edges of a mesh, which resist the current that crosses them.

    Attributes
    ----------
    edges : (e, 2) int
        Nodes at the ends of each edge.
    ohm_m : (e,) [ohm m]
        Resistance of the joint times its length: voltage across it over current for each meter.
    """

    edges: np.ndarray
    ohm_m: np.ndarray


NO_SEAMS = Seams(np.empty((0, 2), dtype=int), np.empty(0))


@dataclass(frozen=True)
class ThinShells:
    """Thin conducting shells, closed or open, one or several, electrically separate where they share no node.

    Attributes
    ----------
    surface : TriangleMesh
        Each connected part consistently oriented.
    conductance_s : float or (t,) [S]
        Conductivity times thickness.
    seams : Seams
    known_inductance : (c, c) [H], optional
        ``L`` where it has been computed before: it depends on the surface alone.
    """

    surface: TriangleMesh
    conductance_s: float | np.ndarray
    seams: Seams = NO_SEAMS
    known_inductance: np.ndarray | None = None

    @cached_property
    def panels(self) -> Panels:
        """The triangles."""
        return Panels(self.surface.vertices[self.surface.triangles])

    @cached_property
    def _grads(self) -> np.ndarray:
        """Surface gradients of the hat functions of the corners, (t, 3, 3) [1/m]."""
        corners, panels = self.panels.corners, self.panels
        opposite = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)
        return np.cross(panels.normals[:, None, :], opposite) / (2.0 * panels.areas[:, None, None])

    @cached_property
    def unknowns(self) -> np.ndarray:
        """Number of the unknown that each node belongs to, (n,) int; -1 where ``psi`` is zero.

        A constant carries no current, so ``psi`` is zero at one node of a closed part and on the longest rim of an
        open one. No current leaves through the rim of a hole: ``psi`` is one constant on each.

        Raises
        ------
        ValueError
            If more than two triangles meet at an edge, or two of them are not oriented alike.
        """
        vertices, triangles = self.surface.vertices, self.surface.triangles
        count = len(vertices)
        group = np.arange(count)
        zero = np.zeros(count, dtype=bool)
        tail, head = rim_edges(triangles)
        first, second = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
        parts = connected_components(_graph(first, second, count), directed=False)[1]
        rims = connected_components(_graph(tail, head, count), directed=False)[1]
        length = np.linalg.norm(vertices[head] - vertices[tail], axis=1)
        for part in np.unique(parts[triangles]):
            own = parts[tail] == part
            if not own.any():
                zero[np.flatnonzero(parts == part)[0]] = True
                continue
            names, where = np.unique(rims[tail[own]], return_inverse=True)
            outer = names[np.argmax(np.bincount(where, weights=length[own]))]
            for rim in names:
                nodes = np.flatnonzero(rims == rim)
                group[nodes] = nodes[0]
                zero[nodes] = rim == outer
        unused = np.setdiff1d(np.arange(count), triangles)
        zero[unused] = True
        kept = np.unique(group[~zero])
        return np.where(zero, -1, np.searchsorted(kept, group))

    @cached_property
    def spread(self) -> sparse.csr_array:
        """Matrix from unknowns to nodes, (n, c)."""
        nodes = np.flatnonzero(self.unknowns >= 0)
        columns = self.unknowns[nodes]
        shape = (len(self.unknowns), int(self.unknowns.max(initial=-1)) + 1)
        return sparse.csr_array((np.ones(len(nodes)), (nodes, columns)), shape=shape)

    @cached_property
    def currents(self) -> tuple[sparse.csr_array, ...]:
        """``C_k``: component k of the current per width in each triangle from each unknown, three (t, c) [1/m]."""
        flow = np.cross(self._grads, self.panels.normals[:, None, :])
        rows = np.repeat(np.arange(len(self.panels)), 3)
        columns, shape = self.surface.triangles.ravel(), (len(self.panels), len(self.surface.vertices))
        return tuple(
            sparse.csr_array((flow[..., k].ravel(), (rows, columns)), shape=shape) @ self.spread for k in range(3)
        )

    @cached_property
    def resistance(self) -> sparse.csc_array:
        """``R``, (c, c) [ohm]; symmetric positive definite.

        Of a seam, the current through an edge of length ``l`` is the step of ``psi`` along it, so ``ohm_m / l`` times
        its square is the power.
        """
        weight = self.panels.areas / self.conductance_s
        diagonal = sparse.diags_array(weight)
        sheets = sum(part.T @ diagonal @ part for part in self.currents)
        if len(self.seams.ohm_m):
            tail, head = self.seams.edges.T
            rows = np.arange(len(tail))
            step = sparse.csr_array(
                (np.repeat([1.0, -1.0], len(tail)), (np.tile(rows, 2), np.concatenate([head, tail]))),
                shape=(len(tail), len(self.surface.vertices)),
            )
            length = np.linalg.norm(self.surface.vertices[head] - self.surface.vertices[tail], axis=1)
            crossing = step @ self.spread
            sheets = sheets + crossing.T @ sparse.diags_array(self.seams.ohm_m / length) @ crossing
        return sparse.csc_array(sheets)

    @cached_property
    def inductance(self) -> np.ndarray:
        """``L``, (c, c) [H]; symmetric positive definite."""
        if self.known_inductance is not None:
            return self.known_inductance
        potentials = mutual_potentials(self.panels)
        turned = [part.T.tocsr() for part in self.currents]
        total = reduce(np.add, [part @ (part @ potentials).T for part in turned])
        return 0.5 * MU0 * (total + total.T)

    @cached_property
    def flux(self) -> np.ndarray:
        """``F``: flux through each unknown for each component of a uniform field, (c, 3) [m^2].

        The moment of its currents, ``1/2 int r x J dS``: on a closed part this is ``int w n dS``, and it counts the
        area of a hole to the constant of its rim.
        """
        arms = (0.5 * self.panels.areas[:, None] * self.panels.centroids).T
        turns = [self.currents[k].T @ arms[j] - self.currents[j].T @ arms[k] for j, k in ((1, 2), (2, 0), (0, 1))]
        return np.column_stack(turns)

    def field(self, points: np.ndarray) -> np.ndarray:
        """Return ``S``, the flux density of each unknown, (p, 3, c) [T/A]."""
        eye = sparse.eye_array(self.spread.shape[1]).toarray()
        return stream_field(self.surface, self.spread @ eye, points)


def _graph(tail: np.ndarray, head: np.ndarray, count: int) -> sparse.csr_array:
    return sparse.csr_array((np.ones(len(tail)), (tail, head)), shape=(count, count))


def rim_edges(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the edges of one triangle alone: their tails and heads, (e,) int each.

    Raises
    ------
    ValueError
        If an edge is run twice in the same direction: more than two triangles meet there, or two are not oriented
        alike.
    """
    tail, head = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    count = int(triangles.max()) + 1
    ahead, back = tail * count + head, head * count + tail
    names, number = np.unique(ahead, return_counts=True)
    if number.max() > 1:
        bad = int(names[np.argmax(number)])
        msg = (
            f"has {number.max()} triangles that run the edge between vertices {bad // count} and {bad % count} the "
            "same way; orient all triangles alike, and let no more than two meet at an edge"
        )
        raise ValueError(msg)
    alone = ~np.isin(ahead, back)
    return tail[alone], head[alone]


def stream_currents(surface: TriangleMesh, streams: np.ndarray) -> np.ndarray:
    """Return the current per width in each triangle for stream functions (n, k) [A] on the nodes, (t, 3, k) [A/m]."""
    panels = Panels(surface.vertices[surface.triangles])
    opposite = np.roll(panels.corners, -2, axis=1) - np.roll(panels.corners, -1, axis=1)
    # grad w_i x n = (n x e_i) x n / (2 A) = e_i / (2 A) for an edge in the plane.
    return np.einsum("tix,tik->txk", opposite, streams[surface.triangles]) / (2.0 * panels.areas[:, None, None])


def stream_field(surface: TriangleMesh, streams: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the flux density of stream functions, by the law of Biot and Savart over flat triangles.

    Parameters
    ----------
    surface : TriangleMesh
    streams : (n, k) [A]
    points : (p, 3) [m]

    Returns
    -------
    (p, 3, k) [T]
    """
    panels = Panels(surface.vertices[surface.triangles])
    flow = stream_currents(surface, streams)
    points = np.asarray(points, dtype=float)
    out = np.empty((len(points), 3, streams.shape[1]))
    step = max(1, CHUNK // len(panels))
    for start in range(0, len(points), step):
        steep = gradient(panels, points[start : start + step])
        for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
            out[start : start + step, i] = steep[..., j] @ flow[:, k] - steep[..., k] @ flow[:, j]
    return MU0 / (4.0 * np.pi) * out


@dataclass(frozen=True)
class StreamModes:
    """Modes of a skin as stream functions; see ``driven_modes``.

    Attributes
    ----------
    tau_s : (k,) [s]
        The longest first.
    drive : (k, 3) [m^2 / sqrt(ohm)]
    streams : (n, k) [1 / sqrt(ohm)]
        Stream function of each mode on the nodes.
    """

    tau_s: np.ndarray
    drive: np.ndarray
    streams: np.ndarray


def driven_modes(shells: ThinShells, orders: int) -> StreamModes:
    """Return the modes in the space of the currents that a changing uniform field drives.

    The space is spanned by ``R^-1 F``, ``(R^-1 L) R^-1 F`` and so on: the currents of a field that climbs evenly, the
    first correction for their lag, and so on (A. Odabasioglu et al., IEEE Trans. CAD 17, 645 (1998)). For slow motion
    ``B = sum_m E_m d^m B_0/dt^m``: the first ``orders`` of the ``E_m`` are exact **at every place**, so nothing is
    left over for a direct term; of the moment, twice as many are. The circuit stays passive: all time constants are
    positive and none is longer than the longest of the whole.

    Parameters
    ----------
    shells : ThinShells
    orders : int
        Three modes each, fewer where the currents repeat themselves.

    Returns
    -------
    StreamModes
    """
    resistance, inductance = shells.resistance, shells.inductance
    solve = splu(resistance).solve
    basis = pulls = np.zeros((resistance.shape[0], 0))
    block = solve(shells.flux)
    for _ in range(orders):
        first = basis.shape[1]
        for column in block.T:
            fresh, size = column, np.sqrt(column @ (resistance @ column))
            for _ in range(2):  # a second pass takes away what rounding left of the first
                fresh = fresh - basis @ (basis.T @ (resistance @ fresh))
            rest = np.sqrt(fresh @ (resistance @ fresh))
            if rest > DEPENDENT * size:
                basis = np.column_stack([basis, fresh / rest])
        if basis.shape[1] == first:
            break
        pull = inductance @ basis[:, first:]
        pulls = np.column_stack([pulls, pull])
        block = solve(pull)
    tau, turn = eigh(basis.T @ pulls)
    tau, shapes = tau[::-1], (basis @ turn)[:, ::-1]
    # A mode has no sign of its own: the largest entry is made positive, so that results can be compared.
    shapes = shapes * np.sign(shapes[np.argmax(np.abs(shapes), axis=0), np.arange(len(tau))])
    return StreamModes(tau, shapes.T @ shells.flux, shells.spread @ shapes)


def phasor_streams(shells: ThinShells, frequency_hz: float, *, tolerance: float = 1e-10) -> np.ndarray:
    """Return the stream functions in a field that swings, without any reduction, (n, 3) complex [A/T].

    ``(R + i w L) psi = -i w F`` by iteration on the lag, which converges where ``w tau < 1``.

    Raises
    ------
    ValueError
        If it does not converge: the frequency is too high.
    """
    omega = 2j * np.pi * frequency_hz
    solve = splu(shells.resistance).solve
    term = -omega * solve(shells.flux).astype(complex)
    total = term.copy()
    for _ in range(200):
        pull = shells.inductance @ np.column_stack([term.real, term.imag])
        back = solve(pull)
        term = -omega * (back[:, :3] + 1j * back[:, 3:])
        total += term
        if np.abs(term).max() < tolerance * np.abs(total).max():
            return shells.spread @ total
    msg = f"the currents at {frequency_hz:g} Hz lag too far for a series; choose a lower frequency"
    raise ValueError(msg)

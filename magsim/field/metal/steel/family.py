"""Steel of one shape in any material: the magnetization of an individual aircraft from that of its type.

Permeability and thickness only scale the stiffness of each part: ``(S + sum_p c_p A_p) u = S x``, with ``S`` and
``A_p`` of the shapes alone, ``c = mu_r - 1`` for a solid and times the thickness for a sheet. So a few solutions, cut
into their parts, span all others (reduced basis: A. Quarteroni, A. Manzoni, F. Negri, Reduced Basis Methods for Partial
Differential Equations, Springer 2016). The Galerkin solution in that space errs in the field by about the square of its
error in the charge, which is checked against whole solutions until it is below ``TOLERANCE``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve, svd

from magsim.aircraft.magnetics import Steel
from magsim.field.metal.steel.induced import Condensed, InducedModel, Part, Sheet
from magsim.field.metal.steel.meshing import check_apart, steel_parts, walls_of
from magsim.storage import kept
from magsim.streams import stream
from magsim.threads import one_blas_thread

Arrays = dict[str, np.ndarray]

SPAN = 3.0
"""Largest factor, either way, between the weight ``c`` of a part and that of its type."""

TOLERANCE = 1e-6
"""Largest relative error of the charge at the checks."""

CHECKS, BATCH, MOST = 4, 4, 64
"""Whole solutions that the space is checked against, that it grows by at a time, and that it may hold."""

DEPENDENT = 1e-10
"""Share of a part's largest direction below which another one is dropped."""


@dataclass(frozen=True)
class SteelFamily:
    """All steel of one shape, in the space of some solutions; see the module.

    Attributes
    ----------
    corners : (t, 3, 3) [m]
        Triangles that carry charge.
    part : (t,) int
        Number of the part that each belongs to.
    walls : (w, 3, 3) [m]
        Triangles around the solid parts, outward.
    wall_part : (w,) int
    shorted : (t, 3) [A/m]
        Charge of steel that shorts the ambient field inside of it.
    charges : (t, k) [A/m]
        Charge of each function of the space.
    outside : (k, k)
    right : (k, 3)
        ``S`` and ``S x`` in the space.
    stiffness : (k, k)
        ``A_p`` in the space: blocks along the diagonal.
    owner : (k,) int
        Number of the part that each function belongs to.
    """

    corners: np.ndarray
    part: np.ndarray
    walls: np.ndarray
    wall_part: np.ndarray
    shorted: np.ndarray
    charges: np.ndarray
    outside: np.ndarray
    right: np.ndarray
    stiffness: np.ndarray
    owner: np.ndarray

    def charge(self, weights: np.ndarray) -> np.ndarray:
        """Return the charge for ambient fields of 1 A/m along x, y and z, (t, 3) [A/m], for weights (parts,)."""
        with one_blas_thread():
            matrix = self.outside + weights[self.owner][:, None] * self.stiffness
            return self.shorted - self.charges @ solve(matrix, self.right, assume_a="pos")


def weights_of(steel: Sequence[Steel]) -> np.ndarray:
    """Return the weight ``c`` of each part, mirror images included, (parts,): 1 for a solid, m for a sheet."""
    return np.array(
        [(part.mu_r - 1.0) * (getattr(part, "thickness_m", None) or 1.0) for part in steel for _ in part.names]
    )


def _shape(part: Steel) -> dict[str, object]:
    """Return what a part's mesh depends on."""
    return part.model_dump(mode="json", exclude={"source", "mu_r", "thickness_m"})


def in_family(steel: Sequence[Steel], nominal: Sequence[Steel]) -> bool:
    """Return whether steel has the shapes of a type, and materials within its family's span."""
    if [_shape(part) for part in steel] != [_shape(part) for part in nominal]:
        return False
    own, of_type = weights_of(steel), weights_of(nominal)
    return bool(np.all(own <= SPAN * of_type) and np.all(of_type <= SPAN * own))


def load_family(nominal: Sequence[Steel], files: Mapping[str, bytes], digests: Mapping[str, str]) -> SteelFamily:
    """Return the family of a type's steel, from the cache where it is known.

    Parameters
    ----------
    nominal : sequence of Steel
    files : mapping of str to bytes
        Files of triangles.
    digests : mapping of str to str
        SHA-256 of each.

    Raises
    ------
    RequestError
        If a part's mesh is not sound, or parts touch.
    ValueError
        If the space does not reach ``TOLERANCE``.
    """
    key = {"shapes": [_shape(part) for part in nominal], "weights": weights_of(nominal), "files": dict(digests)}
    return SteelFamily(**kept("steel_family", key, lambda: _solve(nominal, files)))


def _unit(part: Part) -> Part:
    """Return a part of unit weight."""
    return replace(part, thickness_m=1.0, chi=1.0) if isinstance(part, Sheet) else replace(part, chi=1.0)


def _solve(nominal: Sequence[Steel], files: Mapping[str, bytes]) -> Arrays:
    """Return the arrays of a ``SteelFamily`` by name."""
    parts = steel_parts(nominal, files)
    check_apart(parts)
    walls = [walls_of(part) for part in parts.values()]
    # LU and Cholesky give other last bits on another number of threads.
    with one_blas_thread():
        model = InducedModel([_unit(part) for part in parts.values()])
        whole = model.condensed()
        shapes = {
            "corners": model.panels.corners,
            "part": model.part,
            "walls": np.concatenate(walls),
            "wall_part": np.repeat(np.arange(len(walls)), [len(wall) for wall in walls]),
            "shorted": whole.layer @ whole.nodes,
        }
        return shapes | _space(whole, weights_of(nominal))


def _whole_solution(whole: Condensed, weights: np.ndarray) -> np.ndarray:
    """Return ``u`` for three ambient fields, (b, 3), from all equations."""
    matrix = whole.outside.copy()
    for places, stiffness, weight in zip(whole.places, whole.stiffness, weights, strict=True):
        matrix[np.ix_(places, places)] += weight * stiffness
    return cho_solve(cho_factor(matrix, lower=True, overwrite_a=True), whole.outside @ whole.nodes)


def _space(whole: Condensed, weights: np.ndarray) -> Arrays:
    """Return the space and the equations in it, large enough for all weights within ``SPAN`` of those given."""
    random, sizes = stream(0, "steel/family"), (CHECKS + MOST, len(weights))
    drawn = weights * SPAN ** random.uniform(-1.0, 1.0, sizes)
    checks = [_whole_solution(whole, row) for row in drawn[:CHECKS]]
    solutions: list[np.ndarray] = []
    error = np.inf
    while len(solutions) < MOST:
        rows = drawn[CHECKS + len(solutions) :][:BATCH]
        solutions += [_whole_solution(whole, row) for row in rows]
        arrays = _reduced(whole, np.hstack(solutions))
        error = max(_error(whole, arrays, row, exact) for row, exact in zip(drawn, checks, strict=False))
        if error <= TOLERANCE:
            return arrays
    msg = f"the steel of individuals cannot be told from {MOST} solutions to better than {error:.2g}"
    raise ValueError(msg)


def _reduced(whole: Condensed, solutions: np.ndarray) -> Arrays:
    """Return the equations in the space of some solutions (b, k), each cut into its parts."""
    functions, owner = [], []
    for number, places in enumerate(whole.places):
        left, sizes, _ = svd(solutions[places], full_matrices=False)
        kept = left[:, sizes > DEPENDENT * sizes[0]]
        function = np.zeros((len(solutions), kept.shape[1]))
        function[places] = kept
        functions.append(function)
        owner += [number] * kept.shape[1]
    space, numbers = np.hstack(functions), np.array(owner)
    stiffness = np.zeros((len(numbers), len(numbers)))
    for number, (places, matrix) in enumerate(zip(whole.places, whole.stiffness, strict=True)):
        at = np.flatnonzero(numbers == number)
        local = space[np.ix_(places, at)]
        stiffness[np.ix_(at, at)] = local.T @ matrix @ local
    return {
        "charges": whole.layer @ space,
        "outside": space.T @ whole.outside @ space,
        "right": space.T @ (whole.outside @ whole.nodes),
        "stiffness": stiffness,
        "owner": numbers,
    }


def _error(whole: Condensed, arrays: Arrays, weights: np.ndarray, exact: np.ndarray) -> float:
    """Return the relative error of the charge in the space."""
    matrix = arrays["outside"] + weights[arrays["owner"]][:, None] * arrays["stiffness"]
    got = arrays["charges"] @ solve(matrix, arrays["right"], assume_a="pos")
    off = np.linalg.norm(got - whole.layer @ exact)
    return float(off / np.linalg.norm(whole.layer @ (whole.nodes - exact)))

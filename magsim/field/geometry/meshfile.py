"""Triangles from a file of a user: STL, PLY or OBJ. The bytes are all that is read; nothing that they name is."""

import io
import logging

import numpy as np
import trimesh

from magsim.field.geometry.meshes import TriangleMesh

MAX_TRIANGLES = 6000
"""Most triangles of a file: the cost grows with their cube."""

STRUCTURAL = np.array([-1.0, 1.0, -1.0])
"""From aft, right, up to forward, right, down."""


def read_surface(content: bytes, kind: str) -> TriangleMesh:
    """Read the triangles of a file and merge equal corners.

    Parameters
    ----------
    content : bytes
    kind : str
        ``stl``, ``ply`` or ``obj``.

    Returns
    -------
    TriangleMesh
        In units and axes of the file.

    Raises
    ------
    ValueError
        If it is no such file, or holds no triangles, too many, or places that are not finite.
    """
    logger = logging.getLogger("trimesh")
    silent, logger.disabled = logger.disabled, True
    try:
        mesh = trimesh.load_mesh(io.BytesIO(content), file_type=kind, process=False, resolver=None, skip_materials=True)
        vertices, triangles = np.array(mesh.vertices, dtype=float), np.array(mesh.faces, dtype=int)
    except Exception as error:  # whatever the reader stumbles over, the file is the reason
        reason = (str(error).splitlines() or [type(error).__name__])[0][:200]
        msg = f"cannot be read as {kind.upper()} ({reason}); allowed: a file of triangles"
        raise ValueError(msg) from error
    finally:
        logger.disabled = silent
    if triangles.ndim != 2 or len(triangles) == 0 or triangles.shape[1] != 3:
        msg = f"holds no triangles that can be read as {kind.upper()}"
        raise ValueError(msg)
    if len(triangles) > MAX_TRIANGLES:
        msg = f"has {len(triangles)} triangles; allowed: up to {MAX_TRIANGLES}; simplify it"
        raise ValueError(msg)
    if triangles.min() < 0 or triangles.max() >= len(vertices) or not np.all(np.isfinite(vertices)):
        msg = "has corners that are not there or not finite numbers"
        raise ValueError(msg)
    return _joined(vertices, triangles)


def _joined(vertices: np.ndarray, triangles: np.ndarray) -> TriangleMesh:
    """Merge corners at the same place: an STL file repeats them, rounded to single precision."""
    used = vertices[np.unique(triangles)]
    step = 1e-6 * float(np.ptp(used, axis=0).max())
    grid = np.rint((vertices - used.min(axis=0)) / step) if step > 0.0 else np.zeros_like(vertices)
    _, first, number = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    kept, renumbered = np.unique(number.ravel()[triangles], return_inverse=True)
    return TriangleMesh(vertices[first[kept]], renumbered.reshape(-1, 3))


def placed(surface: TriangleMesh, *, unit_m: float, structural: bool, position: np.ndarray) -> TriangleMesh:
    """Return the surface in meters and body axes."""
    turned = surface.vertices * (STRUCTURAL if structural else 1.0)
    return TriangleMesh(turned * unit_m + position, surface.triangles)

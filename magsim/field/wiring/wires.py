"""Wiring: the field of a conductor for each ampere at any place, by Biot and Savart's law on straight pieces.

A conductor is one or more closed loops: current has a way there and a way back, and a wire without its way back has no
field of its own. The integral over each straight piece is exact, so the field is that of the polygons themselves.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from magsim.field.metal.coils import Loop
from magsim.units import NT_PER_T

PER_TURN = 16
"""Straight pieces in one turn of a twisted pair."""

CHUNK = 200_000
"""Pairs of a point and a piece that are worked on at a time."""


@dataclass(frozen=True)
class Conductor:
    """Loops that carry one and the same current.

    Attributes
    ----------
    name : str
    loops : tuple of Loop
        Vertices in the sense of positive current.
    shares : tuple of float
        Part of the conductor's current in each loop.
    """

    name: str
    loops: tuple[Loop, ...]
    shares: tuple[float, ...]


def pair(vertices: np.ndarray, offset: np.ndarray) -> np.ndarray:
    """Return the closed polygon of a wire and its return beside it.

    Parameters
    ----------
    vertices : (m, 3) [m]
        The wire from the source to the load.
    offset : (3,) [m]
        From the wire to its return.

    Returns
    -------
    (2 m, 3) [m]
    """
    return np.concatenate([vertices, vertices[::-1] + offset])


def _sampled(vertices: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return points along a polyline, their path lengths, unit tangents, and vectors across: (q, 3), (q,), (q, 3) x 2.

    The unit vectors across the tangents turn with them by the least rotation, at the corners.
    """
    points, lengths, tangents, across, run = [], [], [], [], 0.0
    level = np.zeros(3)
    for start, end in itertools.pairwise(vertices):
        length = float(np.linalg.norm(end - start))
        at = np.linspace(0.0, 1.0, max(1, int(np.ceil(length / step))) + 1)
        points.append(start + at[:, None] * (end - start))
        lengths.append(run + at * length)
        tangent = (end - start) / length
        level = _across(level if len(points) > 1 else np.eye(3)[np.argmin(np.abs(tangent))], tangent)
        tangents.append(np.broadcast_to(tangent, (len(at), 3)))
        across.append(np.broadcast_to(level, (len(at), 3)))
        run += length
    return np.concatenate(points), np.concatenate(lengths), np.concatenate(tangents), np.concatenate(across)


def _across(before: np.ndarray, tangent: np.ndarray) -> np.ndarray:
    """Return a unit vector across a tangent, the nearest to one that was across another, (3,)."""
    level = before - tangent * (before @ tangent)
    if np.linalg.norm(level) < 1e-6:  # a corner of 90 degrees in the plane of the vector
        level = np.cross(tangent, np.eye(3)[np.argmin(np.abs(tangent))])
    return level / np.linalg.norm(level)


def twisted(vertices: np.ndarray, spacing_m: float, pitch_m: float, *, per_turn: int = PER_TURN) -> np.ndarray:
    """Return the closed polygon of two wires wound around one line, current there in one and back in the other.

    Parameters
    ----------
    vertices : (m, 3) [m]
        The line from the source to the load.
    spacing_m : float [m]
        Between the axes of the two wires.
    pitch_m : float [m]
        Length of one turn along the line.
    per_turn : int
        Straight pieces in one turn.

    Returns
    -------
    (2 q, 3) [m]
    """
    points, lengths, tangents, first = _sampled(np.asarray(vertices, dtype=float), pitch_m / per_turn)
    second = np.cross(tangents, first)
    phase = 2.0 * np.pi * lengths[:, None] / pitch_m
    arm = 0.5 * spacing_m * (np.cos(phase) * first + np.sin(phase) * second)
    return np.concatenate([points + arm, (points - arm)[::-1]])


def _chunks(points: np.ndarray, pieces: int) -> list[slice]:
    size = max(1, CHUNK // pieces)
    return [slice(start, start + size) for start in range(0, len(points), size)]


def field(conductors: Sequence[Conductor], points: np.ndarray) -> np.ndarray:
    """Return the gains of conductors: ``B = W I``.

    Parameters
    ----------
    conductors : sequence of Conductor
        ``c`` of them.
    points : (p, 3) [m]
        Outside the wires.

    Returns
    -------
    (p, 3, c) [nT/A]
    """
    points = np.asarray(points, dtype=float)
    out = np.zeros((len(points), 3, len(conductors)))
    for c, conductor in enumerate(conductors):
        for loop, share in zip(conductor.loops, conductor.shares, strict=True):
            for rows in _chunks(points, len(loop.vertices)):
                out[rows, :, c] += NT_PER_T * share * loop.field(points[rows])
    return out

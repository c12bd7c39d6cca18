"""Joints of a skin against exact answers."""

import numpy as np
import pytest

from magsim.field.geometry.meshes import TriangleMesh, icosphere
from magsim.field.metal.skin.shells import Seams, ThinShells, driven_modes

CONDUCTANCE = 1.74e4


def _ring(inner: float, outer: float, around: int, across: int) -> TriangleMesh:
    """A flat ring; node ``i * around + j`` lies at the radius ``i`` and the angle ``j``."""
    angle = 2.0 * np.pi * np.arange(around) / around
    radius = np.linspace(inner, outer, across + 1)[:, None]
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0.0 * radius * angle], axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape(across + 1, around)
    ahead = np.roll(number, -1, axis=1)
    a, b, c, d = (part.ravel() for part in (number[:-1], ahead[:-1], ahead[1:], number[1:]))
    return TriangleMesh(points, np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])[:, ::-1])


def _slow_moment(shells: ThinShells) -> float:
    """Moment along z over the rate of a field along z, for slow motion."""
    return float((driven_modes(shells, 1).drive[:, 2] ** 2).sum())


def test_joints_all_around_a_ring() -> None:
    """Many joints across the current are a resistivity ``q / r``: J = -(r dB/dt / 2) / (1 / (sigma t) + q / r)."""
    inner, outer, around, across = 0.3, 0.8, 72, 18
    mesh = _ring(inner, outer, around, across)
    number = np.arange(len(mesh.vertices)).reshape(across + 1, around)
    edges = np.stack([number[:-1], number[1:]], axis=-1).reshape(-1, 2)
    ohm_m = 2.0e-6
    shells = ThinShells(mesh, CONDUCTANCE, Seams(edges, np.full(len(edges), ohm_m)))
    nodes, weights = np.polynomial.legendre.leggauss(40)
    r = inner + 0.5 * (outer - inner) * (nodes + 1.0)
    resistivity = 1.0 / CONDUCTANCE + around * ohm_m / (2.0 * np.pi * r)
    exact = 0.5 * np.pi * 0.5 * (outer - inner) * float(weights @ (r**3 / resistivity))
    assert _slow_moment(shells) == pytest.approx(exact, rel=0.004)
    assert _slow_moment(ThinShells(mesh, CONDUCTANCE)) > 1.5 * exact  # without joints it is another figure


def test_one_joint_in_a_narrow_ring() -> None:
    """The whole current crosses it: the resistance is 2 pi a / (sigma t w) + ohm_m / w."""
    inner, outer, around = 0.78, 0.80, 240
    mesh, ohm_m = _ring(inner, outer, around, 2), 5e-5
    edges = np.array([[0, around], [around, 2 * around]])
    ratio = _slow_moment(ThinShells(mesh, CONDUCTANCE, Seams(edges, np.full(2, ohm_m))))
    ratio /= _slow_moment(ThinShells(mesh, CONDUCTANCE))
    around_m = np.pi * (inner + outer) / CONDUCTANCE
    assert ratio == pytest.approx(around_m / (around_m + ohm_m), rel=1e-3)


def test_a_joint_along_the_current_does_nothing() -> None:
    """Around a sphere in a field along z the currents run along its equator."""
    sphere = icosphere(3, 0.8, keep="area")
    height = sphere.vertices[:, 2]
    ends = np.sort(np.stack([sphere.triangles, np.roll(sphere.triangles, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    edges = np.unique(ends[np.all(np.abs(height[ends]) < 1e-9, axis=1)], axis=0)
    assert len(edges) > 10
    plain, jointed = (
        ThinShells(sphere, CONDUCTANCE, seams)
        for seams in (Seams(edges, np.zeros(len(edges))), Seams(edges, np.ones(len(edges))))
    )
    assert _slow_moment(jointed) == pytest.approx(_slow_moment(plain), rel=1e-9)
    # A field across drives currents through it: of two insulated halves less than of the whole.
    across = [float((driven_modes(shells, 1).drive[:, 0] ** 2).sum()) for shells in (plain, jointed)]
    assert across[1] < 0.8 * across[0]

"""Wiring: its field against a circle and against magpylib, its pulses against their charge."""

import magpylib as magpy
import numpy as np

from magsim.aircraft import load_aircraft
from magsim.field.metal.coils import Loop
from magsim.field.wiring import wires
from magsim.field.wiring.harness import Wiring
from magsim.field.wiring.loads import Steps, pulses
from magsim.units import MU0, NT_PER_T
from tests.benchmarks.rows import Row, at_most, stated


def circle_error() -> float:
    """Relative error of a circle of 64 sides of equal area, from its center to 4 radii on its axis."""
    sides = 64
    corner = np.sqrt(np.pi / (sides * np.sin(np.pi / sides) * np.cos(np.pi / sides)))
    angle = 2.0 * np.pi * np.arange(sides) / sides
    ring = Loop(corner * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(sides)]), 1e-3)
    height = np.array([0.0, 0.25, 0.5, 1.0, 2.0, 4.0])
    points = np.column_stack([np.zeros((len(height), 2)), height])
    exact = NT_PER_T * MU0 / (2.0 * (1.0 + height**2) ** 1.5)
    gains = wires.field([wires.Conductor("ring", (ring,), (1.0,))], points)[:, 2, 0]
    return float(np.abs(gains / exact - 1.0).max())


def oracle_error(aircraft: str) -> float:
    """Largest difference to magpylib at the mounts over the field of a conductor's wires, worst conductor."""
    magnetics = load_aircraft(aircraft).magnetics
    points = np.array([mount.position_m for mount in magnetics.mounts.values()])
    worst = 0.0
    for conductor in Wiring.of(magnetics).conductors:
        theirs, size = np.zeros((len(points), 3)), 0.0
        for loop, share in zip(conductor.loops, conductor.shares, strict=True):
            closed = np.vstack([loop.vertices, loop.vertices[:1]])
            theirs += NT_PER_T * share * magpy.current.Polyline(current=1.0, vertices=closed).getB(points)
            half = closed[: len(closed) // 2 + 1]
            size += np.abs(NT_PER_T * share * magpy.current.Polyline(current=1.0, vertices=half).getB(points)).max()
        ours = wires.field([conductor], points)[..., 0]
        worst = max(worst, float(np.abs(ours - theirs).max()) / size)
    return worst


def pulse_error() -> float:
    """Relative error of the mean of pulses of 1.3 ms each 1.15 s over 200 of them, at 120 Hz."""
    step, period, width = 1.0 / 120.0, 1.15, 0.0013
    times = pulses(-2.0, 240.0, period, width, 0.017)
    at = (np.arange(round(200 * period / step)) + 0.5) * step
    mean = Steps(times, np.tile([8.0, 0.0], len(times) // 2)).mean(at, step).mean()
    return float(abs(mean / (8.0 * width / period) - 1.0))


def rows() -> list[Row]:
    """Figures of the wiring."""
    return [
        at_most("wire_circle_64_error", circle_error(), "1", 1e-6),
        at_most("wire_oracle_c208b_error", oracle_error("c208b"), "1", 1e-9),
        at_most("wire_oracle_uav_error", oracle_error("uav"), "1", 1e-9),
        at_most("pulse_mean_error", pulse_error(), "1", 1e-10),
        stated("wire_feeders_c208b", len(load_aircraft("c208b").magnetics.feeders), "1"),
    ]

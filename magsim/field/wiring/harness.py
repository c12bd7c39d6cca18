"""The wiring of an aircraft: the paths of its file as polygons, and their gains at any place."""

from dataclasses import dataclass

import numpy as np

from magsim.aircraft.magnetics import Circuit, Magnetics
from magsim.aircraft.magnetics import circuits as model
from magsim.field.metal.coils import Loop
from magsim.field.wiring import wires


@dataclass(frozen=True)
class Wiring:
    """The wires of an aircraft.

    Attributes
    ----------
    circuits : tuple of magsim.field.wiring.wires.Circuit
        In the order of the aircraft's file.
    """

    circuits: tuple[wires.Circuit, ...]

    @classmethod
    def of(cls, magnetics: Magnetics) -> "Wiring":
        """Polygons of all circuits of a magnetic file."""
        return cls(tuple(_polygons(circuit) for circuit in magnetics.circuits))

    def at(self, points: np.ndarray) -> np.ndarray:
        """Field of each circuit for 1 A at any points (p, 3) [m], (p, 3, c) [nT/A]."""
        return wires.field(self.circuits, points)

    def gradient_at(self, points: np.ndarray) -> np.ndarray:
        """Derivatives of ``at`` by place, indexed (p, i, j, c) [nT/(A m)]."""
        return wires.gradient(self.circuits, points)


def _polygons(circuit: Circuit) -> wires.Circuit:
    loops, shares = [], []
    for path in circuit.paths:
        vertices = np.array(path.vertices_m)
        if isinstance(path, model.PairPath):
            vertices = wires.pair(vertices, np.array(path.offset_m))
        elif isinstance(path, model.TwistedPath):
            vertices = wires.twisted(vertices, path.spacing_m, path.pitch_m)
        sides = (1.0, -1.0) if path.mirror else (1.0,)
        for side in sides:
            loops.append(Loop(vertices * (1.0, side, 1.0), circuit.wire_radius_m))
            shares.append(path.share)
    return wires.Circuit(circuit.name, tuple(loops), tuple(shares))

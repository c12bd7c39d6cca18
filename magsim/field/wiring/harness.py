"""The wiring of an aircraft: the paths of its file as polygons, and their gains at any place."""

from dataclasses import dataclass

import numpy as np

from magsim.aircraft.magnetics import Feeder, Magnetics
from magsim.aircraft.magnetics import feeders as model
from magsim.field.metal.coils import Loop
from magsim.field.wiring import wires


@dataclass(frozen=True)
class Wiring:
    """The wires of an aircraft.

    Attributes
    ----------
    feeders : tuple of magsim.field.wiring.wires.Conductor
        In the order of the aircraft's file.
    """

    conductors: tuple[wires.Conductor, ...]

    @classmethod
    def of(cls, magnetics: Magnetics) -> "Wiring":
        """Return the polygons of all feeders of a magnetic file."""
        return cls(tuple(_polygons(feeder) for feeder in magnetics.feeders))

    def at(self, points: np.ndarray) -> np.ndarray:
        """Return the field of each feeder for 1 A at any points (p, 3) [m], (p, 3, c) [nT/A]."""
        return wires.field(self.conductors, points)


def _polygons(feeder: Feeder) -> wires.Conductor:
    loops, shares = [], []
    for path in feeder.paths:
        vertices = np.array(path.vertices_m)
        if isinstance(path, model.PairPath):
            vertices = wires.pair(vertices, np.array(path.offset_m))
        elif isinstance(path, model.TwistedPath):
            vertices = wires.twisted(vertices, path.spacing_m, path.pitch_m)
        sides = (1.0, -1.0) if path.mirror else (1.0,)
        for side in sides:
            loops.append(Loop(vertices * (1.0, side, 1.0), feeder.wire_radius_m))
            shares.append(path.share)
    return wires.Conductor(feeder.name, tuple(loops), tuple(shares))

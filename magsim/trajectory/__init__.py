"""How bodies moved, and what a flight leaves behind."""

from magsim.trajectory.flight import Flight, ManeuverFlown, Segment
from magsim.trajectory.motion import Trajectory, Turning, hermite_spline

__all__ = ["Flight", "ManeuverFlown", "Segment", "Trajectory", "Turning", "hermite_spline"]

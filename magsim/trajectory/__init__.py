"""Motion of bodies, and the result of a flight."""

from magsim.trajectory.flight import CycleFlown, Flight, ManeuverFlown, Segment
from magsim.trajectory.motion import AttitudeCurve, Trajectory, hermite_spline

__all__ = ["AttitudeCurve", "CycleFlown", "Flight", "ManeuverFlown", "Segment", "Trajectory", "hermite_spline"]

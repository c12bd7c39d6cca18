"""Flying: a scenario and its aircraft become a flight."""

from magsim.flight.flying import bare_run, fly

__all__ = ["bare_run", "fly"]

"""Where the repository lies, and the official reference data that may lie beside it."""

from pathlib import Path

ROOT = Path(__file__).parents[2]

REFERENCE_DATA = ROOT.parent / "shared" / "data"
"""Tables of others; a user's clone has none, and tests that need them run only where it does."""

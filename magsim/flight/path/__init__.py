"""The path over ground: patterns, turns, heights."""

"""Parts of ``loader_speed``."""

"""Files that other programs open, and recordings made of files that others wrote."""

from magsim.exchange.outgoing import FORMATS, export, pick, targets

__all__ = ["FORMATS", "export", "pick", "targets"]

"""Files that other programs open, and recordings made of files that others wrote."""

from magsim.exchange.columnmap import ColumnMap
from magsim.exchange.incoming import SOURCES, Imported, import_flight
from magsim.exchange.outgoing import FORMATS, export, pick, stem, targets

__all__ = ["FORMATS", "SOURCES", "ColumnMap", "Imported", "export", "import_flight", "pick", "stem", "targets"]

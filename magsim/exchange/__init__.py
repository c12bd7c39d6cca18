"""Export of recordings to other programs, and import of their files."""

from magsim.exchange.columnmap import ColumnMap
from magsim.exchange.exporting import FORMATS, export, pick, stem, targets
from magsim.exchange.importing import SOURCES, Imported, import_flight

__all__ = ["FORMATS", "SOURCES", "ColumnMap", "Imported", "export", "import_flight", "pick", "stem", "targets"]

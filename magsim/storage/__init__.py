"""Files: written whole or not at all, kept by content, and opened with care."""

from magsim.storage.atomic import atomic_write, check_target
from magsim.storage.cache import cache_folder, cached

__all__ = ["atomic_write", "cache_folder", "cached", "check_target"]

"""Files: written completely or not at all, cached by content, and read without trust."""

from magsim.storage.atomic import atomic_text, atomic_write, check_target
from magsim.storage.cache import cache_folder, cached, kept, reported
from magsim.storage.folder import atomic_folder, check_folder_target

__all__ = [
    "atomic_folder",
    "atomic_text",
    "atomic_write",
    "cache_folder",
    "cached",
    "check_folder_target",
    "check_target",
    "kept",
    "reported",
]

"""A cache without results for processes that are to compute everything anew."""

from pathlib import Path

from magsim.storage import cache_folder


def without_results(folder: Path) -> str:
    """Make a cache that shares nothing but compiled code, which holds no results, with that of all tests."""
    folder.mkdir()
    (folder / "compiled").symlink_to(cache_folder() / "compiled")
    return str(folder)

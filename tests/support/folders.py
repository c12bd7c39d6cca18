"""Small folders of recordings."""

from pathlib import Path

import numpy as np

from magsim.dataset import FileEntry, Manifest
from magsim.recording import Recording
from magsim.storage import checksum


def flight(name: str, splits: list[float] | None, *, rows: int = 0) -> Recording:
    """A flight with a row for each code of ``splits``; without that column if it is None."""
    n = rows if splits is None else len(splits)
    data = {"mag_cabin_nt": np.arange(n) + 0.5}
    if splits is not None:
        data["split"] = np.array(splits, dtype=float)
    return Recording(name, np.arange(n) * 0.1, data, {"seed": 1})


def manifest_of(folder: Path, **entries: dict[str, object]) -> Manifest:
    """The manifest of a folder; keywords are further keys of its files, by their names without ``.h5``."""
    files = tuple(
        FileEntry(
            name=path.name,
            sha256=checksum.checksum_state(path).digest,
            size=path.stat().st_size,
            flights=(),
            **entries.get(path.stem, {}),
        )
        for path in sorted(folder.glob("*.h5"))
    )
    return Manifest(manifest=1, dataset="some", made_on={}, files=files)

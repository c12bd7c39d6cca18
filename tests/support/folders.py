"""Small folders of recordings."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from magsim.dataset import FileEntry, Manifest, parquet
from magsim.dataset.index import index_file
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


def write_index_of(
    folder: Path,
    further: dict[str, str] | None = None,
    values: Callable[[str], dict[str, object]] = lambda name: {},
    failed: int = 0,
) -> Path:
    """Write the index of the files of a folder, with further columns and rows of flights that failed."""

    def rows() -> Iterator[dict[str, object]]:
        flight = 0
        for path in sorted(folder.glob("*.h5")):
            sha256 = checksum.checksum_state(path).digest
            for info in index_file(path):
                splits = {f"{split}_rows": info.splits.get(split, 0) for split in ("train", "valid", "test")}
                place = {"file": path.name, "number": info.number, "rows": info.rows, **splits}
                about = {"duration_s": 0.1 * (info.rows - 1), "digest": "d", "seed": 7, "sha256": sha256}
                known = {"flight": flight, "name": info.name, "flown": True, "failure": None}
                yield known | place | about | values(info.name)
                flight += 1
        for number in range(failed):
            none = dict.fromkeys(("rows", "train_rows", "valid_rows", "test_rows"), 0)
            known = {"flight": flight + number, "name": f"lost_{number}", "flown": False, "failure": "stalled"}
            about = {"file": None, "number": -1, "duration_s": 0.0, "digest": "d", "seed": 7, "sha256": None}
            yield known | about | none | {"duration_s": float("nan")}

    path = folder / parquet.INDEX
    parquet.write_index(path, rows(), further or {})
    return path

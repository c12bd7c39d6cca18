"""What was measured already: one line of JSON for each piece of work, so that what is broken off goes on."""

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any


class Journal:
    """Results by what they are results of, in a file that only grows.

    A last line that was broken off is left aside, and so are results of other sources.

    Parameters
    ----------
    path : Path
        Made with its folder when the first result comes.
    sources : str
        Digest of what the results depend on.

    Attributes
    ----------
    stale : int
        Results of other sources.
    """

    def __init__(self, path: Path, sources: str) -> None:
        self._path, self._sources = path, sources
        self._found: dict[str, Any] = {}
        self.stale = 0
        self._whole = True
        for line in path.read_text(encoding="utf-8").splitlines(keepends=True) if path.exists() else ():
            self._whole = line.endswith("\n")
            try:
                kept = json.loads(line)
                self._take(kept["of"], kept["sources"], kept["found"])
            except (ValueError, KeyError, TypeError):
                continue

    def _take(self, of: Mapping[str, Any], sources: str, found: Any) -> None:
        if sources == self._sources:
            self._found[_key(of)] = found
        else:
            self.stale += 1

    def get(self, of: Mapping[str, Any]) -> Any | None:
        """Return the result of a piece of work; None if there is none."""
        return self._found.get(_key(of))

    def add(self, of: Mapping[str, Any], found: Any) -> None:
        """Keep a result; it is on the disk when this returns."""
        self._path.parent.mkdir(parents=True, exist_ok=True)
        line = json.dumps({"of": of, "sources": self._sources, "found": found}) + "\n"
        with self._path.open("a", encoding="utf-8") as file:
            file.write(line if self._whole else "\n" + line)
            file.flush()
            os.fsync(file.fileno())
        self._whole = True
        # as it will be read
        self._found[_key(of)] = json.loads(line)["found"]


def _key(of: Mapping[str, Any]) -> str:
    return json.dumps(of, sort_keys=True)

"""The manifest of a data set: its files with their checksums, and the kind of machine that made them."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, ValidationError

from magsim import columns
from magsim.config import Name, Strict
from magsim.dataset.index import split_rows
from magsim.errors import DataError
from magsim.files import first_bytes
from magsim.recording import Recording

MANIFEST = "manifest.json"
"""Name of the file that lists a data set."""

MAX_BYTES = 100_000_000
"""Largest manifest, or other text beside the data, that is read."""

Count = Annotated[int, Field(ge=0)]
Sha256 = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
Text = Annotated[str, Field(max_length=1000)]


class FlightEntry(Strict):
    """One flight as a manifest lists it."""

    name: Name
    rows: Count
    digest: Text = Field(description="of the scenario with its aircraft")
    individual: Count | None = Field(default=None, description="which aircraft of its type flew; not the nominal one")
    day: Count | None = Field(default=None, description="on which of its days, where one was set")
    splits: dict[Literal["train", "valid", "test"], Count] = Field(description="rows of each split")

    def rows_in(self, split: str) -> int:
        """Return the number of rows in a split, 0 if it has none."""
        return sum(count for name, count in self.splits.items() if name == split)

    @classmethod
    def of(cls, recording: Recording) -> "FlightEntry":
        """Describe a simulated recording."""
        meta, split = recording.meta, columns.SPLIT.pattern
        entry = {
            "name": recording.name,
            "rows": len(recording),
            "digest": str(meta.get("digest", "")),
            "individual": meta.get("individual") or None,
            "day": meta.get("day") or None,
            "splits": split_rows(recording[split]) if split in recording else {},
        }
        return cls.model_validate(entry)


class FileEntry(Strict):
    """One recording file as a manifest lists it."""

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*\.h5$", max_length=60)]
    sha256: Sha256
    size: Count
    group: Name | None = Field(
        default=None, description="methods are fitted on the training rows of a group and judged on its test rows"
    )
    level: int | None = Field(default=None, ge=0, le=1000, description="step of difficulty")
    flights: tuple[FlightEntry, ...]


class Manifest(Strict):
    """The files of a data set and the kind of machine that made them."""

    manifest: Literal[1] = Field(description="version of this format")
    dataset: Name
    made_on: dict[Annotated[str, Field(max_length=40)], Text] = Field(
        description="versions and processor features that decide the last bits"
    )
    files: tuple[FileEntry, ...]

    @property
    def size(self) -> int:
        """Size of all files [bytes]."""
        return sum(entry.size for entry in self.files)

    @property
    def flights(self) -> Mapping[str, FlightEntry]:
        """All flights by name."""
        return {flight.name: flight for entry in self.files for flight in entry.flights}

    def to_json(self) -> str:
        """Return the text of the file: the same for the same manifest."""
        return json.dumps(self.model_dump(mode="json", exclude_none=True), indent=1) + "\n"


def read_bounded(path: Path) -> bytes:
    """Read a file that describes a data set.

    Raises
    ------
    RequestError
        If it cannot be read.
    DataError
        If it is too large to be one.
    """
    data = first_bytes(path, MAX_BYTES + 1, kind="a file")
    if len(data) > MAX_BYTES:
        msg = f"{path}: is larger than {MAX_BYTES // 1_000_000} MB, so it describes no data set"
        raise DataError(msg)
    return data


def read_manifest(path: Path) -> Manifest:
    """Read a manifest from anywhere.

    Raises
    ------
    RequestError
        If there is no such file.
    DataError
        If it is no manifest.
    """
    data = read_bounded(path)
    try:
        return Manifest.model_validate_json(data)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False, include_context=False)[0]
        where = ".".join(str(part) for part in first["loc"])
        msg = f"{path}: is no manifest of a data set: {where + ': ' if where else ''}{first['msg']}"
        raise DataError(msg) from None

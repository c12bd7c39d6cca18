"""Verification of a recording file: by its checksums, and by the table of columns."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from magsim import columns
from magsim.errors import DataError
from magsim.recording import file
from magsim.storage import hdf5
from magsim.storage.checksum import checksum_state

_DETAILS = {"column_units": "unit", "column_frames": "frame"}
"""Details of columns that must be those of this version. The wording of meanings may change from version to version."""

_MEANINGS = "column_meanings"
_MOST = 20


@dataclass(frozen=True)
class Verified:
    """A sound file.

    Attributes
    ----------
    flights : tuple of str
        Their names.
    rows : int
        In sum.
    columns : int
        Most that a flight has.
    size : int [bytes]
    digest : str
        SHA-256 of the whole file.
    """

    flights: tuple[str, ...]
    rows: int
    columns: int
    size: int
    digest: str


def verify(path: Path) -> Verified:
    """Check a recording file in every byte.

    The checksum at its end is that of all bytes before it, so that any change is found; the checksums of the data sets
    locate it. Names, units, frames, shapes and types are compared with the table of columns of this version.

    Parameters
    ----------
    path : Path

    Returns
    -------
    Verified

    Raises
    ------
    RequestError
        If there is no such file.
    DataError
        If anything differs: one line for each difference.
    """
    state = checksum_state(path)
    differences = [] if state.kind == "good" else [f"{path}: {state.reason}"]
    names, rows, widest = [], 0, 0
    try:
        with hdf5.open_untrusted(path, ignore_checksum=True) as root:
            summed = root.attributes().get("schema_version") != 1
            for group in file.flight_groups(root):
                try:
                    differences += [f"{group.where}: {text}" for text in _differences(group, summed=summed)]
                    stored = file.read_flight(group)
                except DataError as error:
                    differences.append(str(error))
                    continue
                names.append(stored.name)
                rows += len(stored.time_s)
                widest = max(widest, len(stored.data))
    except DataError as error:
        differences.append(str(error))
    if differences:
        unique = list(dict.fromkeys(differences))
        more = [f"{path}: {len(unique) - _MOST} more differences"] if len(unique) > _MOST else []
        raise DataError("\n".join(unique[:_MOST] + more))
    return Verified(tuple(names), rows, widest, path.stat().st_size, state.digest)


def _differences(group: hdf5.Reader, *, summed: bool) -> Iterator[str]:
    """Describe what differs in one flight, in words that follow its name."""
    present = group.names()
    known = {columns.TIME, "texts", *columns.ROLES, *(f"{role}_channel" for role in columns.ROLES)}
    for name in present:
        if name not in known:
            yield f"{name} is not part of the layout"
    if summed:
        for name in (name for name in present if name in known - {"texts"}):
            ndim = 2 if name in columns.ROLES else 1
            yield from _sum_differs(group, name, kind="S" if name.endswith("_channel") else "f", ndim=ndim)
        if "texts" in present:
            texts = group.group("texts")
            for name in texts.names():
                yield from (f"texts/{text}" for text in _sum_differs(texts, name, kind="S", ndim=0))
    for role in columns.ROLES:
        if role in present:
            group.block(role, ndim=2)
            yield from _details_differ(group, role)


def _sum_differs(group: hdf5.Reader, name: str, *, kind: str, ndim: int) -> Iterator[str]:
    recorded = group.text_attribute(name, file.CHECKSUM)
    if recorded is None:
        yield f"{name} has no attribute {file.CHECKSUM}"
    elif recorded != file.checksum(np.asarray(group.array(name, kind=kind, ndim=ndim))):
        yield f"the values of {name} are not those that were written (its checksum differs)"


def _details_differ(group: hdf5.Reader, role: str) -> Iterator[str]:
    names = [name.decode("utf-8", "replace") for name in group.array(f"{role}_channel", kind="S", ndim=1).tolist()]
    for attribute in (*_DETAILS, _MEANINGS):
        texts = group.texts_attribute(role, attribute)
        if len(texts) != len(names):
            yield f"{role} has {len(names)} columns, but attribute {attribute} has {len(texts)} entries"
            continue
        detail = _DETAILS.get(attribute)
        for name, text in zip(names, texts, strict=True):
            family = columns.find(name)
            if detail is not None and family is not None and getattr(family, detail) != text:
                yield f"column {name} has {detail} {text[:60]!a}; the table of columns has {getattr(family, detail)!a}"

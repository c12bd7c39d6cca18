"""Recordings in HDF5 files, which netCDF tools read as well; ``docs/format.md`` describes the layout in full.

Layout::

    attributes: Conventions, title, schema_version, generator
    flights/000001/
      attributes: name, and one for each entry of Recording.meta; lists and tables as JSON, named *_json
      time_s          (n,)    float64  dimension scale; units "seconds since ...", axis "T"
      input_channel   (c,)    bytes    dimension scale: names of the columns of input
      input           (n, c)  float64  contiguous, not packed; attributes column_units, column_frames, column_meanings
      label, truth, segment            as input, each with its *_channel
      texts/<key>     ()      bytes    entries of meta that are too long for an attribute

Each data set has an attribute sha256, of its values.

The same recordings give the same bytes: no clock, no path, no host. A checksum line follows the data (see
``magsim.storage.hdf5``).
"""

import hashlib
import json
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

import magsim
from magsim import columns, storage
from magsim.errors import DataError, RequestError
from magsim.storage import hdf5, inspection

if TYPE_CHECKING:
    import h5py

SCHEMA = 2
"""Version of the layout that is written."""

READABLE = (1, 2)
"""Versions that are read. 1 has no checksums of its data sets."""

CHECKSUM = "sha256"
"""Attribute of a data set: SHA-256 of its values."""

ATTRIBUTE_BYTES = 60_000
"""Longest attribute: HDF5 keeps it in the header of its object, which ends at 64 kB."""

_JSON = "_json"
_RESERVED = ("name",)
_DETAILS = ("units", "frames", "meanings")


class FlightTable(Protocol):
    """What a file needs to know of a recording."""

    @property
    def name(self) -> str:
        """Name of the flight."""

    @property
    def time_s(self) -> np.ndarray:
        """Time tags, (n,) [s]."""

    @property
    def data(self) -> Mapping[str, np.ndarray]:
        """Columns by name, (n,) each."""

    @property
    def meta(self) -> Mapping[str, object]:
        """Provenance."""


class StoredFlight(NamedTuple):
    """One flight as a file holds it, checked: the parts of a ``Recording``."""

    name: str
    time_s: np.ndarray
    data: dict[str, np.ndarray]
    meta: dict[str, object]


def write(path: Path, recordings: Iterable[FlightTable], *, force: bool = False) -> str:
    """Write recordings to one file, a shard, whole or not at all.

    Parameters
    ----------
    path : Path
        Where; its folder must exist.
    recordings : iterable of Recording
        Flights, numbered in this order from 000001; an iterator is drawn from while the file is written, so that
        no more than one need be in memory.
    force : bool
        Replace an existing file.

    Returns
    -------
    str
        SHA-256 of the file.

    Raises
    ------
    RequestError
        If the path is taken or cannot be written to.
    DataError
        If a column is not finite.
    """
    digests: list[str] = []
    storage.atomic_write(path, lambda temporary: digests.append(_write(temporary, recordings)), force=force)
    return digests[0]


def check_finite(where: str, time_s: np.ndarray, data: Mapping[str, np.ndarray]) -> None:
    """Raise the DataError that names the first column that is not finite, and when."""
    for name, column in data.items():
        bad = ~np.isfinite(column)
        if bad.any():
            msg = f"{where}: column {name} is not finite, first at {time_s[bad.argmax()]:g} s"
            raise DataError(msg)


def _write(path: Path, recordings: Iterable[FlightTable]) -> str:
    import h5py

    with h5py.File(path, "w", libver=("earliest", "v110")) as file:
        file.attrs["Conventions"] = _text("CF-1.12")
        file.attrs["title"] = _text("magsim")
        file.attrs["schema_version"] = np.int64(SCHEMA)
        file.attrs["generator"] = _text(f"magsim {magsim.__version__}")
        flights = file.create_group("flights")
        for number, recording in enumerate(recordings, start=1):
            check_finite(recording.name, recording.time_s, recording.data)
            _write_flight(flights.create_group(f"{number:06d}"), recording)
    return hdf5.add_checksum(path)


def _write_flight(group: "h5py.Group", recording: FlightTable) -> None:
    group.attrs["name"] = _text(recording.name)
    _write_meta(group, recording.meta)
    time_s = _create(group, columns.TIME, recording.time_s)
    start = recording.meta.get("start_utc")
    time_s.attrs["units"] = _text(f"seconds since {_cf_time(start)}" if isinstance(start, str) else "s")
    time_s.attrs["calendar"] = _text("standard")
    time_s.attrs["axis"] = _text("T")
    time_s.attrs["standard_name"] = _text("time")
    time_s.attrs["long_name"] = _text("time from the first recorded row")
    time_s.make_scale(columns.TIME)
    for role in columns.ROLES:
        names = [name for name in recording.data if columns.role_of(name) == role]
        if not names:
            continue
        families = [columns.family_of(name) for name in names]
        channel = _create(group, f"{role}_channel", _texts(names))
        channel.attrs["long_name"] = _text(f"names of the columns of {role}")
        channel.make_scale(f"{role}_channel")
        block = _create(group, role, np.column_stack([recording.data[name] for name in names]))
        block.dims[0].attach_scale(time_s)
        block.dims[1].attach_scale(channel)
        block.attrs["long_name"] = _text(f"columns of role {role}")
        for detail, values in zip(
            _DETAILS, zip(*((f.unit, f.frame, f.meaning) for f in families), strict=True), strict=True
        ):
            _set_attribute(block, f"column_{detail}", _texts(values))


def _create(group: "h5py.Group", name: str, values: np.ndarray) -> "h5py.Dataset":
    """Create a contiguous data set with the checksum of its values."""
    values = values.astype("<f8", copy=False) if values.dtype.kind == "f" else values
    item = group.create_dataset(name, data=values)
    item.attrs[CHECKSUM] = _text(checksum(values))
    return item


def checksum(values: np.ndarray) -> str:
    """SHA-256 of values as they lie in the file: C order, little-endian."""
    return hashlib.sha256(np.ascontiguousarray(values).tobytes()).hexdigest()


def _write_meta(group: "h5py.Group", meta: Mapping[str, object]) -> None:
    for key, value in meta.items():
        if not hdf5.NAME.fullmatch(key) or key in _RESERVED or key.endswith(_JSON):
            msg = f"{key!r} cannot name an entry of a recording's meta"
            raise ValueError(msg)
        if isinstance(value, float | np.floating):
            group.attrs[key] = np.float64(value)
        elif isinstance(value, int | np.integer) and not isinstance(value, bool) and -(2**63) <= value < 2**63:
            group.attrs[key] = np.int64(value)
        else:
            name = key if isinstance(value, str) else key + _JSON
            text = _text(value if isinstance(value, str) else _json(value))
            if text.dtype.itemsize > ATTRIBUTE_BYTES:
                _create(group.require_group("texts"), name, text)
            else:
                group.attrs[name] = text


def _json(value: object) -> str:
    def plain(item: object) -> object:
        if isinstance(item, np.ndarray | np.generic):
            return item.tolist()
        msg = f"{type(item).__name__} cannot be an entry of a recording's meta"
        raise TypeError(msg)

    return json.dumps(value, default=plain, ensure_ascii=False, sort_keys=True, allow_nan=False)


def _set_attribute(item: "h5py.Dataset", name: str, value: np.ndarray) -> None:
    if value.nbytes > ATTRIBUTE_BYTES:
        msg = f"{len(value)} columns are too many for one recording file; allowed: fewer sensors in one flight"
        raise RequestError(msg)
    item.attrs[name] = value


def _text(text: str) -> np.ndarray:
    return _texts([text])[0, ...]


def _texts(texts: Iterable[str]) -> np.ndarray:
    """Return texts as UTF-8 bytes of one length, at least 2: netCDF reads texts of length 1 as something else."""
    import h5py

    encoded = [text.encode() for text in texts]
    return np.array(encoded, dtype=h5py.string_dtype("utf-8", max(2, *map(len, encoded))))


def _cf_time(start_utc: str) -> str:
    """Return a time in ISO 8601 as the CF conventions write it."""
    start = datetime.fromisoformat(start_utc)
    start = start.astimezone(UTC) if start.tzinfo else start
    return start.replace(tzinfo=None).isoformat(sep=" ")


def files_of(path: Path) -> tuple[Path, ...]:
    """Return the recordings that a path means: itself, or the ``*.h5`` files of a folder by name but for hidden ones.

    Hidden ones are being written.

    Raises
    ------
    RequestError
        If a folder has no recording.
    """
    if not path.is_dir():
        return (path,)
    files = tuple(sorted(file for file in path.glob("*.h5") if not file.name.startswith(".")))
    if not files:
        msg = f"{path}: this folder has no recording (*.h5)"
        raise RequestError(msg)
    return files


def read(path: Path, names: Iterable[str] | None = None) -> tuple[StoredFlight, ...]:
    """Read the flights of a file, or of all ``*.h5`` files of a folder, in the order of their names.

    Parameters
    ----------
    path : Path
    names : iterable of str, optional
        Read only the flights of these names; all by default. The others' values are not touched.

    Returns
    -------
    tuple of StoredFlight
        One or more; in the order of the file.

    Raises
    ------
    RequestError
        If there is no such file, a folder has no recording, or there is no flight of a name that is asked for.
    DataError
        If a file is no recording, or is truncated or damaged.
    """
    files = files_of(path)
    if len(files) > 1:
        inspection.inspect_many(files)
    found = [flight for file in files for flight in _read_file(file, names)]
    missing = set(names or ()) - {flight.name for flight in found}
    if missing:
        msg = f"{path}: there is no flight {min(missing)!a} (magsim info lists them)"
        raise RequestError(msg)
    return tuple(found)


def _read_file(path: Path, names: Iterable[str] | None) -> list[StoredFlight]:
    with hdf5.open_untrusted(path) as root:
        wanted = None if names is None else set(names)
        return [read_flight(group) for group in flight_groups(root) if wanted is None or flight_name(group) in wanted]


def flight_groups(root: hdf5.Reader) -> list[hdf5.Reader]:
    """Return the groups of all flights of an opened file, in the order of their numbers; checks the version."""
    _check_schema(root)
    flights = root.group("flights")
    found = [flights.group(name) for name in flights.names()]
    if not found:
        flights.refuse("there is no flight inside")
    return found


def flight_name(group: hdf5.Reader) -> str:
    """Name of a flight."""
    name = group.attribute("name")
    return "" if name is None else str(name)


def read_one(path: Path, name: str | None = None) -> StoredFlight:
    """Read the flight of a name, or of a file that holds exactly one; see ``read`` for what it raises."""
    if path.is_dir():
        msg = f"{path}: is a folder, where one recording file is needed"
        raise RequestError(msg)
    found = read(path, None if name is None else [name])
    if len(found) > 1:
        which = "flights" if name is None else f"flights of the name {name!a}"
        msg = f"{path}: holds {len(found)} {which}, where one is needed (read_recordings reads them all)"
        raise RequestError(msg)
    return found[0]


def read_number(path: Path, number: int) -> StoredFlight:
    """Read one flight by its number in the file, from 0; see ``read`` for what it raises."""
    with hdf5.open_untrusted(path) as root:
        return read_flight(flight_groups(root)[number])


def _check_schema(root: hdf5.Reader) -> None:
    attributes = root.attributes()
    version = attributes.get("schema_version")
    if attributes.get("title") != "magsim" or not isinstance(version, int):
        root.refuse("is not a recording of magsim")
    if version not in READABLE:
        newer = " (a newer magsim wrote it)" if version > SCHEMA else ""
        root.refuse(f"has schema_version {version}{newer}; allowed: {', '.join(map(str, READABLE))}")


def read_flight(group: hdf5.Reader) -> StoredFlight:
    """Read one flight, checked against the table of columns."""
    present = group.names()
    time_s = group.array(columns.TIME, kind="f", ndim=1)
    if len(time_s) < 2 or not np.isfinite(time_s).all() or not np.all(np.diff(time_s) > 0.0):
        group.refuse("time_s is not strictly increasing, finite and of 2 rows or more")
    data: dict[str, np.ndarray] = {}
    for role in columns.ROLES:
        if role in present:
            data |= _read_block(group, role, len(time_s), data)
    check_finite(group.where, time_s, data)
    attributes = group.attributes()
    name = attributes.pop("name", "")
    if "texts" in present:
        texts = group.group("texts")
        for key in texts.names():
            attributes[key] = texts.array(key, kind="S", ndim=0).item().decode("utf-8")
    return StoredFlight(str(name), time_s, data, _read_meta(group, attributes))


def _read_meta(group: hdf5.Reader, attributes: Mapping[str, object]) -> dict[str, object]:
    meta: dict[str, object] = {}
    for key, value in attributes.items():
        if key.endswith(_JSON):
            try:
                meta[key.removesuffix(_JSON)] = json.loads(str(value))
            except (ValueError, RecursionError):
                group.refuse(f"attribute {key} is not JSON")
        else:
            meta[key] = value
    return dict(sorted(meta.items()))


def _read_block(group: hdf5.Reader, role: str, rows: int, seen: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Columns of one role, each checked against the table of columns."""
    block = group.array(role, kind="f", ndim=2)
    names = [name.decode("utf-8", "replace") for name in group.array(f"{role}_channel", kind="S", ndim=1).tolist()]
    if block.shape != (rows, len(names)):
        group.refuse(f"{role} has shape {block.shape}; expected {(rows, len(names))}, from time_s and {role}_channel")
    units = group.texts_attribute(role, "column_units")
    if len(units) != len(names):
        group.refuse(f"{role} has {len(names)} columns, but attribute column_units has {len(units)} entries")
    for name, unit in zip(names, units, strict=True):
        family = columns.find(name)
        if family is None:
            group.refuse(f"{role} has a column {name[:60]!a} that magsim {magsim.__version__} does not know")
        elif family.role != role:
            group.refuse(f"column {name} stands in {role}; expected in {family.role}")
        elif family.unit != unit:
            group.refuse(f"column {name} has unit {unit[:20]!a}; allowed: {family.unit!r}")
        elif names.count(name) > 1 or name in seen:
            group.refuse(f"column {name} is there twice")
    return {name: block[:, i] for i, name in enumerate(names)}

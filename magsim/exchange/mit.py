"""HDF5 in the layout that MagNav.jl reads: flat fields, one flight per file, truth in groups.

Its readers take the longest of all root members for the number of rows: a group counts its entries, a text its
characters. So every root data set has one value for each row, and groups and texts stay shorter than that
(MagNav.jl, ``src/get_XYZ.jl``, get_XYZ20).
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path

import numpy as np

import magsim
from magsim import columns
from magsim.errors import RequestError
from magsim.exchange import sgl
from magsim.exchange.textfile import MAX_CELLS
from magsim.recording import Recording
from magsim.storage import hdf5

TIME = "tt"

OTHER_NAMES = ("N", "Cnb", "ins_Cnb", "ins_P")
"""Names of the layout that a recording of magsim could not have."""

MAX_ROWS = 20_000_000
"""Most rows that are read."""


def write(path: Path, recording: Recording, flight: int) -> None:
    """Write one flight.

    Parameters
    ----------
    path : Path
        A file that may be overwritten.
    recording : Recording
        Columns that have no field in the layout go to the groups ``input``, ``label``, ``truth`` and ``segment``
        under their own names.
    flight : int
        Number of the flight.

    Raises
    ------
    RequestError
        If the layout cannot represent this flight.
    """
    import h5py

    fields = sgl.fields_of(recording, flight)
    _check_time(recording, fields["tt"])
    groups = _groups(recording)
    most = max(len(members) for members in groups.values())
    if most > len(recording):
        msg = (
            f"recording {recording.name!r} has {len(recording)} rows, fewer than the {most} columns of one role: "
            "readers of this format would take these for rows; --roles leaves some out"
        )
        raise RequestError(msg)
    with h5py.File(path, "w", libver=("earliest", "v110")) as file:
        for name, values in fields.items():
            file.create_dataset(name, data=values)
        info = f"magsim {magsim.__version__}: {recording.name}"
        if len(info) <= len(recording):
            file["info"] = _text(info)
        for name, members in groups.items():
            if members:
                group = file.create_group(name)
                for member, value in members.items():
                    group[member] = value


def _check_time(recording: Recording, tt: np.ndarray) -> None:
    steps = np.diff(tt)
    if abs(steps[0] * recording.rate_hz - 1.0) > 1e-6 or not np.all(steps > 0.0):
        msg = (
            f"recording {recording.name!r} begins with a step of {steps[0]:g} s, which readers of this format take for "
            f"that of all rows; it is {1.0 / recording.rate_hz:g} s"
        )
        raise RequestError(msg)


def _groups(recording: Recording) -> dict[str, dict[str, np.ndarray]]:
    """Return the columns that have no field in the layout, by role, and the names of the sensors in its places."""
    mags, fluxes = sgl.magnetometers(recording), sgl.fluxgates(recording)
    known = {columns.MAG.name(sensor=sensor) for sensor in mags}
    known |= {columns.FLUX.name(sensor=sensor, axis=axis) for sensor in fluxes for axis in columns.AXES}
    known |= {*sgl.DIRECT.values(), *sgl.NEGATED.values(), *sgl.RADIANS.values(), columns.RADAR.pattern}
    known |= {ours for ours, _ in sgl.SCALED.values()}
    groups = {
        role: {name: recording[name] for name in recording.names(role) if role != "input" or name not in known}
        for role in columns.ROLES
    }
    names = {f"mag_{number}": _text(sensor) for sensor, number in mags.items()}
    names |= {f"flux_{letter}": _text(sensor) for sensor, letter in fluxes.items()}
    return groups | {"sensors": names}


def _text(text: str) -> np.ndarray:
    import h5py

    data = text.encode()
    return np.array(data, dtype=h5py.string_dtype("utf-8", max(1, len(data))))


def read(
    path: Path, choose: Callable[[Sequence[str]], Mapping[str, str]], nulls: Collection[float] = ()
) -> dict[str, np.ndarray]:
    """Read fields of a file in this layout.

    Parameters
    ----------
    path : Path
    choose : callable
        Called with the names of all members of the root; returns a mapping whose keys are those that are wanted.
    nulls : collection of float
        Numbers that stand for missing values.

    Returns
    -------
    dict of str to (n,)
        Float64; missing values are NaN.

    Raises
    ------
    RequestError
        If there is no such file.
    DataError
        If the file is broken, or a field is not a list of numbers as long as the time.
    """
    with hdf5.open_untrusted(path, also=OTHER_NAMES) as root:
        names = root.names()
        if TIME not in names:
            root.refuse(f"there is no {TIME}, the time, so it is no flight in the layout of MagNav.jl")
        time_s = root.array(TIME, kind="f", ndim=1)
        if len(time_s) > MAX_ROWS:
            root.refuse(f"{TIME} has {len(time_s)} rows; allowed: up to {MAX_ROWS}")
        found = {TIME: time_s.astype(float)}
        wanted = choose(names)
        if len(wanted) * len(time_s) > MAX_CELLS:
            root.refuse(f"{len(wanted)} fields of {len(time_s)} rows are more than {MAX_CELLS} values")
        for name in wanted:
            values = root.array(name, kind="f", ndim=1)
            if values.shape != time_s.shape:
                root.refuse(f"{name} has {len(values)} values and {TIME} has {len(time_s)}")
            found[name] = (
                np.where(np.isin(values, list(nulls)), np.nan, values.astype(float)) if nulls else values.astype(float)
            )
        return found

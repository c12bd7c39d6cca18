"""How a recording shows itself: one line, a small table for notebooks, a figure, an xarray Dataset."""

import html as markup
from importlib.metadata import entry_points
from typing import TYPE_CHECKING

from magsim import columns
from magsim.errors import RequestError

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from magsim.recording.file import FlightTable

FIGURES = "magsim.figures"
"""Entry point group of what draws recordings: a function of recording, kind and sensor. Drawing is an upper layer."""

SHOWN = 6
"""Columns of a role that the table for notebooks names."""


def line(recording: "FlightTable") -> str:
    """Return one line: name, rows, duration, columns."""
    duration_s = recording.time_s[-1] - recording.time_s[0]
    return (
        f"<Recording {recording.name!r}: {len(recording.time_s)} rows, {duration_s:.1f} s, "
        f"{len(recording.data)} columns>"
    )


def html(recording: "FlightTable") -> str:
    """Return a table of the columns by role, as HTML; names are escaped, since a file may come from anywhere."""
    duration_s = recording.time_s[-1] - recording.time_s[0]
    title = f"{recording.name}: {len(recording.time_s)} rows, {duration_s:.1f} s"
    start = recording.meta.get("start_utc")
    if isinstance(start, str):
        title += f", from {start}"
    rows = []
    for role in columns.ROLES:
        names = [name for name in recording.data if columns.role_of(name) == role]
        if names:
            more = f", ... ({len(names) - SHOWN} more)" if len(names) > SHOWN else ""
            listed = ", ".join(names[:SHOWN]) + more
            rows.append(f"<tr><th>{role}</th><td>{len(names)}</td><td>{markup.escape(listed)}</td></tr>")
    return f"<table><caption>{markup.escape(title)}</caption>{''.join(rows)}</table>"


def figure(recording: "FlightTable", kind: str, sensor: str | None) -> "Figure":
    """Draw a figure; see ``Recording.plot``.

    Raises
    ------
    RequestError
        If nothing that draws is installed, there is no such kind, or the recording lacks what it shows.
    """
    drawers = entry_points(group=FIGURES)
    if not drawers:
        msg = f"nothing that draws recordings is installed: no entry point in the group {FIGURES}"
        raise RequestError(msg)
    drawn: Figure = next(iter(drawers)).load()(recording, kind, sensor)
    return drawn


def dataset(recording: "FlightTable") -> "xr.Dataset":
    """Return an xarray Dataset of all columns; see ``Recording.to_xarray``.

    Raises
    ------
    RequestError
        If xarray is not installed.
    """
    try:
        import xarray as xr
    except ImportError:
        msg = "to_xarray needs xarray, which is not installed: pip install xarray"
        raise RequestError(msg) from None
    variables = {}
    for name, column in recording.data.items():
        family = columns.family_of(name)
        details = {"units": family.unit, "frame": family.frame, "role": family.role, "long_name": family.meaning}
        variables[name] = (columns.TIME, column, {key: text for key, text in details.items() if text})
    axis = {columns.TIME: (columns.TIME, recording.time_s, {"long_name": "time from the first recorded row"})}
    plain = {key: value for key, value in recording.meta.items() if isinstance(value, str | int | float)}
    return xr.Dataset(variables, axis, {"name": recording.name, **plain})

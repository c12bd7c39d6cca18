"""A mount map as people read it: a table of places, a picture, one page of HTML."""

import base64
import html
import io
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from magsim import columns, plots
from magsim.aircraft import Aircraft
from magsim.aircraft.magnetics import DIPOLE_CLEARANCE_M
from magsim.errors import RequestError
from magsim.experiments.mount_grid import SPACING, Extent, free, grid, plane
from magsim.experiments.mount_map import Prediction, predict
from magsim.field import obstacles, outline
from magsim.field.geometry import TriangleMesh
from magsim.loading import load_scenario
from magsim.population import aircraft_of
from magsim.recording import Recording
from magsim.simulation import simulate
from magsim.storage import atomic_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FLIGHTS = {"uav": "papers/001_fom"}
"""The figure-of-merit flight of an aircraft; of every other one it is ``DEFAULT_FLIGHT``."""

DEFAULT_FLIGHT = "patterns/fom"

OFF_SKIN, OFF_DIPOLES = 0.03, 1.25
"""Distance from the skin at which the aircraft is colored: in lengths, and at least in clearances of a dipole."""

APART = 3.0
"""Least distance between two of the best places, in spacings of the grid."""

AXES = ("forward", "right", "down")


@dataclass(frozen=True)
class RatedPlace:
    """One line of the table."""

    name: str
    where: str
    position_m: tuple[float, float, float]
    fom_nt: float
    std_nt: float
    fom_left_nt: float
    std_left_nt: float


@dataclass(frozen=True)
class MountMap:
    """Predicted interference at the mounts of an aircraft and on a grid in and around it.

    Attributes
    ----------
    aircraft, flight : str
        Names.
    mounts, places : Prediction
        At the mounts of the aircraft's file, and on the grid.
    inside : (p,) bool
        Places of the grid within the skin.
    spacing_m : float [m]
    """

    aircraft: str
    flight: str
    mounts: Prediction
    places: Prediction
    inside: np.ndarray
    spacing_m: float

    def best(self, count: int, *, inside: bool) -> list[RatedPlace]:
        """Return the quietest places of the grid within the skin, or off it, some spacings apart."""
        rows = np.flatnonzero(self.inside == inside)
        rows = rows[np.argsort(self.places.fom_nt[rows], kind="stable")]
        chosen: list[int] = []
        for row in rows:
            if len(chosen) == count:
                break
            arms = self.places.positions_m[chosen] - self.places.positions_m[row]
            if not chosen or np.linalg.norm(arms, axis=1).min() >= APART * self.spacing_m:
                chosen.append(int(row))
        where = "inside" if inside else "outside"
        return [_place(self.places, row, f"{where} {number}", where) for number, row in enumerate(chosen, start=1)]

    def table(self, count: int) -> list[RatedPlace]:
        """Return the mounts of the aircraft's file from quiet to loud, then the best places inside and outside."""
        order = np.argsort(self.mounts.fom_nt, kind="stable")
        known = [_place(self.mounts, int(row), self.mounts.names[row], "mount") for row in order]
        return [*known, *self.best(count, inside=True), *self.best(count, inside=False)]

    def to_text(self, count: int = 5) -> str:
        """Return the table as text."""
        head = (
            f"{'place':<22}{'forward':>9}{'right':>9}{'down':>9}{'FOM':>11}{'STD':>11}{'FOM left':>11}{'STD left':>11}"
        )
        lines = [self.title, "", head, f"{'':<22}{'m':>9}{'m':>9}{'m':>9}{'nT':>11}{'nT':>11}{'nT':>11}{'nT':>11}"]
        for place in self.table(count):
            numbers = (place.fom_nt, place.std_nt, place.fom_left_nt, place.std_left_nt)
            at = "".join(f"{x:9.2f}" for x in place.position_m)
            lines.append(f"{place.name:<22}{at}" + "".join(f"{value:11.4g}" for value in numbers))
        return "\n".join([*lines, "", *self.legend, ""])

    @property
    def title(self) -> str:
        """One line for people."""
        return f"{self.aircraft}: where a magnetometer is quiet, flight {self.flight}"

    @property
    def legend(self) -> tuple[str, ...]:
        """What the numbers are."""
        fom = (
            f"FOM: sum over {self.mounts.cells} headings and maneuvers of the peak to peak of the interference in 0.1 "
            "to 0.6 Hz; STD: its standard deviation over the maneuvers."
        )
        left = (
            "left: after Tolles-Lawson with 18 terms fitted to the same flight. Predicted to first order, without "
            "instrument noise."
        )
        return fom, left

    def to_json(self, count: int = 5) -> str:
        """Return the table as JSON: the same bytes for the same flight."""
        whole = {
            "aircraft": self.aircraft,
            "flight": self.flight,
            "cells": self.mounts.cells,
            "spacing_m": self.spacing_m,
            "places": [vars(place) for place in self.table(count)],
        }
        return json.dumps(whole, indent=1, allow_nan=False) + "\n"


def _place(prediction: Prediction, row: int, name: str, where: str) -> RatedPlace:
    forward, right, down = prediction.positions_m[row].tolist()
    values = (prediction.fom_nt, prediction.std_nt, prediction.fom_left_nt, prediction.std_left_nt)
    return RatedPlace(name, where, (forward, right, down), *(float(value[row]) for value in values))


def flight_of(aircraft: Aircraft, name_or_file: str | None) -> Recording:
    """Read the recording of a flight to predict for, or simulate it from a scenario.

    Parameters
    ----------
    aircraft : Aircraft
    name_or_file : str, optional
        A recording ``*.h5``, a scenario's file or name; by default the figure-of-merit flight of the aircraft.

    Raises
    ------
    RequestError
        If it is neither, or a scenario that this aircraft cannot fly.
    """
    wanted = name_or_file or FLIGHTS.get(aircraft.name, DEFAULT_FLIGHT)
    if Path(wanted).suffix.lower() in {".h5", ".hdf5"}:
        return Recording.read(wanted)
    return simulate(load_scenario(wanted, aircraft=aircraft))


def flown_aircraft(aircraft: Aircraft, recording: Recording) -> Aircraft:
    """Return the individual of an aircraft that flew a recording, on its day.

    The temperature of the air is that at the first row; a recording of another aircraft leaves this one as it is.

    Parameters
    ----------
    aircraft : Aircraft
        The type.
    recording : Recording
        Its provenance names aircraft, individual and day; where it does not, the type itself is meant.

    Raises
    ------
    RequestError
        If no such individual can be built.
    """
    number, day = (_whole(recording.meta.get(key)) for key in ("individual", "day"))
    if recording.meta.get("aircraft") != aircraft.name or not (number or day):
        return aircraft
    heights = (columns.TRUE_ALTITUDE.pattern, columns.INS_ALTITUDE.pattern)
    alt_m = next((float(recording[name][0]) for name in heights if name in recording), 0.0)
    return aircraft_of(aircraft, number, day, alt_m)


def _whole(value: object) -> int:
    return value if isinstance(value, int) else 0


def make_map(aircraft: Aircraft, recording: Recording, *, spacing_m: float | None = None) -> MountMap:
    """Predict the interference at the mounts of an aircraft and on a grid in and around it.

    Parameters
    ----------
    aircraft : Aircraft
    recording : Recording
        See ``predict``.
    spacing_m : float, optional [m]
        Of the grid; by default a 25th of the aircraft's length.

    Raises
    ------
    RequestError
        If the recording lacks what is needed, or the grid is too fine.
    """
    body = Extent.of(aircraft, _shells(aircraft))
    spacing = SPACING * body.length_m if spacing_m is None else spacing_m
    points, inside = grid(body, spacing)
    open_air = free(aircraft, body, points, spacing)
    points, inside = points[open_air], inside[open_air]
    return MountMap(
        aircraft.name,
        recording.name,
        predict(aircraft, recording, aircraft.mounts),
        predict(aircraft, recording, _named(points)),
        inside,
        spacing,
    )


def _shells(aircraft: Aircraft) -> TriangleMesh | None:
    """Return the skin or outline, coarse enough to be drawn; None where the aircraft file has neither."""
    shells = aircraft.magnetics.skin or aircraft.magnetics.outline
    try:
        return None if shells is None else outline(shells).surface
    except ValueError as error:
        msg = f"aircraft {aircraft.name}: {error}"
        raise RequestError(msg) from error


def _named(points: np.ndarray) -> dict[str, tuple[float, ...]]:
    return {f"p{number}": tuple(point) for number, point in enumerate(points.tolist())}


def draw_map(aircraft: Aircraft, recording: Recording, whole: MountMap) -> "Figure":
    """Draw two planes through the aircraft, and the aircraft itself, colored by the figure of merit.

    Parameters
    ----------
    aircraft : Aircraft
    recording : Recording
    whole : MountMap
        Of this aircraft and flight.

    Returns
    -------
    matplotlib.figure.Figure
    """
    surface = _shells(aircraft)
    body = Extent.of(aircraft, surface)
    slices = [
        _sliced(aircraft, recording, body, whole.spacing_m, 1),
        _sliced(aircraft, recording, body, whole.spacing_m, 2),
    ]
    triangles = np.zeros((0, 3, 3)) if surface is None else surface.vertices[surface.triangles]
    off_m = round(max(OFF_SKIN * body.length_m, OFF_DIPOLES * DIPOLE_CLEARANCE_M), 2)
    colors = np.zeros(0) if surface is None else _off_skin(aircraft, recording, surface, off_m)
    return plots.plot_mounts(whole.title, slices, triangles, colors, off_m=off_m, mounts=aircraft.mounts)


def _sliced(aircraft: Aircraft, recording: Recording, body: Extent, spacing: float, normal: int) -> plots.Slice:
    across, up, points = plane(body, 0.5 * spacing, normal)
    flat = points.reshape(-1, 3)
    rows = np.flatnonzero(free(aircraft, body, flat, 0.5 * spacing))
    values = np.full(len(flat), np.nan)
    values[rows] = predict(aircraft, recording, _named(flat[rows])).fom_nt
    first, second = (axis for axis in range(3) if axis != normal)
    return plots.Slice(f"{AXES[normal]} = 0", across, up, values.reshape(points.shape[:2]), (first, second))


def _off_skin(aircraft: Aircraft, recording: Recording, surface: TriangleMesh, off_m: float) -> np.ndarray:
    corners = surface.vertices[surface.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points = corners.mean(axis=1) + off_m * normals
    rows = np.flatnonzero([obstacle is None for obstacle in obstacles(aircraft, points)])
    values = np.full(len(points), np.nan)
    values[rows] = predict(aircraft, recording, _named(points[rows])).fom_nt
    return values


def write_page(whole: MountMap, figure: "Figure", path: Path, *, count: int = 5, force: bool = False) -> None:
    """Write one self-contained page of HTML with the picture and the table.

    Raises
    ------
    RequestError
        If the file exists and ``force`` is not set.
    """
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    picture = base64.b64encode(buffer.getvalue()).decode()
    text = _page(whole, picture, whole.table(count))
    atomic_text(path, text, force=force)


def _page(whole: MountMap, picture: str, places: Sequence[RatedPlace]) -> str:
    head = ("place", *(f"{axis} [m]" for axis in AXES), "FOM [nT]", "STD [nT]", "FOM left [nT]", "STD left [nT]")
    rows = [
        f"<tr><td>{html.escape(place.name)}</td>"
        + "".join(f"<td>{x:.2f}</td>" for x in place.position_m)
        + "".join(f"<td>{x:.4g}</td>" for x in (place.fom_nt, place.std_nt, place.fom_left_nt, place.std_left_nt))
        + "</tr>"
        for place in places
    ]
    title = html.escape(whole.title)
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        f"<title>{title}</title><style>"
        "body{font:15px/1.5 system-ui,sans-serif;color:#22262b;max-width:1200px;margin:2em auto;padding:0 1em}"
        "img{max-width:100%}table{border-collapse:collapse}"
        "td,th{padding:.25em .8em;border-bottom:1px solid #e4e7ea;text-align:right}"
        "td:first-child,th:first-child{text-align:left}</style></head>\n<body>\n"
        f"<h1>{title}</h1>\n"
        f'<img alt="predicted figure of merit in and around the aircraft" src="data:image/png;base64,{picture}">\n'
        "<table><thead><tr>"
        + "".join(f"<th>{name}</th>" for name in head)
        + "</tr></thead>\n<tbody>\n"
        + "\n".join(rows)
        + "\n</tbody></table>\n"
        + "".join(f"<p>{html.escape(line)}</p>\n" for line in whole.legend)
        + "</body></html>\n"
    )


def check_output(path: Path) -> None:
    """Refuse an ending that is neither a picture nor a page.

    Raises
    ------
    RequestError
    """
    if path.suffix.lower() not in {".png", ".svg", ".html"}:
        msg = f"{path}: a map ends in .png, .svg or .html, not {path.suffix!r}"
        raise RequestError(msg)

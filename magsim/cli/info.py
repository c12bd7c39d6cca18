"""``magsim info``: contents of a recording."""

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import click

from magsim.cli.messages import warn

if TYPE_CHECKING:
    from magsim.recording import Recording


@dataclass(frozen=True)
class TitledTable:
    """A table with a title, for people."""

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@click.command(short_help="Show the contents of a recording.")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--flight", metavar="NAME", help="Show one of several flights in full.")
def info(file: Path, flight: str | None) -> None:
    """Show the contents of FILE: flights, sensors, columns, segments, maneuvers, and provenance.

    FILE may be a folder of recordings too. Several flights are listed, one is shown in full.
    """
    from magsim.recording import read_recordings

    recordings = read_recordings(file, None if flight is None else [flight])
    sections = [_flights(recordings)]
    if len(recordings) == 1:
        sections += [*_details(recordings[0])]
    show(sections)
    warn(recordings)


def show(sections: Sequence[TitledTable]) -> None:
    """Print tables: as rich tables on a terminal, else as plain aligned text that is never wrapped."""
    if not sys.stdout.isatty():
        click.echo("\n\n".join(_plain(section) for section in sections))
        return
    from rich import box
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False)
    for section in sections:
        table = Table(title=section.title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD)
        for name in section.header:
            table.add_column(name, overflow="fold")
        for row in section.rows:
            table.add_row(*row)
        console.print(table)


def _plain(section: TitledTable) -> str:
    rows = [section.header, *section.rows]
    widths = [max(len(row[i]) for row in rows) for i in range(len(section.header))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    return "\n".join([section.title, *(f"  {line}" for line in lines)])


def _flights(recordings: Sequence["Recording"]) -> TitledTable:
    drawn = [key for key in ("individual", "day") if any(recording.meta.get(key) for recording in recordings)]
    rows = tuple(
        (
            recording.name,
            *(_word(recording.meta.get(key, "-")) for key in drawn),
            str(len(recording)),
            f"{recording.rate_hz:.4g}",
            f"{recording.time_s[-1] - recording.time_s[0]:.1f}",
            ", ".join(recording.scalars) or "-",
            ", ".join(recording.fluxgates) or "-",
            _word(recording.meta.get("start_utc")),
        )
        for recording in recordings
    )
    header = ("flight", *drawn, "rows", "rate Hz", "duration s", "scalar sensors", "fluxgates", "start UTC")
    return TitledTable("Flights" if len(rows) > 1 else "Flight", header, rows)


def _details(recording: "Recording") -> Iterator[TitledTable]:
    yield _provenance(recording)
    yield _columns(recording)
    if "leg" in recording and "circuit" in recording:
        yield _segments(recording)
    maneuvers = recording.meta.get("maneuvers")
    if isinstance(maneuvers, list) and maneuvers:
        yield _maneuvers(maneuvers)
    notes = recording.meta.get("notes")
    if isinstance(notes, dict) and "drape_worst_error_m" in notes:
        yield _drape(notes)
    if isinstance(notes, dict) and isinstance(notes.get("tow"), dict):
        yield _tow(notes)
    yield from _heading_tables(recording)


def _provenance(recording: "Recording") -> TitledTable:
    flown = (
        "scenario",
        "aircraft",
        "bird",
        "individual",
        "day",
        "seed",
        "overrides",
        "digest",
        "version",
        "main_field",
    )
    keys = (*flown, "filter", "simulation_rate_hz")
    rows = tuple((key, _word(recording.meta[key])) for key in keys if recording.meta.get(key) not in (None, [], ""))
    return TitledTable("Provenance", ("key", "value"), rows or (("-", "no provenance"),))


def _columns(recording: "Recording") -> TitledTable:
    from magsim import columns

    rows = []
    for role in columns.ROLES:
        families: dict[str, list[str]] = {}
        for name in recording.names(role):
            families.setdefault(columns.family_of(name).pattern, []).append(name)
        for pattern, names in families.items():
            family = columns.family_of(names[0])
            rows.append((role, pattern, str(len(names)), family.unit, family.meaning))
    return TitledTable("Columns", ("role", "family", "columns", "unit", "meaning"), tuple(rows))


def _segments(recording: "Recording") -> TitledTable:
    """Return one row for each run of rows with the same circuit, leg, turn and split."""
    import numpy as np

    from magsim import columns

    wanted = ("circuit", "leg", "turn", "transit", "leg_heading_deg", "split")
    names = [name for name in wanted if name in recording]
    table = recording.stack(names)
    cuts = np.flatnonzero(np.any(np.diff(table, axis=0) != 0.0, axis=1)) + 1
    bounds = [0, *cuts.tolist(), len(recording)]
    rows = []
    for start, stop in pairwise(bounds):
        values = dict(zip(names, table[start], strict=True))
        rows.append(
            (
                f"{values['circuit']:.0f}",
                f"{values['leg']:.0f}",
                "transit" if values.get("transit") else ("turn" if values.get("turn") else "leg"),
                f"{values['leg_heading_deg']:.0f}" if "leg_heading_deg" in values else "-",
                columns.SPLITS.get(int(values["split"]), "-") if "split" in values else "-",
                f"{recording.time_s[start]:.1f}",
                str(stop - start),
            )
        )
    header = ("circuit", "leg", "kind", "heading deg", "split", "start s", "rows")
    return TitledTable("Segments", header, tuple(rows))


def _maneuvers(maneuvers: Sequence[object]) -> TitledTable:
    """Return flown amplitudes and their imperfections: half of peak to peak, residual of the fit, other two angles."""
    keys: tuple[str, ...] = (
        "circuit",
        "leg",
        "kind",
        "axis",
        "start_s",
        "period_s",
        "cycles",
        "asked_deg",
        "flown_deg",
    )
    keys += ("half_peak_to_peak_deg", "residual_deg", "off_axis_deg")
    rows = []
    for entry in maneuvers:
        if isinstance(entry, dict):
            shown = entry | {"kind": "combined" if entry.get("kind") == "combined" else "train"}
            rows.append(tuple(_word(shown.get(key)) for key in keys))
    header: tuple[str, ...] = (
        "circuit",
        "leg",
        "kind",
        "axis",
        "start s",
        "period s",
        "cycles",
        "asked deg",
        "flown deg",
    )
    header += ("half peak to peak deg", "residual deg", "off-axis deg")
    return TitledTable("Maneuvers: amplitudes asked and flown (middle cycles)", header, tuple(rows))


def _drape(notes: Mapping[str, object]) -> TitledTable:
    """Return how closely the planned heights of a draped survey were flown on its lines."""
    keys = ("worst_error_m", "rms_error_m", "lowest_above_ground_m", "mean_above_ground_m", "highest_above_ground_m")
    header = ("off plan, worst m", "rms m", "above ground, lowest m", "mean m", "highest m")
    return TitledTable(
        "Drape: heights on the lines", header, (tuple(_word(notes.get(f"drape_{key}")) for key in keys),)
    )


def _tow(notes: Mapping[str, object]) -> TitledTable:
    """Return the bird, its steady trail, and its modes of swing."""
    keys: tuple[str, ...] = ("bird", "coupling", "rope_m", "links", "mass_kg", "steady_trail_deg", "steady_pitch_deg")
    keys += ("least_tension_n", "most_tension_n", "step_hz", "modes_hz", "modes_damping")
    tow = notes["tow"]
    assert isinstance(tow, dict)
    rows = [(key, _word(tow[key])) for key in keys if key in tow]
    if "carrier" in notes:
        rows.append(("carrier", _word(notes["carrier"])))
    return TitledTable("Tow", ("key", "value"), tuple(rows))


def _heading_tables(recording: "Recording") -> Iterator[TitledTable]:
    """Yield for each scalar sensor its readings over the center on each heading, and their spread."""
    from magsim.recording.heading import has_heading_table, heading_table

    if not has_heading_table(recording):
        return
    header = ("circuit", "leg", "heading deg", "time s", "miss m", "height m", "clean nT", "reading nT")
    for sensor in recording.scalars:
        passes = heading_table(recording, sensor)
        if not passes:
            continue
        rows = [
            (
                str(p.circuit),
                str(p.leg),
                f"{p.heading_deg:.0f}",
                f"{p.time_s:.1f}",
                f"{p.miss_m:.1f}",
                f"{p.height_error_m:+.1f}",
                *("-" if v is None else f"{v:.3f}" for v in (p.clean_nt, p.reading_nt, p.interference_nt)),
            )
            for p in passes
        ]
        spread = [
            _spread([p.clean_nt for p in passes]),
            _spread([p.reading_nt for p in passes]),
            _spread([p.interference_nt for p in passes]),
        ]
        rows.append(("spread", "", "", "", "", "", *spread))
        yield TitledTable(f"Heading table of {sensor}", (*header, "interference nT"), tuple(rows))


def _spread(values: Sequence[float | None]) -> str:
    known = [value for value in values if value is not None]
    return f"{max(known) - min(known):.3f}" if len(known) == len(values) else "-"


def _word(value: object) -> str:
    """Return a value as one line without control characters, which untrusted files may hold."""
    if value is None:
        return "-"
    text = f"{value:.4g}" if isinstance(value, float) else str(value)
    if isinstance(value, list):
        text = ", ".join(f"{part:.4g}" if isinstance(part, float) else str(part) for part in value)
    return "".join(c if c.isprintable() else "?" for c in text)[:200]

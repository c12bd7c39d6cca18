"""Drawing of the matplotlib figures of one recording."""

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.signal import welch

from magsim import columns, signals
from magsim.earth import wgs84
from magsim.recording import Recording

INK = "#22262b"
GRAY = "#8a9099"
GROUND = "#c9b8a2"
COLORS = (
    *("#1f6fb4", "#d1632a", "#2f8f5b", "#8a4fa8", "#b8952a", "#3aa6a6", "#7a7a7a", "#c2557f"),
    *("#8c5a3c", "#5a6fd1", "#93a13c"),
)
MANEUVER_COLORS = {1: "#f3d9c9", 2: "#d5e6f3", 3: "#d8ecdf", 4: "#e7dcef"}
PART_COLORS = dict(zip(columns.PLATFORM, COLORS, strict=True))
ANGLES = ("roll", "pitch", "heading")
STEADY_A = 0.1
"""Range of a current below which it is not drawn [A]."""


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure of a size [in]."""
    figure = Figure(figsize=(width, height), dpi=120, layout="constrained")
    figure.patch.set_facecolor("white")
    return figure


def dress(axes: Axes, ylabel: str, *, xlabel: str = "") -> None:
    """Set labels, grid and spines in the style of all figures."""
    axes.set_ylabel(ylabel, color=INK, fontsize=9)
    if xlabel:
        axes.set_xlabel(xlabel, color=INK, fontsize=9)
    axes.tick_params(colors=INK, labelsize=8)
    axes.grid(visible=True, color="#e4e7ea", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def legend_above(axes: Axes, ncols: int) -> None:
    """Draw a legend above the axes, if anything has a label."""
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=8, frameon=False, ncols=ncols, loc="lower right", bbox_to_anchor=(1.0, 1.0))


def _runs(values: np.ndarray) -> list[tuple[int, int, float]]:
    """Return runs of equal values: (first row, row after the last, value)."""
    cuts = np.flatnonzero(np.diff(values)) + 1
    bounds = [0, *cuts.tolist(), len(values)]
    return [(a, b, float(values[a])) for a, b in pairwise(bounds)]


def _shade_maneuvers(axes: Axes, recording: Recording, *, legend: bool = False) -> None:
    if "maneuver" not in recording:
        return
    seen = set()
    for first, last, code in _runs(recording["maneuver"]):
        if code:
            label = columns.MANEUVERS[int(code)] if legend and code not in seen else None
            seen.add(code)
            start, stop = recording.time_s[first], recording.time_s[last - 1]
            axes.axvspan(start, stop, color=MANEUVER_COLORS[int(code)], lw=0, label=label, zorder=0)


def angle_of(recording: Recording, angle: str) -> np.ndarray:
    """Return a true angle [deg], or that of the INS if the truth is not known."""
    true = columns.TRUE_ATTITUDE.name(angle=angle)
    return recording[true] if true in recording else recording[columns.INS_ATTITUDE.name(angle=angle)]


def _offsets(lat: np.ndarray, lon: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return north and east of the first point [m], in the plane tangent to the ellipsoid there."""
    points_e = wgs84.ecef_from_geodetic(lat, lon, 0.0)
    north, east, _ = np.einsum("ij,nj->in", wgs84.rot_ne_at(lat[0], lon[0]), points_e - points_e[0])
    return north, east


def _heading_for_line(heading_deg: np.ndarray) -> np.ndarray:
    """Return the heading within one turn, with gaps at the jump, so that no line crosses the plot.

    The jump is at the heading that was flown least, at 315 degrees if there is a choice, so that no leg is cut.
    """
    counts, _ = np.histogram(heading_deg % 360.0, bins=72, range=(0.0, 360.0))
    near = counts + np.roll(counts, 1)  # on both sides of the lower edge of each bin
    edges = 5.0 * np.arange(72)
    away = np.abs((edges - 315.0 + 180.0) % 360.0 - 180.0)
    cut = 360.0 - edges[np.lexsort((away, near))[0]]
    cut = cut if cut <= 180.0 else cut - 360.0
    out = (heading_deg + cut) % 360.0 - cut
    out[1:][np.abs(np.diff(out)) > 180.0] = np.nan
    return out


def flight(recording: Recording) -> Figure:
    """Draw ground track, attitude and height."""
    figure = new_figure(13.0, 6.4)
    grid = figure.add_gridspec(4, 2, width_ratios=(1.0, 1.7))
    track = figure.add_subplot(grid[:, 0])
    lat, lon = np.radians(angle_of(recording, "lat")), np.radians(angle_of(recording, "lon"))
    north, east = _offsets(lat, lon)
    circuit = recording["circuit"] if "circuit" in recording else np.ones(len(recording))
    for number in np.unique(circuit):
        rows = circuit == number
        color = COLORS[int(number - 1) % len(COLORS)]
        track.plot(east[rows] / 1e3, north[rows] / 1e3, color=color, lw=1.2, label=f"circuit {number:.0f}")
    track.plot(0.0, 0.0, "o", color=INK, ms=5, label="start")
    track.plot(east[-1] / 1e3, north[-1] / 1e3, "s", color=INK, ms=5, mfc="none", label="end")
    track.set_aspect("equal", adjustable="datalim")
    dress(track, "north [km]", xlabel="east [km]")
    track.legend(fontsize=8, frameon=False, ncols=4, loc="upper center", bbox_to_anchor=(0.5, -0.08))
    track.set_title(f"{recording.name}: ground track", fontsize=10, color=INK, loc="left")
    first = None
    for i, angle in enumerate(ANGLES):
        axes = figure.add_subplot(grid[i, 1], sharex=first)
        first = first or axes
        values = angle_of(recording, angle)
        _shade_maneuvers(axes, recording, legend=i == 0)
        axes.plot(recording.time_s, _heading_for_line(values) if angle == "heading" else values, color=INK, lw=0.8)
        dress(axes, f"{angle} [deg]")
        axes.tick_params(labelbottom=False)
        if i == 0:
            shaded = "; maneuvers shaded" if "maneuver" in recording and recording["maneuver"].any() else ""
            axes.set_title(f"attitude and height{shaded}", fontsize=10, color=INK, loc="left")
            legend_above(axes, 3)
    height = columns.TRUE_ALTITUDE.pattern
    axes = figure.add_subplot(grid[3, 1], sharex=first)
    _shade_maneuvers(axes, recording)
    flown = recording[height if height in recording else "ins_alt_m"]
    axes.plot(recording.time_s, flown, color=INK, lw=0.8)
    ground = columns.TRUE_GROUND.pattern
    if ground in recording:
        low = min(float(recording[ground].min()), float(flown.min()))
        floor = low - 0.05 * (float(flown.max()) - low)
        axes.fill_between(recording.time_s, recording[ground], floor, color=GROUND, lw=0, label="ground", zorder=1)
        axes.set_ylim(bottom=floor)
        legend_above(axes, 1)
    dress(axes, "height [m]", xlabel="time [s]")
    axes.set_xlim(recording.time_s[0], recording.time_s[-1])
    return figure


def field(recording: Recording, sensor: str) -> Figure:
    """Draw reading and background."""
    figure = new_figure(11.0, 4.2)
    axes = figure.add_subplot()
    _shade_maneuvers(axes, recording, legend=True)
    axes.plot(recording.time_s, recording[columns.MAG.name(sensor=sensor)], color=COLORS[0], lw=0.8, label="reading")
    clean = columns.CLEAN.name(sensor=sensor)
    if clean in recording:
        axes.plot(recording.time_s, recording[clean], color=INK, lw=1.2, label="background (truth)")
    dress(axes, "total field [nT]", xlabel="time [s]")
    axes.ticklabel_format(axis="y", useOffset=False)
    axes.set_xlim(recording.time_s[0], recording.time_s[-1])
    legend_above(axes, 5)
    axes.set_title(f"{recording.name}: scalar magnetometer {sensor}", fontsize=10, color=INK, loc="left")
    return figure


def part_projections(recording: Recording, sensor: str) -> dict[str, np.ndarray]:
    """Return each part of the platform's field along the direction of the background, (n,) [nT], except zero parts."""
    vectors = {
        component: recording.vector(columns.PART, component=component, sensor=sensor)
        for component in columns.components_of(recording.data, sensor)
    }
    background = sum(vector for component, vector in vectors.items() if component in columns.BACKGROUND)
    direction = background / np.linalg.norm(background, axis=1, keepdims=True)
    return {
        component: np.einsum("ni,ni->n", vector, direction)
        for component, vector in vectors.items()
        if component in columns.PLATFORM and np.any(vector)
    }


def interference(recording: Recording, sensor: str) -> Figure:
    """Draw the parts of the interference, in full and in band."""
    parts = part_projections(recording, sensor)
    figure = new_figure(11.0, 2.0 + 1.7 * len(parts))
    grid = figure.subplots(len(parts) + 1, 2, sharex=True, squeeze=False, width_ratios=(1.0, 1.0))
    label = recording[columns.INTERFERENCE.name(sensor=sensor)]
    rows = [("sum (norm)", label, INK)]
    rows += [(name, values, PART_COLORS[name]) for name, values in parts.items()]
    for i, (name, values, color) in enumerate(rows):
        band = signals.band_pass(values, recording.rate_hz)
        for axes, line in zip(grid[i], (values, band), strict=True):
            _shade_maneuvers(axes, recording)
            axes.plot(recording.time_s, line, color=color, lw=0.7)
            dress(axes, f"{name} [nT]", xlabel="time [s]" if i == len(rows) - 1 else "")
        inner = signals.off_ends(recording.time_s)
        text = f"STD in band {np.std(band[inner]):.3g} nT"
        grid[i][1].annotate(text, (0.99, 0.96), xycoords="axes fraction", ha="right", va="top", fontsize=8, color=INK)
    grid[0][0].set_title(f"{recording.name}, {sensor}: interference", fontsize=10, color=INK, loc="left")
    grid[0][1].set_title("the same, 0.1 to 0.6 Hz", fontsize=10, color=INK, loc="left")
    grid[0][0].set_xlim(recording.time_s[0], recording.time_s[-1])
    return figure


def spectrum(recording: Recording, sensor: str) -> Figure:
    """Draw amplitude spectral densities."""
    figure = new_figure(11.0, 4.6)
    left, right = figure.subplots(1, 2)
    lines = {"reading": (recording[columns.MAG.name(sensor=sensor)], INK)}
    if columns.CLEAN.name(sensor=sensor) in recording:
        lines["background"] = (recording[columns.CLEAN.name(sensor=sensor)], GRAY)
        lines["instrument error"] = (recording[columns.ERROR.name(sensor=sensor)], "#c9b037")
        lines |= {name: (values, PART_COLORS[name]) for name, values in part_projections(recording, sensor).items()}
    size = min(1024, len(recording))
    for name, (values, color) in lines.items():
        frequency, power = welch(values, recording.rate_hz, nperseg=size, detrend="linear")
        left.loglog(frequency[1:], np.sqrt(power[1:]), color=color, lw=1.0, label=name)
    dress(left, "nT / sqrt(Hz)", xlabel="frequency [Hz]")
    angles = {angle: np.degrees(np.unwrap(np.radians(angle_of(recording, angle)))) for angle in ANGLES}
    for way in columns.ROPE_WAYS:
        name = columns.TRUE_ROPE_ANGLE.name(way=way)
        if name in recording:
            angles[f"rope, {way}"] = recording[name]
    for (angle, values), color in zip(angles.items(), COLORS, strict=False):
        frequency, power = welch(values, recording.rate_hz, nperseg=size, detrend="linear")
        right.loglog(frequency[1:], np.sqrt(power[1:]), color=color, lw=1.0, label=angle)
    dress(right, "deg / sqrt(Hz)", xlabel="frequency [Hz]")
    for axes, title in ((left, f"{recording.name}, {sensor}: field"), (right, "attitude")):
        axes.axvspan(0.1, 0.6, color="#eef1f4", lw=0, zorder=0)
        axes.set_title(f"{title}; band shaded", fontsize=10, color=INK, loc="left")
        axes.legend(fontsize=8, frameon=False)
    return figure


def residuals(recording: Recording, sensor: str, estimates: Mapping[str, np.ndarray]) -> Figure:
    """Draw the error in band before and after compensation."""
    figure = new_figure(11.0, 1.8 + 1.5 * len(estimates))
    grid = figure.subplots(1 + len(estimates), 1, sharex=True)
    measured = recording[columns.MAG.name(sensor=sensor)]
    clean = recording[columns.CLEAN.name(sensor=sensor)]
    rows = {"before compensation": measured - clean}
    rows |= {name: measured - estimate - clean for name, estimate in estimates.items()}
    inner = signals.off_ends(recording.time_s)
    after = 0.0
    for i, (axes, (name, error)) in enumerate(zip(grid, rows.items(), strict=True)):
        band = signals.band_pass(error, recording.rate_hz)
        _shade_maneuvers(axes, recording, legend=i == 0)
        axes.plot(recording.time_s[inner], band[inner], color=COLORS[(i - 1) % len(COLORS)] if i else INK, lw=0.7)
        dress(axes, "[nT]", xlabel="time [s]" if i == len(estimates) else "")
        axes.set_title(f"{name}: STD {np.std(band[inner]):.4g} nT", fontsize=9, color=INK, loc="left")
        if i:
            after = max(after, 1.1 * float(np.max(np.abs(band[inner]))))
    for axes in grid[1:]:
        axes.set_ylim(-after, after)
    legend_above(grid[0], 3)
    grid[0].set_xlim(recording.time_s[0], recording.time_s[-1])
    figure.suptitle(f"{recording.name}, {sensor}: error against truth, 0.1 to 0.6 Hz", fontsize=10, color=INK)
    return figure


def _fields(recording: Recording, family: columns.Family, key: str) -> dict[str, np.ndarray]:
    """Return the columns of a family by the name of the feeder or bus."""
    found = {name: family.match(name) for name in recording.names("input")}
    return {fields[key]: recording[name] for name, fields in found.items() if fields is not None}


def electronics(recording: Recording, sensor: str) -> Figure:
    """Draw varying currents, bus voltages, and the field of the wiring along the background."""
    currents = _fields(recording, columns.CURRENT, "feeder")
    voltages = _fields(recording, columns.VOLTAGE, "bus")
    drawn = {name: amperes for name, amperes in currents.items() if np.ptp(amperes) > STEADY_A}
    truth = columns.CLEAN.name(sensor=sensor) in recording
    parts = part_projections(recording, sensor) if truth else {}
    rows = len(drawn) + bool(voltages) + ("electronics" in parts)
    figure = new_figure(12.0, 1.2 + 1.05 * rows)
    every = figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0].tolist()
    for axes in every:
        _shade_maneuvers(axes, recording, legend=axes is every[0])
    for i, (name, amperes) in enumerate(drawn.items()):
        axes = every.pop(0)
        axes.plot(recording.time_s, amperes, color=COLORS[i % len(COLORS)], lw=0.7)
        dress(axes, f"{name}\n[A]")
        if i == 0:
            axes.set_title(f"{recording.name}: onboard electronics", fontsize=10, color=INK, loc="left")
            legend_above(axes, 4)
    if voltages:
        axes = every.pop(0)
        for i, (name, volts) in enumerate(voltages.items()):
            axes.plot(recording.time_s, volts - np.median(volts), color=COLORS[i % len(COLORS)], lw=0.7, label=name)
        dress(axes, "buses less\nmedian [V]")
        axes.legend(fontsize=7, frameon=False, ncols=len(voltages), loc="lower right")
    if every:
        every[0].plot(recording.time_s, parts["electronics"], color=PART_COLORS["electronics"], lw=0.7)
        dress(every[0], f"field at\n{sensor} [nT]")
    figure.axes[-1].set_xlabel("time [s]", color=INK, fontsize=9)
    figure.axes[-1].set_xlim(recording.time_s[0], recording.time_s[-1])
    figure.align_ylabels()
    return figure

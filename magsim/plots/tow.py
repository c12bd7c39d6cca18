"""Drawing of a tow: the swing of the bird under its rope, and its effect on the field."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.signal import welch

from magsim import columns, signals
from magsim.plots.figures import COLORS, INK, angle_of, dress, legend_above, new_figure
from magsim.recording import Recording

SPECTRUM_S = 100.0
"""Length of the windows of a spectrum: nine periods of the swing of a 30 m rope."""


def swing_angles(recording: Recording) -> dict[str, np.ndarray]:
    """Return the angles of the rope and of the bird [deg]; yaw is the bird's heading less that of its carrier."""
    rope = {way: recording[columns.TRUE_ROPE_ANGLE.name(way=way)] for way in columns.ROPE_WAYS}
    carrier = recording[columns.TRUE_CARRIER_ATTITUDE.name(angle="heading")]
    yaw = (angle_of(recording, "heading") - carrier + 180.0) % 360.0 - 180.0
    return {
        "rope, trail": rope["trail"],
        "rope, side": rope["side"],
        "bird, pitch": angle_of(recording, "pitch"),
        "bird, yaw": yaw,
        "bird, roll": angle_of(recording, "roll"),
    }


def tow(recording: Recording, sensor: str) -> Figure:
    """Draw angles, tension, heights and field over time; the spectrum of the angles; the swing seen from above."""
    figure = new_figure(13.0, 8.4)
    grid = figure.add_gridspec(5, 2, width_ratios=(1.6, 1.0))
    angles = swing_angles(recording)
    time = [figure.add_subplot(grid[0, 0])]
    time += [figure.add_subplot(grid[row, 0], sharex=time[0]) for row in range(1, 5)]
    for axes in time:
        _shade_turns(axes, recording)
    for name, color in (("rope, trail", COLORS[0]), ("rope, side", COLORS[1])):
        time[0].plot(recording.time_s, angles[name], color=color, lw=0.8, label=name)
    for name, color in (("bird, pitch", COLORS[2]), ("bird, yaw", COLORS[3]), ("bird, roll", COLORS[4])):
        time[1].plot(recording.time_s, angles[name], color=color, lw=0.6, label=name)
    time[2].plot(recording.time_s, recording[columns.TRUE_ROPE_TENSION.name()], color=INK, lw=0.6)
    heights = {"carrier": (columns.TRUE_CARRIER_ALTITUDE, COLORS[0]), "bird": (columns.TRUE_ALTITUDE, INK)}
    for label, (family, color) in heights.items():
        time[3].plot(recording.time_s, recording[family.name()], color=color, lw=0.8, label=label)
    _field(time[4], recording, sensor)
    labels = ("rope [deg]", "bird [deg]", "tension [N]", "height [m]", "above 0.03 Hz [nT]")
    for axes, label in zip(time, labels, strict=True):
        dress(axes, label, xlabel="time [s]" if axes is time[-1] else "")
        axes.tick_params(labelbottom=axes is time[-1])
        legend_above(axes, 3)
    time[0].set_xlim(recording.time_s[0], recording.time_s[-1])
    time[0].set_title(f"{recording.name}: tow; turns shaded", fontsize=10, color=INK, loc="left")
    _spectrum(figure.add_subplot(grid[:3, 1]), recording)
    _from_above(figure.add_subplot(grid[3:, 1]), recording, angles)
    figure.align_ylabels()
    return figure


def _shade_turns(axes: Axes, recording: Recording) -> None:
    if columns.TURN.pattern in recording:
        turns = recording[columns.TURN.pattern] > 0.0
        axes.fill_between(
            recording.time_s, 0.0, 1.0, where=turns, transform=axes.get_xaxis_transform(), color="#eef1f4", lw=0
        )


def _field(axes: Axes, recording: Recording, sensor: str) -> None:
    """Draw the change of the background by the swing, and the interference, both high-passed."""
    for name, label, color in (
        (columns.SWING.name(sensor=sensor), "background, by swinging", COLORS[2]),
        (columns.INTERFERENCE.name(sensor=sensor), "interference", COLORS[1]),
    ):
        if name in recording:
            axes.plot(
                recording.time_s,
                signals.high_pass(recording[name], recording.rate_hz),
                color=color,
                lw=0.7,
                label=label,
            )


def straight(recording: Recording) -> np.ndarray:
    """Return the rows on legs, (n,) bool; all rows if the recording has no column of turns."""
    turn = columns.TURN.pattern
    return recording[turn] == 0.0 if turn in recording else np.ones(len(recording), dtype=bool)


def _spectrum(axes: Axes, recording: Recording) -> None:
    """Draw the spectral densities of the angles, averaged over the straight legs."""
    size = int(SPECTRUM_S * recording.rate_hz)
    pieces = [piece for piece in recording.take(straight(recording)).pieces() if len(piece) >= size // 2]
    found = [swing_angles(piece) for piece in pieces]
    for name, color in zip(found[0] if found else (), COLORS, strict=False):
        powers = []
        for angles in found:
            length = min(size, len(angles[name]))
            frequency, power = welch(angles[name], recording.rate_hz, nperseg=length, nfft=size, detrend="linear")
            powers.append(power)
        mean = np.average(powers, axis=0, weights=[len(piece) for piece in pieces])
        axes.loglog(frequency[1:], np.sqrt(mean[1:]), color=color, lw=1.0, label=name)
    axes.axvspan(0.1, 0.6, color="#eef1f4", lw=0, zorder=0)
    axes.set_title("angles on the legs; compensation band shaded", fontsize=10, color=INK, loc="left")
    dress(axes, "deg / sqrt(Hz)", xlabel="frequency [Hz]")
    if axes.lines:
        axes.legend(fontsize=8, frameon=False)
    else:
        note = f"no leg of {SPECTRUM_S / 2.0:.0f} s"
        axes.text(0.5, 0.5, note, transform=axes.transAxes, ha="center", fontsize=9, color=INK)


def _from_above(axes: Axes, recording: Recording, angles: dict[str, np.ndarray]) -> None:
    """Draw the bird's position relative to the hook, divided by its depth below, on legs and in turns."""
    right, behind = np.tan(np.radians(angles["rope, side"])), np.tan(np.radians(angles["rope, trail"]))
    legs = straight(recording)
    for rows, color, label in ((~legs, "#b7bec6", "turns"), (legs, COLORS[0], "legs")):
        axes.plot(right[rows], -behind[rows], ".", ms=1.5, color=color, label=label)
    axes.plot(0.0, 0.0, "+", color=INK, ms=9)
    axes.annotate("hook", (0.0, 0.0), (6, 4), textcoords="offset points", fontsize=8, color=INK)
    axes.set_aspect("equal", adjustable="datalim")
    dress(axes, "ahead / below", xlabel="right / below")
    axes.set_title("the bird seen from above, along the course", fontsize=10, color=INK, loc="left")
    axes.legend(fontsize=8, frameon=False, markerscale=5.0, loc="best")

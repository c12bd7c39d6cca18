"""Drawing of a compensation report: one page with signatures, spectra, shares and coherences."""

import textwrap

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.transforms import Bbox

from magsim import signals
from magsim.diagnosis.explain import Explanation
from magsim.diagnosis.explain_text import head_block, headline, signature_block
from magsim.plots.figures import COLORS, GRAY, INK, dress, new_figure

PAGE_IN = (8.27, 11.69)
"""A4, upright."""

LINES = {"before": (INK, 1.0), "after": (COLORS[1], 1.2), "noise": (GRAY, 1.0)}

MOST_CHANNELS, MOST_SHARES = 10, 14
"""Bars that are drawn, the largest."""


def page(found: Explanation) -> Figure:
    """Draw the whole report on one page."""
    figure = new_figure(*PAGE_IN)
    notes = [line for note in found.notes for line in textwrap.wrap(f"- {note}", 118, subsequent_indent="  ")][:9]
    heights = (2.6, 2.1 if found.signatures.signatures else 0.3, 3.1, 3.1, 0.25 + 0.16 * len(notes))
    grid = figure.add_gridspec(5, 2, height_ratios=heights)
    engine = figure.get_layout_engine()
    assert isinstance(engine, ConstrainedLayoutEngine)
    engine.set(rect=(0.03, 0.02, 0.94, 0.95))
    figure.suptitle(headline(found), x=0.04, y=0.985, ha="left", fontsize=13, color=INK, fontweight="bold")
    _table(figure.add_subplot(grid[0, :]), head_block(found).rows, widths=(0.26, 0.74))
    signatures = figure.add_subplot(grid[1, :])
    if found.signatures.signatures:
        block = signature_block(found)
        _table(signatures, (block.header, *block.rows), title=block.title)
    else:
        signatures.set_axis_off()
    _spectra(figure.add_subplot(grid[2, :]), found)
    _shares(figure.add_subplot(grid[3, 0]), found)
    _coherences(figure.add_subplot(grid[3, 1]), found)
    last = figure.add_subplot(grid[4, :])
    last.set_axis_off()
    last.text(0.0, 1.0, "\n".join(notes), va="top", fontsize=7.5, color=INK, transform=last.transAxes)
    return figure


def picture(found: Explanation) -> Figure:
    """Draw spectra, shares and coherences alone, for a page that has the tables as text."""
    figure = new_figure(11.0, 7.4)
    grid = figure.add_gridspec(2, 2)
    _spectra(figure.add_subplot(grid[0, :]), found)
    _shares(figure.add_subplot(grid[1, 0]), found)
    _coherences(figure.add_subplot(grid[1, 1]), found)
    return figure


def _table(
    axes: Axes, rows: tuple[tuple[str, ...], ...], *, title: str = "", widths: tuple[float, ...] | None = None
) -> None:
    """Draw rows of text; with a title the first row is the header."""
    axes.set_axis_off()
    table = axes.table(
        cellText=[list(row) for row in rows], colWidths=widths, cellLoc="right" if title else "left", loc="upper left",
        bbox=Bbox.unit(),
    )  # fmt: skip
    table.auto_set_font_size(False)
    table.set_fontsize(8)
    for (row, column), cell in table.get_celld().items():
        cell.set_edgecolor("#e4e7ea")
        cell.visible_edges = "B"
        cell.get_text().set_color(INK)
        if (title and row == 0) or (not title and column == 0):
            cell.get_text().set_color(GRAY)
        if title and row == len(rows) - 1:
            cell.get_text().set_fontweight("bold")
    if title:
        axes.set_title(title, fontsize=9, color=INK, loc="left")


def _spectra(axes: Axes, found: Explanation) -> None:
    for name, spectrum in found.spectra.items():
        color, width = LINES[name]
        # beyond it is what the anti-alias filter leaves
        rows = (spectrum.frequency_hz > 0.0) & (spectrum.frequency_hz < 0.8 * spectrum.frequency_hz[-1])
        density = np.sqrt(spectrum.density[rows])
        axes.loglog(spectrum.frequency_hz[rows], density, color=color, lw=width, label=name)
    axes.axvspan(*signals.BAND_HZ, color="#eef1f4", lw=0, zorder=0)
    dress(axes, "nT / sqrt(Hz)", xlabel="frequency [Hz]")
    axes.set_title("spectra; band shaded", fontsize=9, color=INK, loc="left")
    if found.spectra:
        axes.legend(fontsize=8, frameon=False, loc="upper right")
    else:
        _missing(axes, "no piece is long enough for a spectrum")


def _shares(axes: Axes, found: Explanation) -> None:
    axes.set_title("interference by source, in band", fontsize=9, color=INK, loc="left")
    if not found.shares:
        dress(axes, "")
        _missing(axes, "the method has no shares")
        return
    ordered = sorted(found.shares, key=lambda share: share.std_nt)[-MOST_SHARES:]
    names = [share.group for share in ordered]
    values = [share.std_nt for share in ordered]
    axes.barh(names, values, color=[COLORS[i % len(COLORS)] for i in range(len(names))][::-1], height=0.6)
    axes.axvline(found.after_nt, color=INK, lw=1.0, ls="--")
    axes.annotate(
        "left", (found.after_nt, 1.0), xycoords=("data", "axes fraction"), xytext=(3, -9), textcoords="offset points",
        fontsize=7, color=INK,
    )  # fmt: skip
    axes.set_xscale("log")
    axes.set_xlim(0.5 * min(found.after_nt, *values), 2.0 * max(values))
    dress(axes, "", xlabel="STD [nT]")


def _coherences(axes: Axes, found: Explanation) -> None:
    axes.set_title("coherence of what is left, largest in band", fontsize=9, color=INK, loc="left")
    if not found.coherences:
        dress(axes, "")
        _missing(axes, "no piece is long enough for a coherence")
        return
    shown = found.coherences[:MOST_CHANNELS][::-1]
    colors = [COLORS[1] if one.is_significant else GRAY for one in shown]
    axes.barh([one.channel for one in shown], [one.peak for one in shown], color=colors, height=0.6)
    axes.axvline(shown[0].level, color=INK, lw=1.0, ls="--")
    axes.set_xlim(0.0, 1.0)
    dress(axes, "", xlabel="squared coherence; dashed: chance at 95 %")
    axes.tick_params(axis="y", labelsize=7)


def _missing(axes: Axes, text: str) -> None:
    axes.set_xticks([])
    axes.set_yticks([])
    axes.text(0.5, 0.5, text, ha="center", va="center", fontsize=8, color=GRAY, transform=axes.transAxes)

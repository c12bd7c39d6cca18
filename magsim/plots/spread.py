"""Figures of repeated measurements: every value, their median, and what others have printed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from matplotlib.figure import Figure

from magsim.plots.figures import COLORS, INK, dress, legend_above, new_figure

WIDTH = 0.8
"""Of all series of a category together, of 1."""


@dataclass(frozen=True)
class Series:
    """One color: its name, the values of each category, and a published figure of some."""

    name: str
    values: Sequence[Sequence[float]]
    published: Mapping[int, float] = field(default_factory=dict)


def spread(categories: Sequence[str], series: Sequence[Series], label: str, *, logarithmic: bool = False) -> Figure:
    """Draw the values of several series by category: points, their medians as dashes, published figures as diamonds.

    Parameters
    ----------
    categories : sequence of str
    series : sequence of Series
        Each with values for every category, of which some may be empty.
    label : str
        Of the values.
    logarithmic : bool
    """
    figure = new_figure(max(6.0, 0.4 * len(categories) * (1 + len(series))), 3.8)
    axes = figure.subplots()
    step = WIDTH / len(series)
    printed = False
    for number, one in enumerate(series):
        color = COLORS[number % len(COLORS)]
        center = np.arange(len(categories)) + step * (number - 0.5 * (len(series) - 1))
        for at, values in zip(center, one.values, strict=True):
            if not len(values):
                continue
            # side by side in the order of the flights, so that none hides another
            places = at + step * np.linspace(-0.3, 0.3, len(values)) if len(values) > 1 else [at]
            axes.plot(places, values, ".", color=color, alpha=0.45, markersize=4)
            axes.hlines(float(np.median(values)), at - 0.42 * step, at + 0.42 * step, color=color, linewidth=2)
        axes.plot([], [], color=color, linewidth=2, label=one.name)
        for category, value in one.published.items():
            axes.plot(
                center[category], value, "D", color=INK, markerfacecolor="none", label=None if printed else "published"
            )
            printed = True
    axes.set_xticks(range(len(categories)), categories)
    if logarithmic:
        axes.set_yscale("log")
    dress(axes, label)
    legend_above(axes, len(series) + printed)
    return figure


def curves(
    lines: Mapping[str, tuple[Sequence[float], Sequence[float]]],
    xlabel: str,
    ylabel: str,
    *,
    points: Mapping[str, tuple[Sequence[float], Sequence[float]]] | None = None,
    logarithmic: bool = False,
) -> Figure:
    """Draw curves by name, and published points in the color of the curve of the same name.

    Parameters
    ----------
    lines, points : mapping of str to (x, y)
    xlabel, ylabel : str
    logarithmic : bool
        Of the values.
    """
    figure = new_figure(7.0, 3.8)
    axes = figure.subplots()
    for number, (name, (x, y)) in enumerate(lines.items()):
        color = COLORS[number % len(COLORS)]
        axes.plot(x, y, color=color, linewidth=1.2, label=name)
        if points and name in points:
            axes.plot(*points[name], "D", color=color, markerfacecolor="none", markersize=5)
    if points:
        axes.plot([], [], "D", color=INK, markerfacecolor="none", label="published")
    if logarithmic:
        axes.set_yscale("log")
    dress(axes, ylabel, xlabel=xlabel)
    legend_above(axes, len(lines) + bool(points))
    return figure

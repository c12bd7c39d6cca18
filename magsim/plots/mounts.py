"""The drawing of a mount map: predicted figure of merit on two planes through an aircraft, and on its skin."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from magsim.plots.slices import Slice

INK = "#22262b"
COLORS = "viridis_r"


@dataclass(frozen=True)
class MapPicture:
    """Everything that the picture shows.

    Attributes
    ----------
    title : str
    slices : tuple of Slice
    triangles_m : (t, 3, 3) [m]
        Corners of the skin's triangles; none where the aircraft has no skin.
    skin_values : (t,) [nT]
    mounts : mapping of str to (3,) [m]
    """

    title: str
    slices: tuple[Slice, ...]
    triangles_m: np.ndarray
    skin_values: np.ndarray
    mounts: Mapping[str, np.ndarray]


def draw(picture: MapPicture) -> Figure:
    """The picture of a mount map."""
    figure = Figure(figsize=(14.0, 9.0), dpi=110, layout="constrained")
    figure.patch.set_facecolor("white")
    values = np.concatenate([part.values.ravel() for part in picture.slices])
    low, high = np.nanpercentile(values, [1.0, 99.0])
    norm = LogNorm(max(low, 1e-6 * high), high)
    has_skin = len(picture.triangles_m) > 0
    grid = figure.add_gridspec(2, 2 if has_skin else 1, width_ratios=(1.25, 1.0) if has_skin else (1.0,))
    shown = None
    for row, part in enumerate(picture.slices):
        axes = figure.add_subplot(grid[row, 0])
        shown = _slice(axes, part, picture, norm)
    if has_skin:
        _skin(figure.add_subplot(grid[:, 1], projection="3d"), picture, norm)
    bar = figure.colorbar(shown, ax=figure.axes, shrink=0.6, pad=0.01)
    bar.set_label("predicted figure of merit [nT]", color=INK, fontsize=9)
    figure.suptitle(picture.title, fontsize=11, color=INK, x=0.01, ha="left")
    return figure


def _slice(axes: Axes, part: Slice, picture: MapPicture, norm: LogNorm) -> object:
    first, second = part.axes
    edges = [np.concatenate([side - 0.5 * (side[1] - side[0]), side[-1:] + 0.5 * (side[1] - side[0])])
             for side in (part.across, part.up)]
    shown = axes.pcolormesh(*edges, np.ma.masked_invalid(part.values.T), norm=norm, cmap=COLORS, rasterized=True)
    if len(picture.triangles_m):
        flat = picture.triangles_m[:, :, [first, second]]
        closed = np.concatenate([flat, flat[:, :1], np.full_like(flat[:, :1], np.nan)], axis=1)
        axes.plot(*closed.reshape(-1, 2).T, color="white", lw=0.25, alpha=0.5)
    for name, place in picture.mounts.items():
        axes.plot(place[first], place[second], "o", ms=3.5, mfc="white", mec=INK, mew=0.8)
        axes.annotate(name, (place[first], place[second]), xytext=(3, 3), textcoords="offset points", fontsize=6, color=INK)
    axes.set_aspect("equal")
    if second == 2:
        axes.invert_yaxis()  # down is down
    names = ("forward", "right", "down")
    axes.set_xlabel(f"{names[first]} [m]", fontsize=9, color=INK)
    axes.set_ylabel(f"{names[second]} [m]", fontsize=9, color=INK)
    axes.tick_params(labelsize=8, colors=INK)
    axes.set_title(part.title, fontsize=9, loc="left", color=INK)
    return shown


def _skin(axes: Axes, picture: MapPicture, norm: LogNorm) -> None:
    # Seen from the right, ahead and above; matplotlib's z is up.
    corners = picture.triangles_m * (1.0, -1.0, -1.0)
    colors = colormaps[COLORS](norm(np.nan_to_num(picture.skin_values, nan=norm.vmax)))
    axes.add_collection3d(Poly3DCollection(corners, facecolors=colors, edgecolors=(1, 1, 1, 0.15), linewidths=0.2))
    low, high = corners.reshape(-1, 3).min(axis=0), corners.reshape(-1, 3).max(axis=0)
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_zlim(low[2], high[2])
    axes.set_box_aspect(high - low, zoom=1.25)
    axes.view_init(elev=28, azim=-50)
    axes.set_axis_off()
    axes.set_title("on the aircraft, just off its skin", fontsize=9, loc="left", color=INK)

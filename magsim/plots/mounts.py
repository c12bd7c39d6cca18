"""The drawing of a mount map: predicted figure of merit on two planes through an aircraft, and on its skin."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from magsim.plots.slices import Slice

INK = "#22262b"
COLORS = "viridis_r"
NO_PLACE = (0.75, 0.75, 0.75, 1.0)
"""Color of where no sensor can be."""


@dataclass(frozen=True)
class MapPicture:
    """Everything that the picture shows.

    Attributes
    ----------
    title : str
    slices : tuple of Slice
    triangles_m : (t, 3, 3) [m]
        Corners of the triangles of the skin or outline; none where the aircraft has neither.
    skin_values : (t,) [nT]
    off_m : float [m]
        Distance from the skin at which those are.
    mounts : mapping of str to (3,) [m]
    """

    title: str
    slices: tuple[Slice, ...]
    triangles_m: np.ndarray
    skin_values: np.ndarray
    off_m: float
    mounts: Mapping[str, np.ndarray]


def draw(picture: MapPicture) -> Figure:
    """Draw a mount map."""
    has_skin = len(picture.triangles_m) > 0
    figure = Figure(figsize=(14.0 if has_skin else 8.5, 7.6), dpi=110, layout="constrained")
    figure.patch.set_facecolor("white")
    values = np.concatenate([part.values.ravel() for part in picture.slices])
    low, high = np.nanpercentile(values, [0.5, 97.0])
    norm = LogNorm(max(low, 1e-6 * high), high)
    heights = [max(np.ptp(part.up) / np.ptp(part.across), 0.3) for part in picture.slices]
    grid = figure.add_gridspec(2, 2 if has_skin else 1, width_ratios=(1.0, 1.2)[: 1 + has_skin], height_ratios=heights)
    shown = [_slice(figure.add_subplot(grid[row, 0]), part, picture, norm) for row, part in enumerate(picture.slices)]
    if has_skin:
        _skin(figure.add_subplot(grid[:, 1], projection="3d"), picture, norm)
    bar = figure.colorbar(shown[-1], ax=figure.axes, shrink=0.6, pad=0.01, extend="both")
    bar.set_label("predicted figure of merit [nT]", color=INK, fontsize=9)
    figure.suptitle(picture.title, fontsize=11, color=INK, x=0.01, ha="left")
    names = ",  ".join(f"{number} {name}" for number, name in enumerate(picture.mounts, start=1))
    figure.supxlabel(f"mounts: {names}", fontsize=8, color=INK, x=0.01, ha="left")
    return figure


def _slice(axes: Axes, part: Slice, picture: MapPicture, norm: LogNorm) -> QuadMesh:
    first, second = part.axes
    edges = [_edges(side) for side in (part.across, part.up)]
    shown = axes.pcolormesh(*edges, np.ma.masked_invalid(part.values.T), norm=norm, cmap=COLORS, rasterized=True)
    if len(picture.triangles_m):
        flat = picture.triangles_m[:, :, [first, second]]
        closed = np.concatenate([flat, flat[:, :1], np.full_like(flat[:, :1], np.nan)], axis=1)
        axes.plot(*closed.reshape(-1, 2).T, color="white", lw=0.25, alpha=0.5)
    for number, place in enumerate(picture.mounts.values(), start=1):
        at = place[first], place[second]
        axes.plot(*at, "o", ms=3.0, mfc="white", mec=INK, mew=0.7)
        # Numbers of mounts that lie close together fan out.
        aside = (4 if number % 2 else -4, 3 + 4 * (number % 3))
        axes.annotate(
            str(number),
            at,
            xytext=aside,
            textcoords="offset points",
            ha="left" if number % 2 else "right",
            fontsize=6.5,
            color=INK,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5, "alpha": 0.7},
        )
    axes.set_facecolor(NO_PLACE)
    axes.set_aspect("equal")
    axes.set_xlim(edges[0][0], edges[0][-1])
    axes.set_ylim(*(edges[1][[-1, 0]] if second == 2 else edges[1][[0, -1]]))  # down is down
    names = ("forward", "right", "down")
    axes.set_xlabel(f"{names[first]} [m]", fontsize=9, color=INK)
    axes.set_ylabel(f"{names[second]} [m]", fontsize=9, color=INK)
    axes.tick_params(labelsize=8, colors=INK)
    axes.set_title(part.title, fontsize=9, loc="left", color=INK)
    return shown


def _edges(side: np.ndarray) -> np.ndarray:
    """Return the borders of cells around evenly spaced places."""
    half = 0.5 * (side[1] - side[0])
    return np.append(side - half, side[-1] + half)


def _skin(axes: Axes3D, picture: MapPicture, norm: LogNorm) -> None:
    # Seen from the right, ahead and above; matplotlib's z is up.
    corners = picture.triangles_m * (1.0, -1.0, -1.0)
    colors = colormaps[COLORS](norm(np.nan_to_num(picture.skin_values, nan=float(norm.vmax or 0.0))))
    colors[np.isnan(picture.skin_values)] = NO_PLACE
    axes.add_collection3d(Poly3DCollection(corners, facecolors=colors, edgecolors=(1, 1, 1, 0.15), linewidths=0.2))
    low, high = corners.reshape(-1, 3).min(axis=0), corners.reshape(-1, 3).max(axis=0)
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_zlim(low[2], high[2])
    axes.set_box_aspect(high - low, zoom=1.3)
    axes.view_init(elev=30, azim=-50)
    axes.set_axis_off()
    axes.set_title(f"on the aircraft, {picture.off_m:g} m off its skin", fontsize=9, loc="left", color=INK)

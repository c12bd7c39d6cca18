"""Figures of recordings and scores (matplotlib, no display needed).

Each kind is one function ``recording -> Figure``; ``KINDS`` is the table that the command line reads.
"""

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np

from magsim import columns
from magsim.config.schema import did_you_mean
from magsim.errors import RequestError
from magsim.plots.slices import Slice
from magsim.recording import Recording
from magsim.storage import atomic_write

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from magsim.diagnosis.explain import Explanation

__all__ = [
    "KINDS",
    "Slice",
    "plot_electronics",
    "plot_explanation",
    "plot_field",
    "plot_flight",
    "plot_interference",
    "plot_mounts",
    "plot_residuals",
    "plot_spectrum",
    "plot_tow",
    "save",
]


def _figures(module: str = "figures") -> ModuleType:
    try:
        return import_module(f"magsim.plots.{module}")
    except ImportError as error:
        if error.name and error.name.startswith("matplotlib"):
            msg = "plots need matplotlib, which is not installed: pip install 'aeromagsim[report]'"
            raise RequestError(msg) from None
        raise


def plot_flight(recording: Recording, sensor: str | None = None) -> "Figure":
    """Plot the ground track, and roll, pitch, heading and height over time, with legs and maneuvers marked."""
    del sensor
    return _figures().flight(recording)


def plot_field(recording: Recording, sensor: str | None = None) -> "Figure":
    """Plot the reading of a scalar magnetometer, with the background field if the truth is known."""
    return _figures().field(recording, pick_sensor(recording, sensor))


def plot_interference(recording: Recording, sensor: str | None = None) -> "Figure":
    """Plot the contribution of each part of the platform to the scalar reading, in full and in the band."""
    sensor = pick_sensor(recording, sensor)
    _need_truth(recording, sensor)
    return _figures().interference(recording, sensor)


def plot_spectrum(recording: Recording, sensor: str | None = None) -> "Figure":
    """Plot the amplitude spectral density of the reading, the background, the parts and the attitude."""
    return _figures().spectrum(recording, pick_sensor(recording, sensor))


def plot_electronics(recording: Recording, sensor: str | None = None) -> "Figure":
    """Plot varying currents, bus voltages, and the field of the wiring if the truth is known."""
    sensor = pick_sensor(recording, sensor)
    if not any(columns.find(name) is columns.CURRENT for name in recording.names("input")):
        msg = (
            f"recording {recording.name!r} has no currents; this figure needs an aircraft with wiring, "
            "field.electronics and sensors.electrical enabled"
        )
        raise RequestError(msg)
    return _figures().electronics(recording, sensor)


def plot_tow(recording: Recording, sensor: str | None = None) -> "Figure":
    """Plot the swing of a towed bird: angles, tension, heights, effect on the field, and the spectrum.

    Raises
    ------
    RequestError
        If the recording has no rope.
    """
    sensor = pick_sensor(recording, sensor)
    if columns.TRUE_ROPE_TENSION.name() not in recording:
        msg = f"recording {recording.name!r} has no rope; this figure needs a simulated tow with its truth"
        raise RequestError(msg)
    return _figures("tow").tow(recording, sensor)


def plot_residuals(recording: Recording, sensor: str, estimates: Mapping[str, np.ndarray]) -> "Figure":
    """Plot the error in band before and after compensation.

    Parameters
    ----------
    recording : Recording
        With truth.
    sensor : str
        Scalar magnetometer.
    estimates : mapping of str to (n,) [nT]
        Interference that each method returned for the recording's rows.
    """
    _need_truth(recording, sensor)
    return _figures().residuals(recording, sensor, estimates)


def plot_explanation(found: "Explanation", *, tables: bool = True) -> "Figure":
    """Plot a compensation report on one page; without tables its spectra, shares and coherences alone."""
    drawing = _figures("report")
    return drawing.page(found) if tables else drawing.picture(found)


def plot_mounts(
    title: str,
    slices: Sequence[Slice],
    triangles_m: np.ndarray,
    skin_values: np.ndarray,
    *,
    off_m: float,
    mounts: Mapping[str, Sequence[float]],
) -> "Figure":
    """Plot a mount map: planes through an aircraft, and its surface, colored by the predicted figure of merit.

    Parameters
    ----------
    title : str
    slices : sequence of Slice
        Two of them.
    triangles_m : (t, 3, 3) [m]
        Corners of the triangles of the skin or outline; none if the aircraft has neither.
    skin_values : (t,) [nT]
    off_m : float [m]
        Distance from the skin of these values.
    mounts : mapping of str to (3,) [m]
    """
    drawing = _figures("mounts")
    return drawing.draw(drawing.MapPicture(title, tuple(slices), triangles_m, skin_values, off_m, mounts))


KINDS: dict[str, Callable[[Recording, str | None], "Figure"]] = {
    "flight": plot_flight,
    "field": plot_field,
    "interference": plot_interference,
    "spectrum": plot_spectrum,
    "electronics": plot_electronics,
    "tow": plot_tow,
}
"""Kinds of ``magsim plot``."""


def plot(recording: Recording, kind: str, sensor: str | None = None) -> "Figure":
    """Draw a figure of a kind.

    Raises
    ------
    RequestError
        If there is no such kind, or the recording lacks what it shows.
    """
    if kind not in KINDS:
        msg = f"there is no figure {kind!r}{did_you_mean(kind, KINDS)}; allowed: {', '.join(KINDS)}"
        raise RequestError(msg)
    return KINDS[kind](recording, sensor)


def pick_sensor(recording: Recording, sensor: str | None) -> str:
    """Return the named scalar magnetometer, by default the first.

    Raises
    ------
    RequestError
        If the recording has no such sensor.
    """
    known = recording.scalars
    if sensor is None and known:
        return known[0]
    if sensor not in known:
        msg = (
            f"recording {recording.name!r} has no scalar magnetometer {sensor!r}; allowed: {', '.join(known) or 'none'}"
        )
        raise RequestError(msg)
    return sensor


def _need_truth(recording: Recording, sensor: str) -> None:
    if columns.CLEAN.name(sensor=sensor) not in recording:
        msg = (
            f"recording {recording.name!r} has no truth for sensor {sensor!r}; this figure needs a simulated recording"
        )
        raise RequestError(msg)


def save(figure: "Figure", path: Path, *, force: bool = False) -> None:
    """Write a figure as PNG, SVG or PDF, according to the ending of the path, atomically.

    Raises
    ------
    RequestError
        If the ending is another, or the file exists and ``force`` is not set.
    """
    kind = path.suffix.lower().lstrip(".")
    if kind not in {"png", "svg", "pdf"}:
        msg = f"{path}: a picture ends in .png, .svg or .pdf, not {path.suffix!r}"
        raise RequestError(msg)
    from matplotlib import rc_context

    metadata = {"png": {"Software": None}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}[kind]
    # Names inside an SVG are hashed with a salt that is random by default; fonts of a PDF are outlines, not Type 3.
    with rc_context({"svg.hashsalt": "magsim", "pdf.fonttype": 42}):
        atomic_write(path, lambda part: figure.savefig(part, format=kind, metadata=metadata), force=force)

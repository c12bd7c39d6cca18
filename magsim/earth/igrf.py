"""The main field: IGRF-14, its gradient, and its decimal years.

The coefficients are in ``igrf14.txt`` beside this file, read once per process.
"""

from dataclasses import dataclass
from datetime import UTC, datetime
from functools import lru_cache
from importlib import resources
from typing import Literal, overload

import numpy as np

from magsim import frames
from magsim.earth import harmonics, wgs84


@dataclass(frozen=True)
class Model:
    """Gauss coefficients, linear in time between epochs.

    Attributes
    ----------
    name : str
    epochs : (e,) [decimal year]
    coefficients : (e, k) complex [nT]
        From ``harmonics.complex_coefficients``, one row for each epoch.
    """

    name: str
    epochs: np.ndarray
    coefficients: np.ndarray

    def interval(self, number: int, *, gradient: bool) -> tuple[np.ndarray, np.ndarray]:
        """Return the contractions at the start of an interval between epochs, and their change per year."""
        base = harmonics.contraction(self.coefficients[number], gradient=gradient)
        end = harmonics.contraction(self.coefficients[number + 1], gradient=gradient)
        return base, (end - base) / (self.epochs[number + 1] - self.epochs[number])


def parse_coefficients(name: str, text: str) -> Model:
    """Read a table of coefficients in the layout of ``igrf14.txt``.

    Parameters
    ----------
    name : str
        Of the model.
    text : str
        Comment lines that begin with ``#``; ``epoch - - t...``; then ``g|h degree order value...``.
    """
    rows = [line.split() for line in text.splitlines() if line and not line.startswith("#")]
    epochs = np.array(rows[0][3:], dtype=float)
    degree = max(int(row[1]) for row in rows[1:])
    tables = {kind: np.zeros((len(epochs), harmonics.index(degree + 1, 0))) for kind in "gh"}
    for kind, n, m, *values in rows[1:]:
        tables[kind][:, harmonics.index(int(n), int(m))] = np.array(values, dtype=float)
    pairs = zip(tables["g"], tables["h"], strict=True)
    return Model(name, epochs, np.array([harmonics.complex_coefficients(g, h) for g, h in pairs]))


@lru_cache(maxsize=1)
def igrf14() -> Model:
    """Return IGRF-14 from the file in the package."""
    text = resources.files("magsim.earth").joinpath("igrf14.txt").read_text(encoding="ascii")
    return parse_coefficients("IGRF-14", text)


@lru_cache(maxsize=64)
def _igrf_interval(number: int, gradient: bool) -> tuple[np.ndarray, np.ndarray]:
    return igrf14().interval(number, gradient=gradient)


def field_of_model(position_e: np.ndarray, year: np.ndarray, model: Model, *, gradient: bool = False) -> np.ndarray:
    """Return the field of a model at Earth-fixed positions, each with its own time.

    Parameters
    ----------
    position_e : (n, 3) [m]
    year : (n,) [decimal year]
    model : Model
    gradient : bool

    Returns
    -------
    (n, 3) [nT], or (n, 9) [nT] and [nT/m]
        Field in Earth-fixed axes, then the gradient's entries in the order of ``harmonics.PAIRS``.

    Raises
    ------
    ValueError
        If a year is outside the model's epochs.
    """
    first, last = model.epochs[0], model.epochs[-1]
    outside = ~((year >= first) & (year <= last))
    if outside.any():
        msg = f"{model.name} covers the years {first:g} to {last:g}, not {year[outside][0]:g}"
        raise ValueError(msg)
    numbers = np.clip(np.searchsorted(model.epochs, year, side="right") - 1, 0, len(model.epochs) - 2)
    out = np.empty((len(year), 9 if gradient else 3))
    for number in np.unique(numbers).tolist():
        rows = numbers == number
        if model is igrf14():
            base, rate = _igrf_interval(number, gradient)
        else:
            base, rate = model.interval(number, gradient=gradient)
        out[rows] = harmonics.evaluate(position_e[rows], base, rate, year[rows] - model.epochs[number])
    return out


@overload
def igrf(
    lat_rad: np.ndarray | float,
    lon_rad: np.ndarray | float,
    alt_m: np.ndarray | float,
    year: np.ndarray | float,
    *,
    gradient: Literal[False] = False,
    model: Model | None = None,
) -> np.ndarray: ...


@overload
def igrf(
    lat_rad: np.ndarray | float,
    lon_rad: np.ndarray | float,
    alt_m: np.ndarray | float,
    year: np.ndarray | float,
    *,
    gradient: Literal[True],
    model: Model | None = None,
) -> tuple[np.ndarray, np.ndarray]: ...


def igrf(
    lat_rad: np.ndarray | float,
    lon_rad: np.ndarray | float,
    alt_m: np.ndarray | float,
    year: np.ndarray | float,
    *,
    gradient: bool = False,
    model: Model | None = None,
) -> np.ndarray | tuple[np.ndarray, np.ndarray]:
    """Return the main field of IGRF-14 in local axes, one time for each position.

    Parameters
    ----------
    lat_rad, lon_rad : (...) [rad]
        WGS-84 (geodetic) latitude and longitude.
    alt_m : (...) [m]
        Height above the WGS-84 ellipsoid.
    year : (...) [decimal year]
        1900.0 to 2030.0. All four broadcast; positions and times are paired.
    gradient : bool
        Return the gradient too.
    model : Model, optional
        Other coefficients than IGRF-14.

    Returns
    -------
    field_n : (..., 3) [nT]
        North, east, down.
    gradient_n : (..., 3, 3) [nT/m]
        Only with ``gradient``: ``[j, k]`` is the derivative of component ``j`` along axis ``k``, north, east, down.
        Symmetric, with trace 0.

    Raises
    ------
    ValueError
        If a year is outside the epochs, or a latitude beyond a pole (degrees instead of radians).

    Notes
    -----
    Alken et al. (2021), Earth, Planets and Space 73, 49 for the model; see ``harmonics`` for the method. Agrees with
    IAGA's program within the rounding of its printed inputs (0.1 nT).
    """
    arrays = np.broadcast_arrays(*(np.asarray(v, dtype=float) for v in (lat_rad, lon_rad, alt_m, year)))
    shape = arrays[0].shape
    lat, lon, alt, when = (array.ravel() for array in arrays)
    beyond = np.abs(lat) > np.pi / 2 + 1e-12
    if beyond.any():
        msg = f"latitude {lat[beyond][0]:g} rad is beyond a pole; allowed: -pi/2 to pi/2"
        raise ValueError(msg)
    position_e = wgs84.ecef_from_geodetic(lat, lon, alt)
    rot_ne = wgs84.rot_ne_at(lat, lon)
    values = field_of_model(position_e, when, model or igrf14(), gradient=gradient)
    field_n = frames.rotate(rot_ne, values[:, :3]).reshape(*shape, 3)
    if not gradient:
        return field_n
    gradient_e = harmonics.unpack_gradient(values[:, 3:])
    half = np.einsum("nij,njk->nik", rot_ne, gradient_e)
    gradient_n = np.einsum("nik,nlk->nil", half, rot_ne)
    return field_n, gradient_n.reshape(*shape, 3, 3)


def _year_start(year: int) -> datetime:
    return datetime(year, 1, 1, tzinfo=UTC)


def decimal_year(when: datetime) -> float:
    """Return the decimal year of an instant: year + time since January 1 over the length of that year.

    Parameters
    ----------
    when : datetime
        With a time zone, or in UTC without one.
    """
    when = when.replace(tzinfo=UTC) if when.tzinfo is None else when.astimezone(UTC)
    start = _year_start(when.year)
    return when.year + (when - start) / (_year_start(when.year + 1) - start)


def decimal_years(start: datetime, time_s: np.ndarray | float) -> np.ndarray:
    """Return the decimal years of instants counted in seconds from a start.

    Parameters
    ----------
    start : datetime
        With a time zone, or in UTC without one.
    time_s : (...) [s]

    Returns
    -------
    (...) [decimal year]
    """
    start = start.replace(tzinfo=UTC) if start.tzinfo is None else start.astimezone(UTC)
    time_s = np.asarray(time_s, dtype=float)
    # A year has 365 days or more: enough new years to hold every instant.
    before = int(max(0.0, -time_s.min(initial=0.0)) // (365 * 86400.0)) + 1
    after = int(max(0.0, time_s.max(initial=0.0)) // (365 * 86400.0)) + 2
    years = np.arange(start.year - before, start.year + after + 1)
    starts_s = [(_year_start(int(year)) - start).total_seconds() for year in years]
    return np.interp(time_s, starts_s, years.astype(float))

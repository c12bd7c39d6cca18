"""Channels that cannot be what they should: dead ones, and those in another unit."""

from collections.abc import Iterator, Mapping

import numpy as np

from magsim import columns

FIELD_NT = (15_000.0, 90_000.0)
"""Length of a field that a survey can meet [nT]: the Earth's is 22,000 to 67,000 nT (IGRF-14); the rest is for
platforms and for fluxgates that were never calibrated."""

UNITS = {"microteslas": 1e3, "gauss": 1e5, "milligauss": 1e2, "teslas": 1e9}
"""Units of a field and their size in nanoteslas."""

FEWEST = 100
"""Rows from which on a channel that never changes is dead."""

MOST_RAD = 2.0 * np.pi + 0.01
"""Largest heading in radians."""


def problems_of(data: Mapping[str, np.ndarray]) -> list[str]:
    """Return what is wrong with channels, one line each, with what would mend it.

    Parameters
    ----------
    data : mapping of str to (n,)
        Columns of a recording, finite.
    """
    return [*_dead(data), *_fields(data), *_angles(data)]


def _dead(data: Mapping[str, np.ndarray]) -> Iterator[str]:
    for name, values in data.items():
        alive = columns.find(name) in (columns.MAG, columns.FLUX)
        if alive and len(values) >= FEWEST and np.ptp(values) == 0.0:
            yield f"{name} is {values[0]:g} in all {len(values)} rows: the channel is dead, or it is the wrong one"


def _fields(data: Mapping[str, np.ndarray]) -> Iterator[str]:
    for sensor in columns.sensors_of(data, columns.MAG):
        name = columns.MAG.name(sensor=sensor)
        yield from _length(name, float(np.median(data[name])), "reads")
    for sensor in columns.sensors_of(data, columns.FLUX):
        names = [columns.FLUX.name(sensor=sensor, axis=axis) for axis in columns.AXES]
        if all(name in data for name in names):
            length = np.linalg.norm([data[name] for name in names], axis=0)
            yield from _length(f"flux_{sensor}_x_nt to _z_nt", float(np.median(length)), "have a length of")


def _length(what: str, found: float, verb: str) -> Iterator[str]:
    low, high = FIELD_NT
    if low <= found <= high:
        return
    fitting = [f"{unit} (scale = {size:g})" for unit, size in UNITS.items() if low <= found * size <= high]
    hint = f"; are they {' or '.join(fitting)}" if fitting else "; are they volts or counts, or is it the wrong column"
    yield (
        f"{what} {verb} {found:.4g} in the middle, and the Earth's field is {low:g} to {high:g} nT{hint}? "
        "A map file gives columns their scale and offset"
    )


def _angles(data: Mapping[str, np.ndarray]) -> Iterator[str]:
    roll, pitch, heading = (columns.INS_ATTITUDE.name(angle=angle) for angle in ("roll", "pitch", "heading"))
    if not all(name in data for name in (roll, pitch, heading)) or len(data[roll]) < FEWEST:
        return
    # Estimate: no aircraft flies for long within 6 degrees of north, with wings and nose within 1 degree.
    small = max(np.abs(data[roll]).max(), np.abs(data[pitch]).max()) <= 1.0
    if small and data[heading].max() <= MOST_RAD:
        yield (
            f"{roll}, {pitch} and {heading} stay below 1, 1 and {MOST_RAD:.2f}: are they radians? A map file gives "
            "columns their scale: 57.29577951308232"
        )

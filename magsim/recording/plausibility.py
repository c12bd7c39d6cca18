"""What is hardly meant in a recording: sensors that seldom read, interference of no aircraft, loads seldom on."""

import itertools
import math
from collections.abc import Iterator

import numpy as np

from magsim import columns
from magsim.recording.recording import Recording

LEAST_VALID = 0.8
"""Share of rows that a magnetometer reads. Estimate: one with dead zones of 15 deg, mounted as its maker asks, reads on
90 % of the rows of a calibration flight with turns (docs/instruments.md)."""

MOST_NT = 10_000.0
"""Interference of a survey aircraft, at most: twice the largest of the public SGL 2020 flights, 5000 nT between the
worst magnetometer of the cabin and the compensated one on the tail (sample file of MagNav.jl, our difference)."""

LEAST_NT = 0.01
"""Interference of a survey aircraft, at least. Estimate: a quarter of what good installations have left *after* their
compensation, 0.03 to 0.05 nT peak to peak (Scott Hogg & Associates)."""

LEAST_LENGTH = 0.5
"""Length of a fluxgate's reading over that of a scalar magnetometer, at least. Estimate: platforms add some 1000 nT."""

LEAST_TIMES_ON = 3
"""How often a load is on in training rows, at least. Estimate: one edge is explained as well by anything else."""

TILTS_DEG, TURNS_DEG = (0.0, 30.0, 45.0, 60.0, 90.0), range(0, 360, 45)
"""Directions of an optical axis that are tried: tilts from straight down, each to all sides."""


def warnings_of(recording: Recording) -> tuple[str, ...]:
    """Return what is hardly meant in a recording, one line each, with what would mend it.

    Parameters
    ----------
    recording : Recording
        What its columns and its ``meta`` do not tell is not judged.
    """
    return tuple(itertools.chain(unit_hints(recording), _dropouts(recording), _levels(recording), _loads(recording)))


def unit_hints(recording: Recording) -> Iterator[str]:
    """Yield what the lengths of fluxgate and scalar readings say about their units, one line each."""
    for fluxgate in recording.fluxgates if recording.scalars else ():
        scalar = recording.scalars[0]
        mag = columns.MAG.name(sensor=scalar)
        field_nt = float(np.median(np.abs(recording[mag])))
        names = [columns.FLUX.name(sensor=fluxgate, axis=axis) for axis in columns.AXES]
        if not field_nt or any(name not in recording for name in names):
            continue
        length = float(np.median(np.linalg.norm(recording.stack(names), axis=1)))
        if length > 0.0 and not LEAST_LENGTH <= length / field_nt <= 1.0 / LEAST_LENGTH:
            scale = 10.0 ** round(math.log10(field_nt / length))
            yield (
                f"the length of fluxgate {fluxgate} is {length:.0f} where {mag} is {field_nt:.0f}: another unit than "
                f"nT? scale = {scale:g} in the column map of magsim import would mend it"
            )


def _dropouts(recording: Recording) -> Iterator[str]:
    for sensor in recording.scalars:
        name = columns.MAG_VALID.name(sensor=sensor)
        if name not in recording:
            continue
        reads = recording[name] > 0.5
        late = len(reads) if not reads.any() else int(reads.argmax())
        if reads.mean() >= LEAST_VALID and not late:
            continue
        begins = f", the first {late} are 0 nT" if late else ""
        yield f"{sensor} reads on {100.0 * reads.mean():.0f} % of the rows{begins}{_mended(recording, sensor)}"


def _mended(recording: Recording, sensor: str) -> str:
    """Return what would make a magnetometer read more often, in words; empty where that is not known."""
    zones, field_b = _zones(recording, sensor), _field_b(recording, sensor)
    if zones is None or field_b is None:
        return ""
    polar, equator, axis_b, (least, most) = zones
    total = np.linalg.norm(field_b, axis=1)
    outside = 1.0 - np.mean((total >= least) & (total <= most))
    if outside > 1.0 - LEAST_VALID:
        return (
            f"; the field is {total.min():.0f} to {total.max():.0f} nT there, range_nt = [{least:g}, {most:g}] leaves "
            f"{100.0 * outside:.0f} % of the rows out; a wider range_nt, or another mount, would mend it"
        )

    def share(axis: np.ndarray) -> float:
        along = np.abs(field_b @ axis) / (total * np.linalg.norm(axis))
        good = (along < math.cos(math.radians(polar))) & (along > math.sin(math.radians(equator)))
        return float(np.mean(good))

    best = max(_directions(), key=share)
    if share(best) <= share(axis_b) + 0.02:
        return f"; its dead zones of {polar:g} and {equator:g} deg leave no axis_b that is better on these headings"
    text = ", ".join(f"{value:.2f}" for value in best + 0.0)
    better = f"axis_b = [{text}] would keep it out of them on {100.0 * share(best):.0f} % of the rows"
    return f"; the field is in its dead zones: {better} instead of {100.0 * share(axis_b):.0f} %"


def _directions() -> list[np.ndarray]:
    """Return the directions of an axis that are tried, each (3,), the simplest first."""
    out = []
    for tilt, turn in itertools.product(np.radians(TILTS_DEG), np.radians(TURNS_DEG)):
        out.append(np.array([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)]))
    return out


def _zones(recording: Recording, sensor: str) -> tuple[float, float, np.ndarray, tuple[float, float]] | None:
    """Return where a magnetometer does not read: from its axis and equator [deg], its axis, and its range [nT]."""
    table = recording.meta.get("dead_zones")
    zones = table.get(sensor) if isinstance(table, dict) else None
    if not isinstance(zones, dict):
        return None
    try:
        axis_b = np.array(zones["axis_b"], dtype=float)
        polar, equator = float(zones["polar_deg"]), float(zones["equator_deg"])
        least, most = (float(value) for value in zones.get("range_nt", (0.0, math.inf)))
    except (KeyError, TypeError, ValueError):
        return None  # a file from elsewhere
    return (polar, equator, axis_b, (least, most)) if axis_b.shape == (3,) and axis_b.any() else None


def _field_b(recording: Recording, sensor: str) -> np.ndarray | None:
    """Return the field at a magnetometer, (n, 3) [nT] body axes: its parts, else a fluxgate's readings; else None."""
    parts = columns.components_of(recording.data, sensor)
    if parts:
        names = [[columns.PART.name(component=c, sensor=sensor, axis=a) for a in columns.AXES] for c in parts]
        return np.sum([recording.stack(three) for three in names], axis=0)
    for fluxgate in recording.fluxgates:
        return recording.stack([columns.FLUX.name(sensor=fluxgate, axis=a) for a in columns.AXES])
    return None


def _levels(recording: Recording) -> Iterator[str]:
    for sensor in recording.scalars:
        name = columns.INTERFERENCE.name(sensor=sensor)
        if name not in recording:
            continue
        most = float(np.abs(recording[name]).max())
        if most > MOST_NT:
            yield (
                f"interference of {most:.0f} nT at {sensor}; survey aircraft have {MOST_NT:.0f} nT at most: is the "
                "mount where it should be, are moments in A m^2 and lengths in meters, is a part scaled?"
            )
        elif 0.0 < most < LEAST_NT:
            yield (
                f"interference of {most:.2g} nT at most at {sensor}; survey aircraft have more than {LEAST_NT:g} nT: "
                "is the mount where it should be, are lengths in meters, is a part scaled?"
            )


def _loads(recording: Recording) -> Iterator[str]:
    table = recording.meta.get("times_on")
    for feeder, times in table.items() if isinstance(table, dict) else ():
        if isinstance(times, int) and times < LEAST_TIMES_ON:
            yield (
                f"load {feeder} is on {_times(times)} in training rows, and cannot be learned from fewer than "
                f"{LEAST_TIMES_ON}; field.electronics.least_times_on = {LEAST_TIMES_ON} makes loads of kind duty cycle "
                "faster, [[flight.flaps]] moves flaps"
            )


def _times(count: int) -> str:
    return {0: "never", 1: "once", 2: "twice"}.get(count, f"{count} times")

"""Flying a logged track: no flight model, the motion of the file itself.

Cubic splines through the position and through the rotation to the Earth give the motion between the rows; velocity
and body rates are their derivatives, so that all of them belong to one motion.
"""

import math
from collections.abc import Iterator

import numpy as np
from scipy.interpolate import CubicSpline

from magsim.aircraft import Aircraft
from magsim.earth.wgs84 import radii_of_curvature, transport_rate
from magsim.errors import RequestError
from magsim.flight.model.rates import log_rate_hz
from magsim.frames import rot_nb_from_attitude, rotate_back
from magsim.scenario import Scenario, TrackLog, TrackPattern
from magsim.scenario.track import SURFACES
from magsim.terrain import Ground, TangentPlane
from magsim.trajectory import AttitudeCurve, Flight, Segment, Trajectory

LEAST_S = 10.0
"""Shortest recording of a track."""


def fly_track(
    scenario: Scenario, aircraft: Aircraft, track: TrackLog, ground: Ground | None, margins_s: tuple[float, float]
) -> Flight:
    """Fly a logged track.

    Parameters
    ----------
    scenario : Scenario
        With a ``Track`` as its pattern.
    aircraft : Aircraft
    track : TrackLog
    ground : Ground, optional
        Gives the geoid for heights above the sea.
    margins_s : (float, float)
        Time at the beginning and at the end of the file that is not recorded: the run-in of filters, and before that
        of a towed bird.

    Returns
    -------
    Flight
        Row 0 is the first margin after the file's first row.
    """
    before_s, after_s = margins_s
    pattern = scenario.pattern
    assert isinstance(pattern, TrackPattern)
    lat, lon = _position(scenario, track)
    alt = track["alt"] + (ground.geoid_m if pattern.heights == "sea" and ground is not None else 0.0)
    time = (track["time"] - track["time"][0]) - before_s
    place = CubicSpline(time, np.column_stack([lat, np.unwrap(lon), alt]))
    turning = AttitudeCurve(time, lat, lon, np.stack([track[name] for name in ("roll", "pitch", "heading")], axis=-1))
    settings, rate_hz = scenario.flight, scenario.recording.rate_hz
    log_hz = settings.log_hz or log_rate_hz(aircraft.facts, settings.step_hz)
    last = math.floor(time[-1] * log_hz + 1e-9)
    grid = np.arange(-round(before_s * log_hz), last + 1) / log_hz
    carrier = _trajectory(place(grid), place(grid, 1), turning, grid, aircraft.facts.cg_b)
    duration = math.floor((last / log_hz - after_s) * rate_hz + 1e-9) / rate_hz
    if duration < LEAST_S and scenario.tow is not None:
        spare = time[-1] - after_s - LEAST_S + scenario.tow.settle_s
        msg = (
            f"tow.settle_s: the track lasts {time[-1] + before_s:.0f} s, which leaves {max(duration, 0.0):.0f} s of "
            f"rows after a bird has settled for {scenario.tow.settle_s:g} s; allowed: up to "
            f"{math.floor(max(0.0, spare))} s"
        )
        raise RequestError(msg)
    surfaces = {name: track[name] for name in SURFACES if name in track}
    controls = {name: CubicSpline(time, value)(grid) for name, value in surfaces.items()}
    return Flight(
        carrier=carrier,
        duration_s=duration,
        simulation_rate_hz=float(scenario.flight.step_hz),
        controls=controls,
        segments=tuple(_segments(track, time, duration, carrier)),
        maneuvers=(),
        notes={
            "track_sha256": track.digest,
            "track_rows": len(track),
            "track_median_step_s": float(np.median(np.diff(track["time"]))),
            "track_longest_step_s": float(np.max(np.diff(track["time"]))),
            "heights": pattern.heights,
            "log_hz": log_hz,
        },
    )


def _position(scenario: Scenario, track: TrackLog) -> tuple[np.ndarray, np.ndarray]:
    """Return latitude and longitude [rad]; local meters are in the plane that touches the start point's height."""
    if "lat" in track:
        return track["lat"], track["lon"]
    start = scenario.start
    plane = TangentPlane(math.radians(start.lat_deg), math.radians(start.lon_deg), start.alt_m)
    return plane.geodetic(track["north"], track["east"])


def _trajectory(
    place: np.ndarray, change: np.ndarray, turning: AttitudeCurve, time_s: np.ndarray, cg_b: tuple[float, ...]
) -> Trajectory:
    """Build the motion from latitude, longitude, height, their derivatives, (n, 3) each, and the attitude curve."""
    lat, lon, alt = place.T
    meridian, normal = radii_of_curvature(lat)
    velocity_n = np.stack(
        [change[:, 0] * (meridian + alt), change[:, 1] * (normal + alt) * np.cos(lat), -change[:, 2]], axis=-1
    )
    attitude, rate_eb_b = turning.at(time_s, lat, lon)
    return Trajectory(
        time_s=time_s,
        lat_rad=lat,
        lon_rad=lon,
        alt_m=alt,
        velocity_n=velocity_n,
        attitude=attitude,
        rate_b=rate_eb_b - rotate_back(rot_nb_from_attitude(attitude), transport_rate(lat, alt, velocity_n)),
        reference_b=np.array(cg_b),
    )


def _segments(track: TrackLog, time: np.ndarray, duration: float, carrier: Trajectory) -> Iterator[Segment]:
    """Yield runs of equal labels, or one leg without labels. A label holds from its row to the next."""
    ones = np.ones(len(time))
    given = {"circuit": ones, "leg": ones, "turn": 0.0 * ones} | {
        name: track[name] for name in ("circuit", "leg", "turn") if name in track
    }
    table = np.column_stack([given[name] for name in ("circuit", "leg", "turn")])
    changes = np.flatnonzero(np.any(np.diff(table, axis=0) != 0.0, axis=1)) + 1
    starts = [0, *changes.tolist()]
    bounds = [*time[starts].tolist(), time[-1]]
    speed = np.hypot(carrier.velocity_n[:, 0], carrier.velocity_n[:, 1])
    step = 1.0 / carrier.rate_hz
    for k, row in enumerate(starts):
        start, stop = max(0.0, bounds[k]), min(duration, bounds[k + 1])
        if stop <= start:
            continue
        rows = (carrier.time_s >= start) & (carrier.time_s < stop)
        north, east = carrier.velocity_n[rows, 0].sum(), carrier.velocity_n[rows, 1].sum()
        circuit, leg, turn = (int(v) for v in table[row])
        heading = math.degrees(math.atan2(east, north)) % 360.0
        length = float(speed[rows].sum()) * step
        yield Segment(circuit, leg, bool(turn), heading, start_s=start, stop_s=stop, length_m=length)

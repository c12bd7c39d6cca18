"""Flying a logged track: no flight model, the motion of the file itself.

Cubic splines through position and attitude give the motion between the rows; velocity and body rates are their
derivatives, so that all of them belong to one motion.
"""

import math
from collections.abc import Iterator

import numpy as np
from scipy.interpolate import CubicSpline

from magsim.aircraft import Aircraft
from magsim.earth import radii_of_curvature
from magsim.scenario import Scenario, TrackLog
from magsim.scenario.track import SURFACES
from magsim.terrain import Ground, TangentPlane
from magsim.trajectory import Flight, Segment, Trajectory


def fly_track(
    scenario: Scenario, aircraft: Aircraft, track: TrackLog, ground: Ground | None, margin_s: float
) -> Flight:
    """The flight of a logged track.

    Parameters
    ----------
    scenario : Scenario
        With a ``Track`` as its pattern.
    aircraft : Aircraft
    track : TrackLog
    ground : Ground, optional
        Gives the geoid for heights above the sea.
    margin_s : float
        Time at both ends of the file that is not recorded: the run-in of filters.

    Returns
    -------
    Flight
        Row 0 is ``margin_s`` after the file's first row.
    """
    pattern = scenario.pattern
    lat, lon = _position(scenario, track)
    alt = track["alt"] + (ground.geoid_m if pattern.heights == "sea" and ground is not None else 0.0)
    time = (track["time"] - track["time"][0]) - margin_s
    attitude = np.stack([np.unwrap(track[name]) for name in ("roll", "pitch", "heading")], axis=-1)
    motion = CubicSpline(time, np.column_stack([lat, np.unwrap(lon), alt, attitude]))
    log_hz, rate_hz = scenario.flight.log_hz, scenario.recording.rate_hz
    last = math.floor(time[-1] * log_hz + 1e-9)
    grid = np.arange(-round(margin_s * log_hz), last + 1) / log_hz
    carrier = _trajectory(motion(grid), motion(grid, 1), grid, aircraft.facts.cg_b)
    duration = math.floor((last / log_hz - margin_s) * rate_hz + 1e-9) / rate_hz
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
    """Latitude and longitude [rad]; local meters lie in the plane that touches the start point's height there."""
    if "lat" in track:
        return track["lat"], track["lon"]
    start = scenario.start
    plane = TangentPlane(math.radians(start.lat_deg), math.radians(start.lon_deg), start.alt_m)
    return plane.geodetic(track["north"], track["east"])


def _trajectory(place: np.ndarray, rate: np.ndarray, time_s: np.ndarray, cg_b: tuple[float, ...]) -> Trajectory:
    """Motion from latitude, longitude, height, roll, pitch, heading and their time derivatives, (n, 6) each."""
    lat, lon, alt, roll, pitch, _ = place.T
    meridian, normal = radii_of_curvature(lat)
    velocity_n = np.stack(
        [rate[:, 0] * (meridian + alt), rate[:, 1] * (normal + alt) * np.cos(lat), -rate[:, 2]], axis=-1
    )
    return Trajectory(
        time_s=time_s,
        lat_rad=lat,
        lon_rad=lon,
        alt_m=alt,
        velocity_n=velocity_n,
        attitude=place[:, 3:],
        rate_b=body_rates(roll, pitch, rate[:, 3:]),
        reference_b=np.array(cg_b),
    )


def body_rates(roll: np.ndarray, pitch: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Body rates from the rates of roll, pitch and heading (Stevens, Lewis, Johnson, Aircraft Control, eq. 1.4-3).

    Parameters
    ----------
    roll, pitch : (n,) [rad]
    rate : (n, 3) [rad/s]

    Returns
    -------
    (n, 3) [rad/s]
    """
    rolling, pitching, turning = rate.T
    p = rolling - np.sin(pitch) * turning
    q = np.cos(roll) * pitching + np.sin(roll) * np.cos(pitch) * turning
    r = -np.sin(roll) * pitching + np.cos(roll) * np.cos(pitch) * turning
    return np.stack([p, q, r], axis=-1)


def _segments(track: TrackLog, time: np.ndarray, duration: float, carrier: Trajectory) -> Iterator[Segment]:
    """Runs of equal labels; one leg without labels. A label holds from its row to the next."""
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

"""Synthetic Tolles-Lawson recordings for the tests, from plain numpy and nothing of the simulator.

A constant-speed flight of square circuits with pitch, roll and yaw maneuvers on each leg, and an aircraft that is
exactly a permanent vector, an induced matrix and an eddy matrix, of the size that paper 000 prints for its simulated
data set: some hundred nT broadband, about 10 nT in band.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from magsim.frames import rot_nb_from_attitude, rotate_back
from magsim.recording import Recording
from magsim.streams import stream

PERMANENT_NT = np.array([-60.0, 45.0, 90.0])
INDUCED = np.array([[9.0, -1.5, 2.5], [-0.8, -6.0, 1.2], [1.9, 0.9, 5.0]]) * 1e-3
EDDY_S = np.array([[1.2, -0.4, 0.6], [0.3, 1.9, -0.5], [-0.5, 0.4, 1.5]]) * 1e-3

FIELD_NT = 45000.0
INCLINATION, DECLINATION = np.radians([20.0, -1.5])
SPEED_MPS, ALTITUDE_M = 75.0, 3000.0
LAT_DEG, LON_DEG = 16.7, 112.7
EARTH_M = 6.371e6
LEG_S, TURN_S, LEAD_S = 133.0, 27.0, 10.0
FINE = 10
"""Steps of the field in one row."""


@dataclass(frozen=True)
class World:
    """Which physics and instruments a synthetic recording has.

    ``vector`` takes the norm of the vector sum, else the interference is its projection on the direction of the
    background and the fluxgate sees the background alone, so that the scalar is exactly linear in the T-L terms.
    """

    vector: bool = True
    scale: float = 1.0
    mag_noise_nt: float = 0.01
    flux_noise_nt: float = 0.1
    attitude_noise_deg: float = 0.0
    eddy_tau_s: float = 0.0
    gradient: bool = True
    circuits: int = 2
    rate_hz: float = 10.0
    permanent_nt: tuple[float, ...] = tuple(PERMANENT_NT)
    induced: tuple[tuple[float, ...], ...] = tuple(map(tuple, INDUCED))
    eddy_s: tuple[tuple[float, ...], ...] = tuple(map(tuple, EDDY_S))


EXACT = World(vector=False, mag_noise_nt=0.0, flux_noise_nt=0.0, gradient=False)
"""Linear in the T-L terms, no noise."""

VECTOR = World(gradient=False)
"""The vector sum with white noise in a uniform background."""


def _maneuvers(time_s: NDArray, seed: int) -> tuple[NDArray, NDArray]:
    """Attitude from maneuvers (n, 3) [deg] and the segment columns (n, 7)."""
    rng = stream(seed, "world/maneuvers")
    leg_number = np.floor(time_s / (LEG_S + TURN_S)).astype(int)
    inside = time_s - leg_number * (LEG_S + TURN_S)
    attitude = np.zeros((len(time_s), 3))
    maneuver, cycle = np.zeros(len(time_s)), np.zeros(len(time_s))
    for leg in range(leg_number.max() + 1):
        start = leg * (LEG_S + TURN_S) + LEAD_S
        for kind, axis in ((1, 1), (2, 0), (3, 2)):
            period, cycles = rng.uniform(6.0, 9.0), 4
            amplitude = rng.uniform(8.0, 15.0) if axis == 0 else rng.uniform(5.0, 8.0)
            into = time_s - start
            span = period * cycles
            rows = (into >= 0.0) & (into < span)
            envelope = np.clip(np.minimum(into, span - into) / (0.5 * period), 0.0, 1.0)
            envelope = envelope**2 * (3.0 - 2.0 * envelope)
            wave = np.where(rows, amplitude * envelope * np.sin(2.0 * np.pi * into / period), 0.0)
            attitude[:, axis] += wave
            if axis == 2:
                attitude[:, 0] += 0.35 * wave
            maneuver[rows], cycle[rows] = kind, np.floor(into[rows] / period) + 1
            start += span + 4.0
    circuit, leg = leg_number // 4 + 1, leg_number % 4 + 1
    turn = (inside >= LEG_S).astype(float)
    split = np.where(circuit > 1, 2, np.where(leg == 4, 1, 0))
    segments = np.column_stack([circuit, leg, turn, 90.0 * (leg - 1), maneuver, cycle, split])
    return attitude, segments


def _flight(time_s: NDArray, seed: int) -> tuple[NDArray, NDArray, NDArray]:
    """Attitude (n, 3) [rad], position north-east-down (n, 3) [m] and the segment columns (n, 7)."""
    attitude, segments = _maneuvers(time_s, seed)
    legs = np.arange(np.ceil(time_s[-1] / (LEG_S + TURN_S)) + 1)
    into_turn = np.clip((time_s[:, None] - legs * (LEG_S + TURN_S) - LEG_S) / TURN_S, 0.0, 1.0)
    course = np.radians(90.0) * (into_turn**3 * (10.0 - 15.0 * into_turn + 6.0 * into_turn**2)).sum(axis=1)
    bank = 22.0 * (16.0 * into_turn**2 * (1.0 - into_turn) ** 2).sum(axis=1)

    rng = stream(seed, "world/turbulence")
    frequency = rng.uniform(0.02, 0.8, (3, 60))
    phase = rng.uniform(0.0, 2.0 * np.pi, (3, 60))
    for axis, rms in enumerate((0.5, 0.3, 0.3)):
        waves = np.sin(2.0 * np.pi * frequency[axis] * time_s[:, None] + phase[axis])
        attitude[:, axis] += rms * np.sqrt(2.0 / 60.0) * waves.sum(axis=1)
    attitude[:, 0] += bank
    attitude[:, 1] += 2.0

    step = time_s[1] - time_s[0]
    climb = SPEED_MPS * np.sin(np.radians(attitude[:, 1] - 2.0))
    velocity = np.column_stack([SPEED_MPS * np.cos(course), SPEED_MPS * np.sin(course), -climb])
    position = np.cumsum(velocity, axis=0) * step
    angles = np.radians(attitude)
    angles[:, 2] += course
    return angles, position, segments


def _lagged(signal: NDArray, step_s: float, tau_s: float) -> NDArray:
    """First-order low-pass, exact for a signal that is straight between its samples."""
    decay = np.exp(-step_s / tau_s)
    slope = tau_s * (1.0 - decay) / step_s
    out = np.empty_like(signal)
    out[0] = signal[0]
    for i in range(1, len(signal)):
        out[i] = decay * out[i - 1] + (slope - decay) * signal[i - 1] + (1.0 - slope) * signal[i]
    return out


@cache
def calibration(world: World = VECTOR, seed: int = 0, name: str = "world", sensor: str = "cabin") -> Recording:
    """Square circuits with a scalar magnetometer and a fluxgate at one place of the aircraft."""
    count = round(world.circuits * 4 * (LEG_S + TURN_S) * world.rate_hz)
    fine_s = np.arange(count * FINE) / (world.rate_hz * FINE)
    attitude, position, segments = _flight(fine_s, seed)

    direction_n = np.array(
        [
            np.cos(INCLINATION) * np.cos(DECLINATION),
            np.cos(INCLINATION) * np.sin(DECLINATION),
            np.sin(INCLINATION),
        ]
    )
    strength = np.full(len(fine_s), FIELD_NT)
    if world.gradient:
        strength = strength + position @ np.array([3.0e-3, -0.5e-3, 0.02])
    earth = rotate_back(rot_nb_from_attitude(attitude), strength[:, None] * direction_n)
    rate = CubicSpline(fine_s, earth)(fine_s, 1)
    if world.eddy_tau_s > 0.0:
        rate = _lagged(rate, fine_s[1], world.eddy_tau_s)

    keep = slice(None, None, FINE)
    time_s, attitude, position, segments = fine_s[keep], attitude[keep], position[keep], segments[keep]
    earth, rate = earth[keep], rate[keep]
    parts = {
        "earth": earth,
        "permanent": np.tile(world.scale * np.array(world.permanent_nt), (count, 1)),
        "induced": world.scale * earth @ np.array(world.induced).T,
        "eddy": world.scale * rate @ np.array(world.eddy_s).T,
    }
    own = sum(parts[part] for part in ("permanent", "induced", "eddy"))
    clean = np.linalg.norm(earth, axis=1)
    projection = np.einsum("ni,ni->n", own, earth) / clean
    total = np.linalg.norm(earth + own, axis=1) if world.vector else clean + projection
    flux = earth + own if world.vector else earth
    flux = flux + world.flux_noise_nt * stream(seed, "world/flux").standard_normal((count, 3))
    error = world.mag_noise_nt * stream(seed, "world/mag").standard_normal(count)
    angle_noise = world.attitude_noise_deg * stream(seed, "world/ins").standard_normal((count, 3))
    angles = np.degrees(attitude) + angle_noise

    axes = "xyz"
    data = {f"mag_{sensor}_nt": total + error}
    data |= {f"flux_{sensor}_{axis}_nt": flux[:, i] for i, axis in enumerate(axes)}
    data |= {"ins_roll_deg": angles[:, 0], "ins_pitch_deg": angles[:, 1], "ins_heading_deg": angles[:, 2] % 360.0}
    data |= {"ins_lat_deg": LAT_DEG + np.degrees(position[:, 0] / EARTH_M)}
    data |= {"ins_lon_deg": LON_DEG + np.degrees(position[:, 1] / (EARTH_M * np.cos(np.radians(LAT_DEG))))}
    data |= {"ins_alt_m": ALTITUDE_M - position[:, 2]}
    data |= {f"interference_{sensor}_nt": total - clean, f"projection_{sensor}_nt": projection}
    data |= {f"clean_{sensor}_nt": clean, f"total_{sensor}_nt": total, f"error_{sensor}_nt": error}
    data |= {f"{part}_{sensor}_{axis}_nt": v[:, i] for part, v in parts.items() for i, axis in enumerate(axes)}
    labels = ("circuit", "leg", "turn", "leg_heading_deg", "maneuver", "cycle", "split")
    data |= {label: segments[:, i] for i, label in enumerate(labels)}
    return Recording(name, time_s, data, {"start_utc": "2025-03-13T00:00:00Z", "seed": seed, "digest": "none"})


def parts(recording: Recording) -> tuple[Recording, Recording, Recording]:
    """Training, validation and test rows: the first two as a method gets them to learn, the last with everything."""
    train, valid, test = (recording.where(split=split) for split in ("train", "valid", "test"))
    return train.labeled(), valid.labeled(), test

"""A small calibration flight for checks, from closed forms: every input family, labels, and an aircraft that is known.

Two circuits of four legs with pitch, roll and yaw maneuvers, over the model of the main field. The aircraft is a
permanent vector, an induced and an eddy matrix, a strobe and an elevator; the cabin's fluxgate stands in a field of its
own. Sizes are estimates: some hundred nT, some ten of them in band.
"""

from datetime import datetime
from functools import cache

import numpy as np

from magsim import columns
from magsim.earth import decimal_years, igrf
from magsim.frames import rot_nb_from_attitude, rotate_back
from magsim.recording import Recording
from magsim.signals import spline_derivative
from magsim.streams import stream

RATE_HZ = 10.0
LEG_S, TURN_S, LEGS = 70.0, 12.0, 8
SPEED_MPS, ALT_M, LAT_DEG, LON_DEG = 70.0, 1200.0, 45.3, -75.7
NOSE_UP = 0.03
"""Pitch of level flight [rad]."""

METERS_A_DEG = 111_200.0
GUSTS_HZ = (0.13, 0.21, 0.34, 0.47)
START_UTC = "2026-05-04T14:00:00+00:00"

PERMANENT_NT = np.array([-150.0, 60.0, 210.0])
INDUCED = np.array([[5.0, -1.0, 1.5], [-0.5, -4.0, 1.0], [1.2, 0.7, 3.0]]) * 1e-3
EDDY_S = np.array([[0.6, -0.2, 0.3], [0.1, 0.9, -0.3], [-0.2, 0.2, 0.7]]) * 1e-3
STROBE_NT_A = np.array([0.05, -0.02, 0.08])
ELEVATOR_NT_DEG = np.array([0.03, 0.01, -0.05])
SHARES = {"cabin": 1.0, "stinger": 0.02, "flux": 0.6}
"""Sizes of the aircraft's field at the two magnetometers and at the fluxgate."""


@cache
def check_flight(seed: int = 0) -> Recording:
    """Return the flight of a seed, 656 s at 10 rows a second; the first circuit is for training, the second for tests.

    Its magnetometers are ``cabin`` and ``stinger``, its fluxgate ``flux``.
    """
    random = stream(seed, "check/flight")
    count = round(LEGS * (LEG_S + TURN_S) * RATE_HZ)
    time_s = np.arange(count) / RATE_HZ
    attitude, segments = _attitude(time_s, random)
    climb = np.gradient(30.0 * np.sin(2.0 * np.pi * time_s / 47.0), time_s) + SPEED_MPS * np.sin(
        attitude[:, 1] - NOSE_UP
    )
    velocity = np.column_stack([SPEED_MPS * np.cos(attitude[:, 2]), SPEED_MPS * np.sin(attitude[:, 2]), -climb])
    place = np.cumsum(velocity, axis=0) / RATE_HZ
    lat = LAT_DEG + place[:, 0] / METERS_A_DEG
    lon = LON_DEG + place[:, 1] / (METERS_A_DEG * np.cos(np.radians(LAT_DEG)))
    alt = ALT_M - place[:, 2]
    years = decimal_years(datetime.fromisoformat(START_UTC), time_s)
    earth_b = rotate_back(rot_nb_from_attitude(attitude), igrf(np.radians(lat), np.radians(lon), alt, years))
    strobe = 2.0 + 3.0 * (np.mod(time_s, 7.3) < 1.1)
    elevator = -2.0 + np.degrees(0.6 * attitude[:, 1])
    own = PERMANENT_NT + earth_b @ INDUCED.T + spline_derivative(earth_b, RATE_HZ) @ EDDY_S.T
    own = own + np.outer(strobe, STROBE_NT_A) + np.outer(elevator, ELEVATOR_NT_DEG)
    clean = np.linalg.norm(earth_b, axis=1)
    data: dict[str, np.ndarray] = {}
    for sensor in ("cabin", "stinger"):
        total = np.linalg.norm(earth_b + SHARES[sensor] * own, axis=1)
        data[columns.MAG.name(sensor=sensor)] = total + 0.01 * random.standard_normal(count)
        data[columns.MAG_VALID.name(sensor=sensor)] = np.ones(count)
        data[columns.INTERFERENCE.name(sensor=sensor)] = total - clean
        data[columns.CLEAN.name(sensor=sensor)] = clean
    flux = earth_b + SHARES["flux"] * own + 0.3 * random.standard_normal((count, 3))
    data |= {columns.FLUX.name(sensor="flux", axis=axis): flux[:, i] for i, axis in enumerate(columns.AXES)}
    angles = np.degrees(attitude) + 0.01 * random.standard_normal((count, 3))
    angles[:, 2] %= 360.0
    ins = (*angles.T, lat, lon)
    data |= {columns.INS_ATTITUDE.name(angle=a): v for a, v in zip(columns.INS_ANGLES, ins, strict=True)}
    data |= {columns.INS_VELOCITY.name(direction=d): velocity[:, i] for i, d in enumerate(columns.DIRECTIONS)}
    rates = np.degrees(np.gradient(np.unwrap(attitude, axis=0), 1.0 / RATE_HZ, axis=0))
    force = np.column_stack([9.8 * np.sin(attitude[:, 1]), np.zeros(count), -9.8 / np.cos(attitude[:, 0])])
    for i, axis in enumerate(columns.AXES):
        data[columns.INS_RATE.name(axis=axis)] = rates[:, i]
        data[columns.INS_ACCELERATION.name(axis=axis)] = force[:, i]
    data |= {
        columns.INS_ALTITUDE.pattern: alt,
        columns.BARO_ALTITUDE.pattern: alt + 32.0,
        columns.BARO_PRESSURE.pattern: 101_325.0 * (1.0 - 2.25577e-5 * (alt + 32.0)) ** 5.25588,
        columns.RADAR.pattern: alt - 90.0,
        columns.BASE.name(sensor="base"): 53_000.0 + 2.0 * np.sin(time_s / 300.0),
        columns.CURRENT.name(feeder="strobe"): strobe,
        columns.VOLTAGE.name(bus="main"): 28.2 - 0.02 * strobe,
        columns.SURFACE.name(surface="elevator"): elevator,
    }
    names = (columns.CIRCUIT, columns.LEG, columns.TURN, columns.LEG_HEADING, columns.MANEUVER, columns.SPLIT)
    data |= {family.pattern: segments[:, i] for i, family in enumerate(names)}
    return Recording(f"check_{seed}", time_s, data, {"start_utc": START_UTC, "rate_hz": RATE_HZ})


def _attitude(time_s: np.ndarray, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return attitude (n, 3) [rad] and segment columns (n, 6)."""
    number = np.floor(time_s / (LEG_S + TURN_S))
    into = time_s - number * (LEG_S + TURN_S)
    turn = np.clip((into - LEG_S) / TURN_S, 0.0, 1.0)
    smooth = turn**3 * (10.0 - 15.0 * turn + 6.0 * turn**2)
    attitude = np.column_stack([0.35 * np.sin(np.pi * turn) ** 2, np.full(len(time_s), NOSE_UP), np.zeros(len(time_s))])
    maneuver = np.zeros(len(time_s))
    for leg in range(LEGS):
        begin = leg * (LEG_S + TURN_S) + 4.0
        for code, axis in ((1, 1), (2, 0), (3, 2)):
            period, size = random.uniform(5.0, 6.5), np.radians(random.uniform(8.0, 14.0) if axis == 0 else 5.0)
            within = time_s - begin
            rows = (within >= 0.0) & (within < 3.0 * period)
            ease = np.sin(np.pi * np.clip(within / (3.0 * period), 0.0, 1.0)) ** 2
            attitude[:, axis] += np.where(rows, size * ease * np.sin(2.0 * np.pi * within / period), 0.0)
            maneuver[rows] = code
            begin += 3.0 * period + 2.0
    phases = random.random((3, 4))
    waves = [[np.sin(2.0 * np.pi * (f * time_s + p)) for f, p in zip(GUSTS_HZ, of, strict=True)] for of in phases]
    attitude = attitude + np.radians(0.15) * np.array(waves).sum(axis=1).T
    attitude[:, 2] += 0.5 * np.pi * (number + smooth)
    circuit, flown = number // 4 + 1, number % 4 + 1
    split = np.where(circuit > 1, 2.0, np.where(flown == 4, 1.0, 0.0))
    return attitude, np.column_stack([circuit, flown, turn > 0.0, 90.0 * (flown - 1), maneuver, split])

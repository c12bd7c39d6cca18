"""Spectra of a helicopter's roll and heading on a line, from published derivatives: what sway is measured by.

A CH-53D of 15.9 t at 60 kn (NASA CR-3144, Heffley et al. 1979; its table was read in a public flight model that copies
it: normalized by mass and inertia, SI, controls in inches) in the side and roll gusts of MIL-F-8785C, under a pilot by
the crossover model (McRuer and Krendel, AGARDograph 188, 1974): cyclic closes the roll attitude, the bank closes the
distance to the line, pedals coordinate the turns. Loop frequencies, delay and what hands add by themselves are
estimates. No spectrum of a helicopter on a survey line was found to read.
"""

import itertools
from typing import NamedTuple

import numpy as np

from magsim.units import G0

SPEED_MPS = 60.0 * 0.514444
SIDE = {"v": -0.102, "p": -0.778, "r": 0.4958, "cyclic": 0.1035, "pedals": 0.1475}
ROLL = {"v": -0.0564, "p": -1.58, "r": 0.293, "cyclic": 0.194, "pedals": 0.0943}
YAW = {"v": 0.0268, "p": -0.0826, "r": -0.561, "cyclic": 0.0118, "pedals": -0.1421}
"""Accelerations [m/s^2, rad/s^2] for a unit of side velocity, rates and controls."""

DELAY_S, ATTITUDE_RADPS, LINE_RADPS, LINE_DAMPING = 0.25, 2.0, 0.3, 0.9
"""Of the pilot: reaction, crossover of the roll loop, and the loop that returns to the line (estimates)."""

GUST_LENGTH_M, ROTOR_M = 300.0, 22.0
"""Scale of the gusts at 100 m above ground (MIL-F-8785C: 260 m), and the diameter that averages them."""

FREQUENCIES_HZ = np.geomspace(0.003, 3.0, 1500)
BAND_HZ = (0.05, 0.3)
"""Where most of the roll's power is."""


class Pilot(NamedTuple):
    """How turns are coordinated [1/s], and what hands and feet add by themselves [in/sqrt(Hz), below 0.5 Hz]."""

    pedals: float
    cyclic_noise: float
    pedal_noise: float


PILOTS = tuple(Pilot(k, *noise) for k, noise in itertools.product((0.0, 0.3, 0.6), ((0.0, 0.0), (0.5, 0.3))))


class Line(NamedTuple):
    """What a flight on a line shows: rms of departure, roll, roll rate and heading, how roll and heading cohere.

    ``roll_power`` is the power density of the roll at ``FREQUENCIES_HZ`` [deg^2/Hz].
    """

    departure_m: float
    roll_deg: float
    roll_rate_dps: float
    heading_deg: float
    coherence: float
    roll_power: np.ndarray


def on_a_line(gust_mps: float, pilot: Pilot) -> Line:
    """Solve the closed loops for gusts of a standard deviation."""
    # v, p, roll, r, heading, departure; the departure grows with the side velocity over ground
    free = np.zeros((6, 6))
    for row, name in ((0, SIDE), (1, ROLL), (3, YAW)):
        free[row, [0, 1, 3]] = name["v"], name["p"], name["r"]
    free[0, 2], free[0, 3] = G0, SIDE["r"] - SPEED_MPS
    free[2, 1] = free[4, 3] = free[5, 0] = 1.0
    free[5, 4] = SPEED_MPS
    cyclic, pedals, v_gust, p_gust = (
        np.array([SIDE[key], ROLL[key], 0.0, YAW[key], 0.0, 0.0]) for key in ("cyclic", "pedals", "v", "p")
    )
    omega = 2.0 * np.pi * FREQUENCIES_HZ
    moved = np.empty((len(omega), 6, 4), dtype=complex)
    for k, s in enumerate(1j * omega):
        late = np.exp(-DELAY_S * s)
        # lead at the roll mode: with it the roll loop is a crossover over s
        gain = ATTITUDE_RADPS / ROLL["cyclic"] * (s - ROLL["p"]) / (1.0 + s / 10.0) * late
        back = 2.0 * LINE_DAMPING * LINE_RADPS / G0
        hands = -gain * np.array([back, 0.0, 1.0, 0.0, back * SPEED_MPS, LINE_RADPS**2 / G0])
        feet = -pilot.pedals / YAW["pedals"] * late * np.array([0.0, 0.0, -G0 / SPEED_MPS, 1.0, 0.0, 0.0])
        closed = s * np.eye(6) - free - np.outer(cyclic, hands) - np.outer(pedals, feet)
        moved[k] = np.linalg.solve(closed, np.column_stack([-v_gust, -p_gust, cyclic * late, pedals * late]))
    powers = _inputs(gust_mps, pilot, omega)

    def power(i: int, j: int) -> np.ndarray:
        return np.einsum("nk,nk,kn->n", moved[:, i], moved[:, j].conj(), powers)

    rms = [float(np.sqrt(np.trapezoid(power(i, i).real, FREQUENCIES_HZ))) for i in (5, 2, 1, 4)]
    roll, heading = power(2, 2).real, power(4, 4).real
    coherence = weighted(FREQUENCIES_HZ, np.abs(power(2, 4)) ** 2 / (roll * heading), roll)
    return Line(rms[0], *np.degrees(rms[1:]).tolist(), coherence, np.degrees(1.0) ** 2 * roll)


def weighted(at_hz: np.ndarray, coherence: np.ndarray, power: np.ndarray) -> float:
    """Mean of a coherence over the band, weighted by the roll's power."""
    inside = (at_hz > BAND_HZ[0]) & (at_hz < BAND_HZ[1])
    at, weight = at_hz[inside], power[inside]
    return float(np.trapezoid(coherence[inside] * weight, at) / np.trapezoid(weight, at))


def _inputs(gust_mps: float, pilot: Pilot, omega: np.ndarray) -> np.ndarray:
    """Return one-sided power densities of side gust, roll gust, hands and feet, (4, n)."""
    reduced = GUST_LENGTH_M * omega / SPEED_MPS
    side = 2.0 * gust_mps**2 * GUST_LENGTH_M / SPEED_MPS * (1.0 + 3.0 * reduced**2) / (1.0 + reduced**2) ** 2
    wide = 4.0 * ROTOR_M / np.pi
    roll = 1.6 * np.pi * gust_mps**2 / (SPEED_MPS * GUST_LENGTH_M) * np.cbrt(GUST_LENGTH_M / wide)
    roll = roll / (1.0 + (wide * omega / SPEED_MPS) ** 2)
    shape = 1.0 / (1.0 + (FREQUENCIES_HZ / 0.5) ** 2)
    return np.array([side, roll, pilot.cyclic_noise**2 * shape, pilot.pedal_noise**2 * shape])

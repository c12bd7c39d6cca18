"""Coefficients of a propeller by blade element theory with Goldstein's and Betz's condition.

Each blade element meets the flight speed and its own rotation; the induced velocity stands perpendicular to the
resulting flow, as behind a lightly loaded propeller, and follows from the element's lift and Prandtl's tip loss
(McCormick, Aerodynamics, Aeronautics, and Flight Mechanics, ch. 6)::

    tan(a_i) 4 F sin(phi) = s c_l(b - phi),   phi = phi_0 + a_i,   s = B c / (2 pi r)

With J = V/(n D), C_T = T/(rho n^2 D^4), C_P = P/(rho n^3 D^5); n in revolutions per second.
"""

import math
from functools import lru_cache

import numpy as np

from magsim.aircraft.engine import Propeller

STATIONS = 24
"""Blade elements from hub to tip."""

STEPS = 60
"""Bisections of the induced angle: far below a double's resolution."""

PITCH_DEG = tuple(range(0, 91, 5))
"""Blade angles of the tables, at three quarters of the radius."""

ADVANCE = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4, 1.6, 1.8, 2.0, 2.5, 3.0, 4.0)
"""Advance ratios of the tables."""


def coefficients(propeller: Propeller, advance: np.ndarray, pitch: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return thrust and power coefficient.

    Parameters
    ----------
    propeller : Propeller
    advance : (m,)
        Advance ratios J, not negative.
    pitch : (m,) [rad]
        Blade angle at three quarters of the radius, from the chord line.

    Returns
    -------
    thrust, power : (m,)
        C_T and C_P.
    """
    hub = propeller.hub_radius_fraction.value
    # The elements lie at the middles of equal parts of the blade; lengths are in diameters, n = 1, rho = 1.
    part = hub + (1.0 - hub) * (np.arange(STATIONS) + 0.5) / STATIONS
    radius, width = 0.5 * part, 0.5 * (1.0 - hub) / STATIONS
    chord = 0.5 * np.interp(part, propeller.chord.at, propeller.chord.value)
    solidity = propeller.blades.value * chord / (2.0 * math.pi * radius)
    twist = propeller.twist_advance_ratio.value / math.pi
    angle = np.asarray(pitch, dtype=float)[:, None] + np.arctan(twist / part) - math.atan(twist / 0.75)
    angle = angle - propeller.zero_lift_angle.value

    ahead, around = np.asarray(advance, dtype=float)[:, None], 2.0 * math.pi * radius[None, :]
    inflow = np.arctan2(ahead, around)
    low = np.broadcast_to(-inflow, angle.shape) + 1e-9
    high = np.maximum(angle - inflow, 0.0) + 1e-9
    for _ in range(STEPS):
        middle = 0.5 * (low + high)
        flow = inflow + middle
        balance = np.tan(middle) * 4.0 * _tip_loss(propeller, part, flow) * np.sin(flow)
        above = balance > solidity * _lift(propeller, angle - flow)
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    induced = 0.5 * (low + high)
    flow = inflow + induced
    lift = _lift(propeller, angle - flow)
    drag = _drag(propeller, lift, angle - flow)
    pressure = 0.5 * (ahead**2 + around**2) * np.cos(induced) ** 2 * propeller.blades.value * chord * width
    thrust = np.einsum("ij->i", pressure * (lift * np.cos(flow) - drag * np.sin(flow)))
    torque = np.einsum("ij->i", pressure * radius * (lift * np.sin(flow) + drag * np.cos(flow)))
    return thrust, 2.0 * math.pi * torque


def _tip_loss(propeller: Propeller, part: np.ndarray, flow: np.ndarray) -> np.ndarray:
    """Return Prandtl's factor, with the pitch of the wake that leaves the tip."""
    tip = np.maximum(np.abs(np.tan(flow)) * part, 1e-6)
    exponent = 0.5 * propeller.blades.value * (1.0 - part) / tip
    return 2.0 / math.pi * np.arccos(np.exp(-exponent))


def _lift(propeller: Propeller, angle: np.ndarray) -> np.ndarray:
    """Return the lift coefficient of the section: a line that bends smoothly into its limits."""
    low, high = propeller.lift_limit.value
    line = propeller.lift_slope.value * np.sin(angle)
    limit = np.where(line > 0.0, high, -low)
    return line / (1.0 + (line / limit) ** 4) ** 0.25


def _drag(propeller: Propeller, lift: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Return the drag coefficient of the section: a parabola over the lift, a flat plate's in separated flow."""
    bucket = propeller.profile_drag.value + propeller.drag_rise.value * (lift - propeller.drag_lift.value) ** 2
    lost = propeller.lift_slope.value * np.sin(angle) - lift
    return bucket + np.abs(lost) * np.abs(np.sin(angle))


@lru_cache(maxsize=8)
def tables(propeller: Propeller) -> tuple[np.ndarray, np.ndarray]:
    """Return C_T and C_P on the grid of ``ADVANCE`` (rows) and ``PITCH_DEG`` (columns)."""
    grid = np.array([(j, math.radians(angle)) for j in ADVANCE for angle in PITCH_DEG])
    thrust, power = coefficients(propeller, grid[:, 0], grid[:, 1])
    shape = len(ADVANCE), len(PITCH_DEG)
    return thrust.reshape(shape), power.reshape(shape)


def governed_thrust(propeller: Propeller, power_w: float, speed_mps: float, density: float) -> float:
    """Return the thrust [N] at the governed speed for a shaft power, from the tables as JSBSim reads them."""
    turns, size = propeller.speed.value / (2.0 * math.pi), propeller.diameter.value
    thrust, power = tables(propeller)
    at = speed_mps / (turns * size)
    of_thrust = [float(np.interp(at, ADVANCE, column)) for column in thrust.T]
    of_power = [float(np.interp(at, ADVANCE, column)) for column in power.T]
    wanted = power_w / (density * turns**3 * size**5)
    # The governor works on the rising branch: from the angle of least power up to the coarse stop.
    low, high = (math.degrees(angle) for angle in propeller.pitch_range.value)
    angles = np.linspace(low, high, 2001)
    powers = np.interp(angles, PITCH_DEG, of_power)
    start = int(np.argmin(powers))
    angle = float(np.interp(wanted, powers[start:], angles[start:]))
    return float(np.interp(angle, PITCH_DEG, of_thrust)) * density * turns**2 * size**4

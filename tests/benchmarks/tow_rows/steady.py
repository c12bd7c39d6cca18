"""Level tow: the trail under a continuous rope, the balance of a finned bird, the figures of another code."""

import math

import numpy as np

from magsim.flight.tow import dynamics
from magsim.flight.tow.chain import Chain
from magsim.flight.tow.equilibrium import find_equilibrium
from magsim.flight.tow.integration import integrate
from magsim.units import G0
from tests.benchmarks.rows import Row, at_most
from tests.support.ropes import AIR, BIRD, ROPE, air_of, bird_chain, body_loads, continuous_trail, masses, point_chain
from tests.support.tows import at_rest, level, tilted

CASES = ((25.0, 80.0), (70.0, 80.0), (25.0, 20.0), (70.0, 20.0))
"""Speed [m/s] and mass [kg]; drag area 0.06 m^2."""

TABLE = ((25.0, 16.94, 8.03, 753.7, 722.1), (40.0, 8.97, 17.41, 733.5, 701.7), (70.0, 2.73, 39.39, 773.5, 727.7))
"""Speed [m/s], pitch and trail [deg], tension of the first and of the last link [N], by a prototype in numpy."""


def trail_flown(chain: Chain, state: np.ndarray, speed_mps: float, seconds: float) -> float:
    """Trail [rad] at the end of a level tow."""
    (flown,) = integrate([chain], [state], [level(speed_mps)], start_s=0.0, duration_s=[seconds], step_hz=60, log_hz=30)
    return math.atan2(-flown.place_m[-1, 0], flown.place_m[-1, 2])


def trails(speed_mps: float, mass_kg: float) -> dict[str, float]:
    """Trail [deg] found, held for a minute, and come back to within ten minutes after a push, less the exact one."""
    chain, state = point_chain(mass_kg), at_rest(point_chain(mass_kg), speed_mps)
    found, push = find_equilibrium(chain, speed_mps, AIR), math.radians(2.0)
    assert found is not None
    pushed = tilted(chain, tilted(chain, state, push), push, "y")
    exact = continuous_trail(ROPE, mass_kg, 0.06, speed_mps)
    out = {
        "found": found.trail,
        "held": trail_flown(chain, state, speed_mps, 60.0),
        "settled": trail_flown(chain, pushed, speed_mps, 600.0),
    }
    return {name: math.degrees(trail - exact) for name, trail in out.items()}


def balance(speed_mps: float) -> tuple[float, float, float]:
    """What is left of the forces [N] and moments [N m] on a finned bird, and of the derivative of its state."""
    chain = bird_chain()
    found = find_equilibrium(chain, speed_mps, AIR)
    assert found is not None
    cos, sin = math.cos(found.pitch), math.sin(found.pitch)
    # body axes: forward, right, down
    rot = np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])
    force, moment = body_loads(BIRD, rot.T @ np.array([-speed_mps, 0.0, 0.0]), np.zeros(3), AIR)
    along = np.array([found.links[-1, 0], 0.0, found.links[-1, 1]])
    flow = np.array([-speed_mps, 0.0, 0.0])
    across = flow - (flow @ along) * along
    rope, link_m = chain.rope, chain.rope.length_m / chain.links
    normal = rope.normal_drag * np.linalg.norm(across) * across
    tangential = math.pi * rope.tangential_drag * abs(flow @ along) * (flow @ along) * along
    drag = 0.5 * AIR * rope.diameter_m * link_m * (normal + tangential)
    at_bridle = 0.5 * drag - found.tension_n[-1] * along
    left = rot @ force + at_bridle + np.array([0.0, 0.0, masses(chain)[1] * G0])
    turn = moment + np.cross(np.array(BIRD.bridle_m), rot.T @ at_bridle)
    slope, tension = np.empty(chain.size), np.empty(chain.links)
    dynamics.state_derivative(chain.constants, at_rest(chain, speed_mps), air_of(speed_mps), slope, tension)
    return float(np.abs(left).max()), float(np.abs(turn).max()), float(np.abs(slope).max())


def table_errors() -> tuple[float, float, float]:
    """Largest difference from the table: pitch, trail [deg], tension [N]."""
    errors = []
    for speed, pitch, trail, top, low in TABLE:
        found = find_equilibrium(bird_chain(), speed, AIR)
        assert found is not None
        ends = np.abs(found.tension_n[[0, -1]] - [top, low]).max()
        errors.append((abs(math.degrees(found.pitch) - pitch), abs(math.degrees(found.trail) - trail), ends))
    pitch, trail, tension = np.max(errors, axis=0)
    return pitch, trail, tension


def rows() -> list[Row]:
    """All figures of the level tow."""
    out, worst = [], 0.0
    for speed, mass in CASES:
        errors = trails(speed, mass)
        worst = max(worst, *map(abs, errors.values()))
        for name, error in errors.items():
            out.append(at_most(f"{name}_trail_error_at_{speed:g}_mps_{mass:g}_kg", abs(error), "deg", 0.05))
    left = np.max([balance(speed) for speed in (10.0, 25.0, 40.0, 70.0)], axis=0)
    pitch, trail, tension = table_errors()
    return [
        at_most("trail_error_deg", worst, "deg", 0.05),
        *out,
        at_most("bird_force_balance_n", left[0], "N", 1e-9),
        at_most("bird_moment_balance_nm", left[1], "N m", 1e-9),
        at_most("slope_at_equilibrium", left[2], "SI", 1e-9),
        at_most("table_pitch_error_deg", pitch, "deg", 0.005),
        at_most("table_trail_error_deg", trail, "deg", 0.005),
        at_most("table_tension_error_n", tension, "N", 0.1),
    ]

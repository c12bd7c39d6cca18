"""Swings against closed forms: periods, decay, Foucault, the length of the links, energy."""

import itertools
import math
from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from magsim.earth.gravity import SPIN_RADPS
from magsim.flight.tow.chain import Chain, ball
from magsim.units import G0
from tests.benchmarks.rows import Row, at_most, within
from tests.support.ropes import ROPE, bird_chain, compound_period, energy_j, flexible_period, lengths_m, point_chain
from tests.support.tows import at_rest, body_of, decay, level, moved, states, strongest_mode, tilted

DECAY = {
    (80.0, 0.06): ((10.97, 0.001), (10.96, 0.011), (10.93, 0.027), (10.84, 0.037), (10.51, 0.050)),
    (80.0, 0.2): ((10.96, 0.002), (10.96, 0.020), (10.89, 0.049), (10.69, 0.067), (10.05, 0.087)),
    (20.0, 0.03): ((10.85, 0.003), (10.84, 0.033), (10.54, 0.079), (9.92, 0.098), (8.69, 0.109)),
}
"""Mass [kg] and drag area [m^2]: period [s] and damping ratio of the swing to the side, by an elastic chain."""

DECAY_MPS = (0.0, 10.0, 25.0, 35.0, 50.0)
STIFFNESS_N = 4e5
"""Of the elastic chain."""


def pendulum_s(chain: Chain, angle_deg: float = 0.3) -> float:
    """Period of a swing in vacuum, less what its size adds."""
    angle = math.radians(angle_deg)
    _, rows, _ = states(
        chain, tilted(chain, at_rest(chain, 1.0, 0.0), angle), level(0.0, 0.0), seconds=40.0, step_hz=120, log_hz=5
    )
    frequency, _ = strongest_mode(body_of(chain, rows)[0][:, 1], 0.2, above_hz=0.0)
    return 1.0 / frequency / (1.0 + angle**2 / 16.0)


def decays(mass_kg: float, drag_area_m2: float, speed_mps: float) -> tuple[float, float]:
    """Period [s] and damping ratio of the swing to the side from 5 degrees, of a rope as long as it is under load."""
    pull = mass_kg * G0 / math.cos(0.0 if speed_mps == 0.0 else _trail(mass_kg, drag_area_m2, speed_mps))
    part = 1.0 + pull / STIFFNESS_N
    rope = replace(ROPE, length_m=ROPE.length_m * part, mass_per_m=ROPE.mass_per_m / part)
    chain = Chain(rope, ball(mass_kg, drag_area_m2))
    state = tilted(chain, at_rest(chain, max(speed_mps, 1e-3)), math.radians(5.0))
    time, rows, _ = states(chain, state, level(speed_mps), seconds=60.0, step_hz=120, log_hz=20)
    return decay(time, body_of(chain, rows)[0][:, 1])


def _trail(mass_kg: float, drag_area_m2: float, speed_mps: float) -> float:
    place = body_of(chain := point_chain(mass_kg, drag_area_m2), at_rest(chain, speed_mps)[None])[0][0]
    return math.atan2(-place[0], place[2])


def foucault_error_pct(links: int = 10) -> float:
    """Rate at which the plane of a small swing at the pole turns, against the Earth's: clockwise from above."""
    chain = Chain(ROPE, ball(80.0, 0.0), links, (0.0, 0.0, SPIN_RADPS))
    # Earth-fixed axes: up is the third one
    state = tilted(chain, tilted(chain, at_rest(chain, 1.0, 0.0), math.radians(1.0)), math.pi)
    air = np.array([0.0, 0.0, -G0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    time, rows, _ = states(chain, state, lambda at: np.tile(air, (len(at), 1)), seconds=600.0, step_hz=60, log_hz=10)
    place = body_of(chain, rows)[0]
    flat = place[:, 0] + 1j * place[:, 1]
    # the mean of the square over whole periods points along twice the angle of the plane
    period = compound_period(ROPE, 80.0)
    begins, inside = np.arange(0.0, 600.0 - period, period), np.linspace(0.0, period, 400, endpoint=False)
    square = CubicSpline(time, flat**2)(begins[:, None] + inside).mean(axis=1)
    rate = np.polyfit(begins, 0.5 * np.unwrap(np.angle(square)), 1)[0]
    return 100.0 * abs(rate / -SPIN_RADPS - 1.0)


def link_error_m(chain: Chain, step_hz: int = 60) -> float:
    """Largest error of a link while the hook sways by 1.5 m at the swing's resonance for ten cycles."""
    _, rows, _ = states(chain, at_rest(chain, 25.0), moved(25.0, 1.5, 11.0), seconds=110.0, step_hz=step_hz, log_hz=10)
    length = chain.rope.length_m / chain.links
    return max(float(np.abs(lengths_m(chain, row) - length).max()) for row in rows)


def energy_drift(chain: Chain, step_hz: int = 60) -> float:
    """Largest change of energy within 100 s after a release from 20 degrees in vacuum, over the swing's energy."""
    rest = at_rest(chain, 1.0, 0.0)
    state = tilted(chain, rest, math.radians(20.0))
    _, rows, _ = states(chain, state, level(0.0, 0.0), seconds=100.0, step_hz=step_hz, log_hz=5)
    energy = np.array([energy_j(chain, row) for row in rows])
    return float(np.abs(energy - energy[0]).max() / (energy[0] - energy_j(chain, rest)))


def rows() -> list[Row]:
    """All figures of swings."""
    periods = {links: pendulum_s(point_chain(80.0, links=links)) for links in (2, 4, 8, 10, 16)}
    exact = flexible_period(ROPE, 80.0)
    out = [
        at_most("pendulum_period_error_pct", 100.0 * abs(periods[10] / compound_period(ROPE, 80.0) - 1.0), "%", 0.3),
        at_most("pendulum_period_error_of_flexible_rope_pct", 100.0 * abs(periods[10] / exact - 1.0), "%", 0.01),
        at_most(
            "pendulum_period_error_at_20_kg_pct",
            100.0 * abs(pendulum_s(point_chain(20.0)) / compound_period(ROPE, 20.0) - 1.0),
            "%",
            0.3,
        ),
    ]
    errors = [periods[links] - exact for links in (2, 4, 8, 16)]
    for links, (coarse, fine) in zip((4, 8, 16), itertools.pairwise(errors), strict=True):
        out.append(within(f"pendulum_period_order_at_{links}_links", math.log2(coarse / fine), "1", 1.95, 2.05))
    differences = [
        np.abs(np.array(decays(*body, speed)) - expected)
        for body, table in DECAY.items()
        for speed, expected in zip(DECAY_MPS, table, strict=True)
    ]
    period, damping = np.max(differences, axis=0)
    return [
        *out,
        at_most("decay_period_difference_s", period, "s", 0.01),
        at_most("decay_damping_difference", damping, "1", 0.001),
        at_most("foucault_rate_error_pct", foucault_error_pct(), "%", 1.0),
        at_most("link_error_m", max(link_error_m(bird_chain()), link_error_m(point_chain())), "m", 1e-6),
        at_most("energy_drift", max(energy_drift(bird_chain()), energy_drift(point_chain())), "1", 1e-4),
    ]

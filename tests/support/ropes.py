"""Ropes and birds by other ways than the simulator's: continuous ropes, closed forms, a dense system with multipliers.

Nothing here calls the equations that it checks; states and ``air`` have the layout of
``magsim.flight.tow.dynamics``.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from scipy.special import j0, j1, y0, y1

from magsim.flight.tow.chain import Chain, Rope, TowedBody, ball
from magsim.units import G0

AIR = 1.19
"""Density [kg/m^3]."""

ROPE = Rope(length_m=30.0, diameter_m=0.010, mass_per_m=0.12, normal_drag=1.1, tangential_drag=0.02)
BIRD = TowedBody(
    mass_kg=80.0,
    inertia_kgm2=(1.525, 45.68, 45.68),
    bridle_m=(0.15, 0.0, -0.22),
    drag_area_m2=(0.06, 0.0, 0.0),
    cross_area_m2=0.2275,
    fin_area_m2=0.25,
    fin_slope=2.5,
    fin_station_m=-1.1,
    fin_radius_m=0.25,
    munk_m3=0.9 * 0.1501,
)


def point_chain(mass_kg: float = 80.0, drag_area_m2: float = 0.06, links: int = 10) -> Chain:
    """A rope of 30 m with a point on it."""
    return Chain(ROPE, ball(mass_kg, drag_area_m2), links)


def bird_chain(links: int = 10) -> Chain:
    """The same rope with a finned bird."""
    return Chain(ROPE, BIRD, links)


def air_of(speed_mps: float, density: float = AIR) -> np.ndarray:
    """What acts in a level tow to the north, (10,)."""
    return np.array([0.0, 0.0, G0, -speed_mps, 0.0, 0.0, -speed_mps, 0.0, 0.0, density])


# ---- a rope that is continuous


def continuous_trail(rope: Rope, mass_kg: float, drag_area_m2: float, speed_mps: float, density: float = AIR) -> float:
    """Angle [rad] from the vertical below the tow point to a point bird under a continuous rope in a level tow.

    From the bird up: the pull grows by weight and drag of the rope.
    """

    def grown(_: float, y: np.ndarray) -> list[float]:
        pull = math.hypot(y[2], y[3])
        aft, down = y[2] / pull, y[3] / pull
        past = speed_mps * aft
        across_aft, across_down = speed_mps - past * aft, -past * down
        half = 0.5 * density * rope.diameter_m
        normal = half * rope.normal_drag * math.hypot(across_aft, across_down)
        along = half * math.pi * rope.tangential_drag * abs(past) * past
        weight = rope.mass_per_m * G0
        return [aft, down, normal * across_aft + along * aft, normal * across_down + along * down + weight]

    begin = [0.0, 0.0, 0.5 * density * speed_mps**2 * drag_area_m2, mass_kg * G0]
    found = solve_ivp(grown, (0.0, rope.length_m), begin, method="DOP853", rtol=1e-12, atol=1e-10)
    return math.atan2(found.y[0, -1], found.y[1, -1])


def compound_period(rope: Rope, mass_kg: float) -> float:
    """Small swing in vacuum of a rope as a rod with a bob at its end [s]."""
    length, own = rope.length_m, rope.mass_per_m * rope.length_m
    inertia, moment = mass_kg * length**2 + own * length**2 / 3.0, (mass_kg * length + own * length / 2.0) * G0
    return 2.0 * math.pi * math.sqrt(inertia / moment)


def flexible_period(rope: Rope, mass_kg: float) -> float:
    """Small swing in vacuum of a rope that bends, with a bob at its end [s].

    ``(g h y')' + w^2 y = 0`` in the height h above the point where the pull would end, M / mu below the bob: Bessel
    functions of ``2 w sqrt(h / g)`` with ``y = 0`` at the top and ``g y' = -w^2 y`` at the bob.
    """
    low, high = mass_kg / rope.mass_per_m, mass_kg / rope.mass_per_m + rope.length_m

    def wanting(omega: float) -> float:
        at = 2.0 * omega * np.sqrt(np.array([low, high]) / G0)
        # derivatives in h: dz/dh = w / sqrt(g h)
        inner = omega / math.sqrt(G0 * low)
        bob = [G0 * -first(at[0]) * inner + omega**2 * zero(at[0]) for zero, first in ((j0, j1), (y0, y1))]
        return float(bob[0] * y0(at[1]) - bob[1] * j0(at[1]))

    rigid = 2.0 * math.pi / compound_period(rope, mass_kg)
    return 2.0 * math.pi / brentq(wanting, 0.98 * rigid, 1.02 * rigid, xtol=1e-14, rtol=1e-14)


# ---- a finned body in the air


def body_loads(body: TowedBody, flow: np.ndarray, rate: np.ndarray, density: float) -> tuple[np.ndarray, np.ndarray]:
    """Force [N] and moment [N m] about the center of gravity, body axes: equations (6) to (13) of the reference.

    ``flow`` is the velocity of the air relative to the body, ``rate`` the body's angular rate.
    """
    speed = np.linalg.norm(flow)
    station = np.array([body.fin_station_m, 0.0, 0.0])
    # the fin moves through the air by what the turning adds to it
    at_fin = flow - np.cross(rate, station)
    lift = 0.5 * density * speed * body.fin_area_m2 * body.fin_slope * at_fin * np.array([0.0, 1.0, 1.0])
    drag = 0.5 * density * speed * np.array(body.drag_area_m2) * flow
    cross = 0.5 * density * body.cross_area_m2 * np.abs(flow) * flow * np.array([0.0, 1.0, 1.0])
    # a slender body in oblique flow is turned across it
    munk = density * body.munk_m3 * np.cross(flow, np.array([flow[0], 0.0, 0.0]))
    roll = -0.5 * density * speed * body.fin_area_m2 * 0.5 * body.fin_slope * body.fin_radius_m**2 * rate[0]
    return drag + cross + lift, np.cross(station, lift) + munk + np.array([roll, 0.0, 0.0])


# ---- Newton and Euler with multipliers


class Parts(NamedTuple):
    """A state taken apart: of nodes 1 to N - 1, and of the body."""

    nodes: np.ndarray
    velocities: np.ndarray
    place: np.ndarray
    velocity: np.ndarray
    rate: np.ndarray
    rot: np.ndarray


def parts_of(chain: Chain, state: np.ndarray) -> Parts:
    """Take a state apart."""
    inner, body = 3 * (chain.links - 1), 6 * (chain.links - 1)
    rot = Rotation.from_quat(np.roll(state[body + 9 :], -1)).as_matrix()
    return Parts(
        state[:inner].reshape(-1, 3),
        state[inner:body].reshape(-1, 3),
        state[body : body + 3],
        state[body + 3 : body + 6],
        state[body + 6 : body + 9],
        rot,
    )


def all_nodes(chain: Chain, parts: Parts) -> tuple[np.ndarray, np.ndarray]:
    """Places and velocities of nodes 0 to N, (N + 1, 3) each."""
    bridle, origin = np.array(chain.body.bridle_m), np.zeros(3)
    place = np.vstack([origin, parts.nodes, parts.place + parts.rot @ bridle])
    return place, np.vstack(
        [origin, parts.velocities, parts.velocity + parts.rot @ np.cross(parts.rate, bridle)],
    )


def lengths_m(chain: Chain, state: np.ndarray) -> np.ndarray:
    """Length of each link, (N,) [m]."""
    return np.linalg.norm(np.diff(all_nodes(chain, parts_of(chain, state))[0], axis=0), axis=1)


def masses(chain: Chain) -> tuple[float, float]:
    """Mass of an inner node and of the body with its half of the last link [kg]."""
    link = chain.rope.mass_per_m * chain.rope.length_m / chain.links
    return link, chain.body.mass_kg + 0.5 * link


def energy_j(chain: Chain, state: np.ndarray) -> float:
    """Kinetic energy and that of the height where down is the third axis [J]."""
    parts, (link, body) = parts_of(chain, state), masses(chain)
    kinetic = 0.5 * link * np.sum(parts.velocities**2) + 0.5 * body * np.sum(parts.velocity**2)
    kinetic += 0.5 * np.sum(np.array(chain.body.inertia_kgm2) * parts.rate**2)
    return float(kinetic - G0 * (link * parts.nodes[:, 2].sum() + body * parts.place[2]))


def dense(chain: Chain, state: np.ndarray, air: np.ndarray, gamma: float) -> tuple[np.ndarray, np.ndarray]:
    """Accelerations of nodes, body and body's rates, (3 (N + 1),), and tensions (N,): one system of all of them.

    Each link's length is held by a multiplier. The derivatives of the links' rates are taken by complex steps, which
    lose no digits, of a function that knows places and velocities alone. Of the axes' own turning the centers of mass
    feel Coriolis; the body's rotation is counted from the axes as if they stood still.
    """
    parts, (link_kg, body_kg), n = parts_of(chain, state), masses(chain), chain.links
    inertia, bridle = np.array(chain.body.inertia_kgm2), np.array(chain.body.bridle_m)
    place, velocity = all_nodes(chain, parts)
    spin = np.array(chain.spin)

    # forces on nodes 1 to N - 1, on the body and their moment in its axes
    force = np.zeros((n + 1, 3))
    for i in range(n):
        force[i : i + 2] += 0.5 * link_drag(chain, air, i, place, velocity)
    at_bridle = force[n]
    own, moment = body_loads(chain.body, parts.rot.T @ (air[6:9] - parts.velocity), parts.rate, air[9])
    on_nodes = force[1:n] + link_kg * (air[:3] - 2.0 * np.cross(spin, parts.velocities))
    on_body = parts.rot @ own + at_bridle + body_kg * (air[:3] - 2.0 * np.cross(spin, parts.velocity))
    turning = moment + np.cross(bridle, parts.rot.T @ at_bridle) - np.cross(parts.rate, inertia * parts.rate)
    known = np.concatenate([on_nodes.ravel(), on_body, turning])
    mass = np.concatenate([np.full(3 * (n - 1), link_kg), np.full(3, body_kg), inertia])

    # the links' rates change by the motion that is, and by what is added to each velocity
    tiny, size = 1e-30, len(mass)
    still = np.zeros(size)
    drift = _link_rates(chain, parts, tiny * 1j, still).imag / tiny
    slopes = np.column_stack([_link_rates(chain, parts, 0.0, tiny * 1j * unit).imag / tiny for unit in np.eye(size)])
    rates, stretch = _link_rates(chain, parts, 0.0, still).real, lengths_m(chain, state) - chain.rope.length_m / n
    wanted = -drift - 2.0 * gamma * rates - gamma**2 * stretch
    system = np.block([[np.diag(mass), slopes.T], [slopes, np.zeros((n, n))]])
    found = np.linalg.solve(system, np.concatenate([known, wanted]))
    return found[:size], found[size:]


def link_drag(chain: Chain, air: np.ndarray, i: int, place: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """Drag of a link at its mean velocity, (3,) [N]."""
    rope, share = chain.rope, (i + 0.5) / chain.links
    along = (place[i + 1] - place[i]) / np.linalg.norm(place[i + 1] - place[i])
    flow = (1.0 - share) * air[3:6] + share * air[6:9] - 0.5 * (velocity[i] + velocity[i + 1])
    past = flow @ along
    across = flow - past * along
    normal = rope.normal_drag * np.linalg.norm(across) * across
    tangential = math.pi * rope.tangential_drag * abs(past) * past * along
    return 0.5 * air[9] * rope.diameter_m * rope.length_m / chain.links * (normal + tangential)


def _link_rates(chain: Chain, parts: Parts, after: complex, added: np.ndarray) -> np.ndarray:
    """Rate of each link's length after a short time without accelerations, with something added to the velocities."""
    inner, bridle = 3 * (chain.links - 1), np.array(chain.body.bridle_m)
    rate = parts.rate + added[inner + 3 :]
    # to first order in a complex step the rotation is turned exactly
    rot = parts.rot + after * parts.rot @ _cross(parts.rate)
    zero = np.zeros((1, 3))
    place = np.vstack(
        [zero, parts.nodes + after * parts.velocities, parts.place + after * parts.velocity + rot @ bridle]
    )
    velocity = np.vstack(
        [
            zero,
            parts.velocities + added[:inner].reshape(-1, 3),
            parts.velocity + added[inner : inner + 3] + rot @ np.cross(rate, bridle),
        ]
    )
    reach, moved = np.diff(place, axis=0), np.diff(velocity, axis=0)
    return np.sum(reach * moved, axis=1) / np.sqrt(np.sum(reach * reach, axis=1))


def _cross(vector: np.ndarray) -> np.ndarray:
    """Matrix of a cross product from the left."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])

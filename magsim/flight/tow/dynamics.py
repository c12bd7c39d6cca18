"""The rope as an inextensible chain of links with a rigid body at its end: the equations of motion, compiled.

Nodes 0 to N, links 1 to N. Node 0 is the tow point, whose motion is given; nodes 1 to N - 1 carry the mass of a link;
node N is the bridle of the body. Places and velocities are counted from the tow point, along axes that do not turn
with the carrier: there gravity is the *apparent* one, gravity less the acceleration of the tow point. With Earth-fixed
axes a flight is followed over the round Earth, and ``ChainConstants.spin`` is the Earth's; its
effect on the body's own rotation, below 1e-4 rad/s^2, is left out.

The tensions follow from the condition that no link changes its length: a symmetric, positive definite, tridiagonal
system. Baumgarte's terms damp the error of a link's length that the steps leave. The drag of a link acts at its mean
velocity, half of it on each of its ends.

A state is one row of numbers: places of nodes 1 to N - 1, their velocities, place and velocity of the body's center of
gravity, its angular rate in its own axes, and the quaternion from its axes to the common ones. ``air`` is ten numbers:
apparent gravity, the velocity of the air relative to the tow point there and at the body, the density.

Numba compiles this file once on a machine: plain loops of scalars in a fixed order, so that a flight has the same bits
in any batch.
"""

import math

import numpy as np

from magsim.flight.tow.chain import Chain, ChainConstants
from magsim.storage.compiled import compiled

GAMMA = 6.0
"""Baumgarte's constant [1/s]: an error of a link's length dies away as (1 + gamma t) exp(-gamma t)."""


@compiled
def body_loads(
    chain: ChainConstants, ux: float, uy: float, uz: float, p: float, q: float, r: float, density: float
) -> tuple[float, float, float, float, float, float]:
    """Return force [N] and moment [N m] of the air about the body's center of gravity, body axes.

    Axial drag, cross-flow drag, lift of the fins in their own flow, which damps pitch and yaw, their damping of roll,
    and the moment of a slender body in oblique flow (Munk).

    Parameters
    ----------
    chain : ChainConstants
    ux, uy, uz : float [m/s]
        Velocity of the air relative to the body: the first is negative in forward flight.
    p, q, r : float [rad/s]
    density : float [kg/m^3]
    """
    half = 0.5 * density
    speed = half * math.sqrt(ux * ux + uy * uy + uz * uz)
    arm = chain.fin_station
    right = speed * chain.fin_lift * (uy - r * arm)
    down = speed * chain.fin_lift * (uz + q * arm)
    munk = density * chain.munk * ux
    cross = half * chain.cross_area
    return (
        speed * chain.drag_area[0] * ux,
        speed * chain.drag_area[1] * uy + cross * abs(uy) * uy + right,
        speed * chain.drag_area[2] * uz + cross * abs(uz) * uz + down,
        -speed * chain.fin_roll * p,
        munk * uz - arm * down,
        arm * right - munk * uy,
    )


@compiled
def rotation(quaternion: np.ndarray) -> np.ndarray:
    """Return the matrix (3, 3) from the body's axes to the common ones, of a unit quaternion (w, x, y, z)."""
    w, x, y, z = quaternion
    out = np.empty((3, 3))
    out[0, 0], out[0, 1], out[0, 2] = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)
    out[1, 0], out[1, 1], out[1, 2] = 2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)
    out[2, 0], out[2, 1], out[2, 2] = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)
    return out


@compiled
def node_motion(chain: ChainConstants, state: np.ndarray, place: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """Fill places and velocities of all nodes, (N + 1, 3); return the body's rotation."""
    n = chain.links
    body = 6 * (n - 1)
    for c in range(3):
        place[0, c] = velocity[0, c] = 0.0
    for i in range(n - 1):
        for c in range(3):
            place[i + 1, c] = state[3 * i + c]
            velocity[i + 1, c] = state[3 * (n - 1 + i) + c]
    rot = rotation(state[body + 9 : body + 13])
    sx, sy, sz = chain.bridle
    p, q, r = state[body + 6], state[body + 7], state[body + 8]
    vx, vy, vz = q * sz - r * sy, r * sx - p * sz, p * sy - q * sx
    for c in range(3):
        place[n, c] = state[body + c] + (rot[c, 0] * sx + rot[c, 1] * sy + rot[c, 2] * sz)
        velocity[n, c] = state[body + 3 + c] + (rot[c, 0] * vx + rot[c, 1] * vy + rot[c, 2] * vz)
    return rot


@compiled
def link_loads(
    chain: ChainConstants,
    air: np.ndarray,
    place: np.ndarray,
    velocity: np.ndarray,
    along: np.ndarray,
    length: np.ndarray,
    drag: np.ndarray,
) -> None:
    """Fill direction (N, 3), length (N,) and drag (N, 3) [N] of each link."""
    for i in range(chain.links):
        square = 0.0
        for c in range(3):
            along[i, c] = place[i + 1, c] - place[i, c]
            square += along[i, c] * along[i, c]
        length[i] = math.sqrt(square)
        share, past = (i + 0.5) / chain.links, 0.0
        for c in range(3):
            along[i, c] /= length[i]
            flow = air[3 + c] + share * (air[6 + c] - air[3 + c]) - 0.5 * (velocity[i, c] + velocity[i + 1, c])
            drag[i, c] = flow
            past += flow * along[i, c]
        across = 0.0
        for c in range(3):
            drag[i, c] -= past * along[i, c]
            across += drag[i, c] * drag[i, c]
        normal, tangential = air[9] * chain.across * math.sqrt(across), air[9] * chain.along * abs(past) * past
        for c in range(3):
            drag[i, c] = normal * drag[i, c] + tangential * along[i, c]


@compiled
def state_derivative(
    chain: ChainConstants, state: np.ndarray, air: np.ndarray, slope: np.ndarray, tension: np.ndarray
) -> None:
    """Fill the derivative of a state and the tensions of the links [N], positive where a link pulls."""
    n = chain.links
    body = 6 * (n - 1)
    place, velocity = np.empty((n + 1, 3)), np.empty((n + 1, 3))
    along, drag, free = np.empty((n, 3)), np.empty((n, 3)), np.zeros((n + 1, 3))
    length, diagonal, off = np.empty(n), np.empty(n), np.empty(n)
    rot = node_motion(chain, state, place, velocity)
    link_loads(chain, air, place, velocity, along, length, drag)

    # the body: everything seen in its own axes
    flow, half, last = np.zeros(3), np.zeros(3), np.zeros(3)
    for k in range(3):
        for c in range(3):
            flow[k] += rot[c, k] * (air[6 + c] - state[body + 3 + c])
            half[k] += rot[c, k] * (0.5 * drag[n - 1, c])
            last[k] += rot[c, k] * along[n - 1, c]
    p, q, r = state[body + 6], state[body + 7], state[body + 8]
    fx, fy, fz, mx, my, mz = body_loads(chain, flow[0], flow[1], flow[2], p, q, r, air[9])
    sx, sy, sz = chain.bridle
    jx, jy, jz = chain.inertia
    turning, per_newton = np.empty(3), np.empty(3)
    turning[0] = (mx + (sy * half[2] - sz * half[1]) - (jz - jy) * q * r) / jx
    turning[1] = (my + (sz * half[0] - sx * half[2]) - (jx - jz) * r * p) / jy
    turning[2] = (mz + (sx * half[1] - sy * half[0]) - (jy - jx) * p * q) / jz
    # the moment of each newton of the last link's pull, and the turning that it makes
    lx, ly, lz = sy * last[2] - sz * last[1], sz * last[0] - sx * last[2], sx * last[1] - sy * last[0]
    per_newton[0], per_newton[1], per_newton[2] = lx / jx, ly / jy, lz / jz
    # acceleration of the bridle beyond that of the center of gravity
    inner, square = p * sx + q * sy + r * sz, p * p + q * q + r * r
    bx = turning[1] * sz - turning[2] * sy + p * inner - sx * square
    by = turning[2] * sx - turning[0] * sz + q * inner - sy * square
    bz = turning[0] * sy - turning[1] * sx + r * inner - sz * square

    wx, wy, wz = 2.0 * chain.spin
    own = np.empty(3)
    for c in range(3):
        own[c] = rot[c, 0] * (fx + half[0]) + rot[c, 1] * (fy + half[1]) + rot[c, 2] * (fz + half[2])
        own[c] = own[c] / chain.body_kg + air[c]
        for i in range(1, n):
            free[i, c] = (drag[i - 1, c] + drag[i, c]) * 0.5 / chain.link_kg + air[c]
    for i in range(1, n):
        vx, vy, vz = velocity[i, 0], velocity[i, 1], velocity[i, 2]
        free[i, 0] -= wy * vz - wz * vy
        free[i, 1] -= wz * vx - wx * vz
        free[i, 2] -= wx * vy - wy * vx
    vx, vy, vz = state[body + 3], state[body + 4], state[body + 5]
    own[0] -= wy * vz - wz * vy
    own[1] -= wz * vx - wx * vz
    own[2] -= wx * vy - wy * vx
    for c in range(3):
        free[n, c] = own[c] + (rot[c, 0] * bx + rot[c, 1] * by + rot[c, 2] * bz)

    # no link changes its length
    node = 1.0 / chain.link_kg
    end = 1.0 / chain.body_kg + (lx * per_newton[0] + ly * per_newton[1] + lz * per_newton[2])
    for i in range(n):
        wanted, stretch, change, turn = 0.0, 0.0, 0.0, 0.0
        for c in range(3):
            moved = velocity[i + 1, c] - velocity[i, c]
            wanted += along[i, c] * (free[i + 1, c] - free[i, c])
            stretch += moved * along[i, c]
            change += moved * moved
            if i > 0:
                turn += along[i, c] * along[i - 1, c]
        wanted += (change - stretch * stretch) / length[i]
        tension[i] = wanted + 2.0 * GAMMA * stretch + GAMMA * GAMMA * (length[i] - chain.link_m)
        diagonal[i] = (0.0 if i == 0 else node) + (end if i == n - 1 else node)
        off[i] = -node * turn
    solve_tridiagonal(diagonal, off, tension)

    for i in range(n - 1):
        for c in range(3):
            pull = (tension[i + 1] * along[i + 1, c] - tension[i] * along[i, c]) * node
            slope[3 * i + c] = state[3 * (n - 1 + i) + c]
            slope[3 * (n - 1 + i) + c] = free[i + 1, c] + pull
    for c in range(3):
        slope[body + c] = state[body + 3 + c]
        slope[body + 3 + c] = own[c] - tension[n - 1] * along[n - 1, c] / chain.body_kg
        slope[body + 6 + c] = turning[c] - tension[n - 1] * per_newton[c]
    w, x, y, z = state[body + 9], state[body + 10], state[body + 11], state[body + 12]
    slope[body + 9] = 0.5 * (-x * p - y * q - z * r)
    slope[body + 10] = 0.5 * (w * p + y * r - z * q)
    slope[body + 11] = 0.5 * (w * q - x * r + z * p)
    slope[body + 12] = 0.5 * (w * r + x * q - y * p)


@compiled
def solve_tridiagonal(diagonal: np.ndarray, off: np.ndarray, wanted: np.ndarray) -> None:
    """Solve a symmetric tridiagonal system in place, by elimination without pivoting (Thomas).

    ``off[i]`` stands left of ``diagonal[i]``; the solution overwrites ``wanted``, the diagonal is overwritten too.
    """
    n = len(diagonal)
    for i in range(1, n):
        factor = off[i] / diagonal[i - 1]
        diagonal[i] -= factor * off[i]
        wanted[i] -= factor * wanted[i - 1]
    wanted[n - 1] /= diagonal[n - 1]
    for i in range(n - 2, -1, -1):
        wanted[i] = (wanted[i] - off[i + 1] * wanted[i + 1]) / diagonal[i]


@compiled
def advance(chain: ChainConstants, state: np.ndarray, table: np.ndarray, step_s: float, logged: np.ndarray) -> None:
    """Advance a state by steps of the classical Runge-Kutta method of fourth order, in place.

    Parameters
    ----------
    chain : ChainConstants
    state : (s,)
    table : (2 n + 1, 10)
        ``air`` at the begin, middle and end of each of n steps.
    step_s : float [s]
    logged : (n, 4)
        Filled with the tensions at the beginning of each step: of the first and the last link, the least, the most.
    """
    size, n = len(state), chain.links
    slopes, trial, tension = np.empty((4, size)), np.empty(size), np.empty(n)
    body = 6 * (n - 1)
    for k in range(len(logged)):
        state_derivative(chain, state, table[2 * k], slopes[0], tension)
        logged[k, 0], logged[k, 1] = tension[0], tension[n - 1]
        logged[k, 2], logged[k, 3] = tension.min(), tension.max()
        for stage in range(1, 4):
            reach = step_s if stage == 3 else 0.5 * step_s
            for j in range(size):
                trial[j] = state[j] + reach * slopes[stage - 1, j]
            state_derivative(chain, trial, table[2 * k + (2 if stage == 3 else 1)], slopes[stage], tension)
        for j in range(size):
            slope = slopes[0, j] + 2.0 * (slopes[1, j] + slopes[2, j]) + slopes[3, j]
            state[j] += step_s / 6.0 * slope
        square = 0.0
        for j in range(body + 9, body + 13):
            square += state[j] * state[j]
        for j in range(body + 9, body + 13):
            state[j] /= math.sqrt(square)


@compiled
def pull_on_hook(chain: ChainConstants, state: np.ndarray, air: np.ndarray) -> np.ndarray:
    """Return the force of the rope on the hook, (3,) [N]: pull of the first link, half of its drag and of its mass."""
    n = chain.links
    slope, tension = np.empty(len(state)), np.empty(n)
    place, velocity = np.empty((n + 1, 3)), np.empty((n + 1, 3))
    along, drag, length = np.empty((n, 3)), np.empty((n, 3)), np.empty(n)
    state_derivative(chain, state, air, slope, tension)
    node_motion(chain, state, place, velocity)
    link_loads(chain, air, place, velocity, along, length, drag)
    return tension[0] * along[0] + 0.5 * drag[0] + 0.5 * chain.link_kg * air[:3]


def nodes_of(chain: Chain, state: np.ndarray) -> np.ndarray:
    """Return the places of all nodes from the tow point, (N + 1, 3) [m]."""
    place, velocity = np.empty((chain.links + 1, 3)), np.empty((chain.links + 1, 3))
    node_motion(chain.constants, state, place, velocity)
    return place

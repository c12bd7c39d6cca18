"""Equilibrium of rope and body in a level tow at constant speed: the state in which a flight begins."""

import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from magsim.flight.tow.chain import Chain
from magsim.flight.tow.dynamics import body_loads
from magsim.units import G0

PITCHES = np.radians(np.arange(-80.0, 81.0, 4.0))
"""Pitches between which the equilibrium of a body is searched."""


class Equilibrium(NamedTuple):
    """An equilibrium in the vertical plane of the tow: x along the motion through the air, z down.

    Attributes
    ----------
    pitch : float [rad]
        Of the body.
    links : (N, 2)
        Directions of the links from the tow point down, unit vectors (x, z).
    tension_n : (N,) [N]
        From the tow point down.
    bridle_m : (2,)
        From the body's center of gravity to its bridle, in the plane.
    hang_m : (2,)
        From the tow point to the body's center of gravity.
    """

    pitch: float
    links: np.ndarray
    tension_n: np.ndarray
    bridle_m: np.ndarray
    hang_m: np.ndarray

    @property
    def trail(self) -> float:
        """Angle [rad] from the vertical below the tow point to the body's center of gravity, aft."""
        return math.atan2(-self.hang_m[0], self.hang_m[1])

    @property
    def upright(self) -> bool:
        """Whether every link pulls and hangs below its upper end."""
        return bool(np.all(self.tension_n > 0.0) and np.all(self.links[:, 1] > 0.0))


def find_equilibrium(chain: Chain, speed_mps: float, density: float, gravity_mps2: float = G0) -> Equilibrium | None:
    """Find the equilibrium of a level tow; None if no stable one exists.

    Going up from the body, the pull of each link balances the load below it; at the pitch of the body the moments of
    air and rope cancel, and at a larger pitch they turn it back.

    Parameters
    ----------
    chain : Chain
        With a body that is symmetric about its vertical plane.
    speed_mps : float
        Through the air.
    density : float [kg/m^3]
    gravity_mps2 : float
    """
    case = _Case(chain, speed_mps, density, gravity_mps2)
    if not chain.body.turns:
        return case.hung(0.0)
    moments = [case.moment(pitch) for pitch in PITCHES]
    pairs = zip(PITCHES[:-1], PITCHES[1:], moments[:-1], moments[1:], strict=True)
    # where the moment falls through zero the body turns back; of several such pitches the flattest is taken
    stable = [(low, high) for low, high, below, above in pairs if below > 0.0 >= above]
    if not stable:
        return None
    low, high = min(stable, key=lambda pair: abs(pair[0] + pair[1]))
    return case.hung(brentq(case.moment, low, high, xtol=1e-14, rtol=1e-15))


def hanging_state(chain: Chain, equilibrium: Equilibrium, air: np.ndarray) -> np.ndarray:
    """Return the state (s,) of a chain in equilibrium below its tow point.

    Parameters
    ----------
    chain : Chain
    equilibrium : Equilibrium
    air : (10,)
        Sets the directions of down and of the tow.
    """
    down = air[:3] / np.linalg.norm(air[:3])
    aft = air[3:6] - np.dot(air[3:6], down) * down
    forward = -aft / np.linalg.norm(aft)
    axes = np.column_stack([forward, np.cross(down, forward), down])
    turned = (Rotation.from_matrix(axes) * Rotation.from_rotvec([0.0, equilibrium.pitch, 0.0])).as_quat()
    state, body = np.zeros(chain.size), 6 * (chain.links - 1)
    inner = np.cumsum(equilibrium.links, axis=0)[:-1] * chain.constants.link_m
    state[: body // 2] = (inner[:, :1] * forward + inner[:, 1:] * down).ravel()
    state[body : body + 3] = equilibrium.hang_m[0] * forward + equilibrium.hang_m[1] * down
    state[body + 9 :] = np.roll(turned, 1)
    return state


class _Case:
    """One tow in its plane."""

    def __init__(self, chain: Chain, speed_mps: float, density: float, gravity_mps2: float) -> None:
        self.chain, self.constants = chain, chain.constants
        self.density, self.speed, self.gravity = density, speed_mps, gravity_mps2
        self.across, self.along = density * chain.constants.across, density * chain.constants.along

    def _turned(self, pitch: float, x: float, z: float) -> tuple[float, float]:
        """Rotate from the body's axes into the plane."""
        cos, sin = math.cos(pitch), math.sin(pitch)
        return x * cos + z * sin, z * cos - x * sin

    def _drag(self, x: float, z: float) -> tuple[float, float]:
        """Return the drag of a link in the direction (x, z)."""
        past = -self.speed * x
        across_x, across_z = -self.speed - past * x, -past * z
        normal = self.across * math.hypot(across_x, across_z)
        tangential = self.along * abs(past) * past
        return normal * across_x + tangential * x, normal * across_z + tangential * z

    def _pull(self, load_x: float, load_z: float) -> tuple[float, float, float]:
        """Return direction and tension of the link that balances a load and half of its own drag.

        The drag turns it from the direction of the load towards that of the flow; the solution is between both.
        """

        def held(angle: float) -> tuple[float, float]:
            drag_x, drag_z = self._drag(-math.sin(angle), math.cos(angle))
            return load_x + 0.5 * drag_x, load_z + 0.5 * drag_z

        def aside(angle: float) -> float:
            held_x, held_z = held(angle)
            return math.cos(angle) * held_x + math.sin(angle) * held_z

        angle, flow = math.atan2(-load_x, load_z), 0.5 * math.pi
        if aside(angle) * aside(flow) < 0.0:
            angle = brentq(aside, angle, flow, xtol=1e-16, rtol=1e-15)
        held_x, held_z = held(angle)
        pull = math.hypot(held_x, held_z)
        return held_x / pull, held_z / pull, pull

    def _air(self, pitch: float) -> tuple[float, float, float]:
        """Return force and moment of the air on the body in the plane, the moment about the right-hand axis."""
        x, z = self._turned(-pitch, -self.speed, 0.0)
        force_x, _, force_z, _, moment, _ = body_loads(self.constants, x, 0.0, z, 0.0, 0.0, 0.0, self.density)
        return (*self._turned(pitch, force_x, force_z), moment)

    def _load(self, pitch: float) -> tuple[float, float, float]:
        """Return the load on the last link and the moment of the air."""
        force_x, force_z, moment = self._air(pitch)
        return force_x, force_z + self.constants.body_kg * self.gravity, moment

    def moment(self, pitch: float) -> float:
        """Return the sum of the moments about the body's center of gravity, nose up positive."""
        load_x, load_z, moment = self._load(pitch)
        x, z, pull = self._pull(load_x, load_z)
        drag_x, drag_z = self._drag(x, z)
        # force at the bridle: half of the last link's drag less its pull
        at_x, at_z = 0.5 * drag_x - pull * x, 0.5 * drag_z - pull * z
        arm_x, arm_z = self._bridle(pitch)
        return moment + arm_z * at_x - arm_x * at_z

    def _bridle(self, pitch: float) -> tuple[float, float]:
        return self._turned(pitch, self.chain.body.bridle_m[0], self.chain.body.bridle_m[2])

    def hung(self, pitch: float) -> Equilibrium:
        """Return the equilibrium of the rope above a body with that pitch."""
        load_x, load_z, _ = self._load(pitch)
        directions, pulls = [], []
        for number in range(self.chain.links, 0, -1):
            x, z, pull = self._pull(load_x, load_z)
            directions.append((x, z))
            pulls.append(pull)
            drag_x, drag_z = self._drag(x, z)
            weight = self.constants.link_kg * self.gravity if number > 1 else 0.0
            load_x, load_z = pull * x + 0.5 * drag_x, pull * z + 0.5 * drag_z + weight
        links = np.array(directions[::-1])
        bridle = np.array(self._bridle(pitch))
        return Equilibrium(
            pitch, links, np.array(pulls[::-1]), bridle, links.sum(axis=0) * self.constants.link_m - bridle
        )

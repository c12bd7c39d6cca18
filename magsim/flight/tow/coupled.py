"""A bird that pulls on its carrier: the chain is stepped with the flight model, which gets its pull one step later."""

import math
from array import array
from collections.abc import Sequence

import numpy as np

from magsim.earth.atmosphere import standard_density
from magsim.earth.gravity import SPIN_RADPS, gravity_n
from magsim.flight.model.channels import CarrierState
from magsim.flight.tow.chain import Chain
from magsim.flight.tow.dynamics import advance, nodes_of, pull_on_hook
from magsim.flight.tow.equilibrium import Equilibrium, hanging_state
from magsim.flight.tow.hook import GUST_HZ, gust_knots
from magsim.flight.tow.motion import BirdMotion
from magsim.scenario import Gusts
from magsim.storage.compiled import compiled

RAMP_S = 10.0
"""The carrier is trimmed without a rope; the pull rises to its full value over this time."""

GRAVITY_STEPS = 12
"""Gravity is updated once in so many steps: it changes by 3e-6 m/s^2 in a meter of height."""


class CoupledChain:
    """A chain under a flight model, step by step.

    Parameters
    ----------
    chain : Chain
    equilibrium : Equilibrium
        Of the start.
    arm_b : (3,) [m]
        From the carrier's center of gravity to the hook.
    gusts : Gusts
    airspeed_mps : float
    seed : int
    step_s : float [s]
    steps_per_row : int
        Of the log.
    """

    def __init__(
        self,
        chain: Chain,
        equilibrium: Equilibrium,
        arm_b: Sequence[float],
        *,
        gusts: Gusts,
        airspeed_mps: float,
        seed: int,
        step_s: float,
        steps_per_row: int,
    ) -> None:
        self.chain, self._equilibrium, self._arm_b = chain, equilibrium, np.array(arm_b, dtype=float)
        self._gusts = gust_knots(gusts, airspeed_mps, seed)
        self._drawn: list[np.ndarray] = []
        self._step_s, self._per_row, self._steps = step_s, steps_per_row, 0
        self._chain_state: np.ndarray | None = None
        self._air = np.zeros((3, 10))
        self._velocity_e = np.zeros(3)
        self._gravity = 0.0
        self._logged = np.zeros((1, 4))
        self._rows, self._least, self._most = array("d"), math.inf, -math.inf
        self._slack: int | None = None

    def begin(self, state: CarrierState) -> None:
        """Start in equilibrium below a carrier that flies straight and level."""
        self._velocity_e, rot_ne = _hook(np.array(state), self._arm_b)
        self._update_air(state, rot_ne, np.zeros(3), self._steps)
        self._chain_state = hanging_state(self.chain, self._equilibrium, self._air[2])
        self._log()

    def step(self, state: CarrierState) -> tuple[float, float, float]:
        """Step the chain to the carrier's new state; return its pull on the hook, north, east, down [N]."""
        assert self._chain_state is not None
        before = self._velocity_e
        self._velocity_e, rot_ne = _hook(np.array(state), self._arm_b)
        self._update_air(state, rot_ne, (self._velocity_e - before) / self._step_s, self._steps + 1)
        numbers = self.chain.constants
        advance(numbers, self._chain_state, self._air, self._step_s, self._logged)
        self._steps += 1
        least, most = float(self._logged[0, 2]), float(self._logged[0, 3])
        self._least, self._most = min(self._least, least), max(self._most, most)
        if self._slack is None and least < 0.0:
            self._slack = self._steps - 1  # the tensions are those at the beginning of the step
        if self._steps % self._per_row == 0:
            self._log()
        taken_up = min(1.0, self._steps * self._step_s / RAMP_S)
        north, east, down = taken_up * (rot_ne @ pull_on_hook(numbers, self._chain_state, self._air[2]))
        return float(north), float(east), float(down)

    def _update_air(self, state: CarrierState, rot_ne: np.ndarray, acceleration_e: np.ndarray, steps: int) -> None:
        """Update air and apparent gravity after a number of steps; at a step's middle they are the mean of its ends."""
        if steps % GRAVITY_STEPS == 0:
            self._gravity = float(gravity_n(state.lat, state.alt)[2])
        velocity = self._velocity_e
        coriolis = 2.0 * SPIN_RADPS * np.array([-velocity[1], velocity[0], 0.0])
        wind_n = np.array([state.wind_north, state.wind_east, state.wind_down])
        self._air[0] = self._air[2]
        end = self._air[2]
        end[:3] = self._gravity * rot_ne[2] - acceleration_e - coriolis
        end[3:6] = wind_n @ rot_ne - velocity
        end[6:9] = end[3:6] + self._gust(steps * self._step_s) @ rot_ne
        end[9] = standard_density(state.alt)
        # the acceleration is constant over the step
        self._air[0, :3] = end[:3]
        self._air[1] = 0.5 * (self._air[0] + end)

    def _gust(self, time_s: float) -> np.ndarray:
        """Return the gust at a time since the beginning, linear between its knots, (3,) [m/s]."""
        place = time_s * GUST_HZ
        index = int(place)
        while len(self._drawn) < index + 2:
            self._drawn.append(next(self._gusts))
        part = place - index
        return (1.0 - part) * self._drawn[index] + part * self._drawn[index + 1]

    def _log(self) -> None:
        """Append a row to the log, in the order of ``BirdMotion``."""
        assert self._chain_state is not None
        body = 6 * (self.chain.links - 1)
        self._rows.extend(self._chain_state[body:])
        self._rows.extend(nodes_of(self.chain, self._chain_state)[-1])
        self._rows.extend(self._logged[0, :2])

    def flown(self, start_s: float, stop_s: float, zero_s: float, log_hz: int) -> BirdMotion:
        """Return the motion between two times of the carrier's clock, with the time counted from ``zero_s``."""
        table = np.frombuffer(self._rows, dtype=float).reshape(-1, 18)
        time_s = np.arange(len(table)) / log_hz
        rows = (time_s >= start_s - 1e-9) & (time_s <= stop_s + 1e-9)
        return BirdMotion.of(
            time_s[rows] - zero_s,
            table[rows],
            least_n=self._least,
            most_n=self._most,
            begun_s=-zero_s,
            slack_s=None if self._slack is None else self._slack * self._step_s - zero_s,
            lost_s=None,
        )


@compiled
def _hook(state: np.ndarray, arm_b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the velocity of the hook along Earth-fixed axes, and the rotation from these to north, east, down."""
    lat, lon = state[0], state[1]
    sp, cp, sl, cl = math.sin(lat), math.cos(lat), math.sin(lon), math.cos(lon)
    rot_ne = np.array([[-sp * cl, -sp * sl, cp], [-sl, cl, 0.0], [-cp * cl, -cp * sl, -sp]])
    sr, cr, sh, ch = math.sin(state[6]), math.cos(state[6]), math.sin(state[8]), math.cos(state[8])
    st, ct = math.sin(state[7]), math.cos(state[7])
    p, q, r = state[9], state[10], state[11]
    x = q * arm_b[2] - r * arm_b[1]
    y = r * arm_b[0] - p * arm_b[2]
    z = p * arm_b[1] - q * arm_b[0]
    north = state[3] + ct * ch * x + (sr * st * ch - cr * sh) * y + (cr * st * ch + sr * sh) * z
    east = state[4] + ct * sh * x + (sr * st * sh + cr * ch) * y + (cr * st * sh - sr * ch) * z
    down = state[5] - st * x + sr * ct * y + cr * ct * z
    velocity = np.empty(3)
    for c in range(3):
        velocity[c] = rot_ne[0, c] * north + rot_ne[1, c] * east + rot_ne[2, c] * down
    return velocity, rot_ne

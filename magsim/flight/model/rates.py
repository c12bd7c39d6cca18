"""JSBSim's integrators and the rate of the log, by the damping of an aircraft's rotation."""

import math

from magsim.aircraft.facts import Facts
from magsim.aircraft.kinematic import KinematicFacts
from magsim.errors import RequestError
from magsim.flight.model.aero import derivatives, inertia
from magsim.units import RHO0

INTEGRATORS = {"rate/rotational": 4, "position/rotational": 7, "rate/translational": 3, "position/translational": 4}
"""JSBSim's integrators: 3 is Adams-Bashforth of second order, 4 of third, 7 is Buss's augmented second-order step.

JSBSim's defaults for rotation are Euler's rule, which is wrong by degrees after half a minute of tumbling
(NESC check case Atmos_02). More than third order does not help either: turbulence changes the moments from step to
step, and Adams-Bashforth of fifth order for both groups turns that into a zigzag of the attitude that a log below the
step rate cannot resolve, four times larger than with these two.
A small aircraft, whose rotation is damped within a few steps, needs a lower order: see ``integrators_for``.
"""

ADAMS_BASHFORTH = ((9, 0.163), (5, 0.300), (4, 0.545), (3, 1.000))
"""JSBSim's number of each Adams-Bashforth scheme, orders 5 to 2, and its largest stable step times damping.

The ends of the intervals of absolute stability are those of Hairer and Wanner, Solving ODE II, V.1: 1, 6/11, 3/10 and
90/551.
"""
LOOP_FACTOR = 2.5
"""By how much the autopilot's loops may be faster than the damping of the airframe alone."""

LOG_RATES_HZ = (30, 60, 120, 240)
"""An aircraft gets the first of these that is high enough and divides the step rate."""
ROWS_PER_DECAY = 2.0
"""Rows of the log in the time in which the fastest motion dies away to 1/e.

In turbulence of severity 3 that leaves less than 0.002 degree between the rows (tests/benchmarks/flight_speed.py).
"""


def fastest_decay(facts: Facts) -> float:
    """Return the inverse of an airframe's shortest time constant [1/s].

    It is that of its roll, ``rho V S b^2 |Cl_p| / (4 Ixx)``, or of its pitch: a few 1/s for a Cessna, 20 1/s for a
    drone of 10 kg. It is taken at the highest speed at sea level, so that an aircraft has one value for all flights.
    """
    d, moments, geometry = derivatives(facts), inertia(facts), facts.geometry
    flow = RHO0 * facts.limits.speed_mps[1] * geometry.wing_area.value / 4.0
    roll = flow * geometry.span.value**2 * abs(d.roll_p) / moments.xx
    pitch = flow * geometry.mean_chord.value**2 * abs(d.cm_q + d.cm_alphadot) / moments.yy
    return max(roll, pitch)


def integrators_for(facts: Facts, step_hz: int) -> dict[str, int]:
    """Return JSBSim's integrators for an aircraft: the rates of rotation by the highest stable order.

    The higher the order of an Adams-Bashforth scheme, the less damping in a step it tolerates.

    Raises
    ------
    RequestError
        If no scheme is stable at that rate.
    """
    decay = LOOP_FACTOR * fastest_decay(facts)
    numbers = [number for number, _ in ADAMS_BASHFORTH]
    upto = ADAMS_BASHFORTH[numbers.index(INTEGRATORS["rate/rotational"]) :]
    order = next((number for number, bears in upto if decay <= bears * step_hz), None)
    if order is None:
        least = math.ceil(decay / ADAMS_BASHFORTH[-1][1])
        msg = f"flight.step_hz: {step_hz} steps a second are too few for {facts.title}; allowed: at least {least}"
        raise RequestError(msg)
    return INTEGRATORS | {"rate/rotational": order}


def log_rate_hz(facts: Facts | KinematicFacts, step_hz: int) -> int:
    """Return the log rate [Hz] that resolves an aircraft's attitude in turbulence, up to the step rate."""
    needed = 0.0 if isinstance(facts, KinematicFacts) else ROWS_PER_DECAY * fastest_decay(facts)
    fitting = [rate for rate in LOG_RATES_HZ if step_hz % rate == 0]
    return next((rate for rate in fitting if rate >= needed), fitting[-1])

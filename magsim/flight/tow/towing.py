"""Towing a bird through a finished flight of its carrier."""

import math

import numpy as np

from magsim.aircraft import Aircraft, Bird
from magsim.earth.wgs84 import geodetic_from_ecef, quaternion_en_at, rot_ne_at, transport_rate
from magsim.errors import DataError, RequestError
from magsim.flight.tow.chain import Chain
from magsim.flight.tow.equilibrium import Equilibrium, hanging_state
from magsim.flight.tow.hook import Hook, gusts_n
from magsim.flight.tow.integration import integrate
from magsim.flight.tow.modes import modes
from magsim.flight.tow.motion import BirdMotion
from magsim.flight.tow.setup import chain_of, hook_of, require_equilibrium
from magsim.frames import (
    attitude_from_quaternion_nb,
    quaternion_inverse,
    quaternion_product,
    rot_nb_from_attitude,
    rotate,
    rotate_back,
)
from magsim.scenario import Scenario, Tow
from magsim.trajectory import Flight, Trajectory

LOG_HZ = 30
"""Rows of the bird's log: its fastest motion, the roll about its bridle, has 1.6 cycles a second."""

STEPS_HZ = (120, 240, 480, 960, 1920)
"""Steps a second: the first of them that the tension of the rope allows."""

SLOW_HZ = 3.0
"""Modes below this are noted: pendulum, pitch, yaw and roll of the bird."""

MARGIN = 1.25
"""Stable tension of a step rate over the largest tension of the flight."""


def tow_bird(
    flight: Flight,
    scenario: Scenario,
    aircraft: Aircraft,
    bird: Bird,
    flown: BirdMotion | None = None,
) -> Flight:
    """Add a bird to a flight.

    Parameters
    ----------
    flight : Flight
        Its log reaches ``tow.settle_s`` further back than the rows need.
    scenario : Scenario
        With a tow.
    aircraft : Aircraft
    bird : Bird
    flown : BirdMotion, optional
        Motion of a bird that pulled on the carrier; without it, the bird is integrated here and does not pull.

    Returns
    -------
    Flight
        With ``bird`` and ``rope``, over the carrier's whole log.

    Raises
    ------
    RequestError
        If the chain has no equilibrium, or the given step rate is too low.
    DataError
        If the rope goes slack, the bird leaves its model, or the motion diverges.
    """
    tow = scenario.tow
    assert tow is not None
    begun_s = float(flight.carrier.time_s[0]) if flown is None else flown.begun_s
    hook = hook_under(flight.carrier, scenario, aircraft, flight.wind_n, begun_s)
    first = hook.calm(float(flight.carrier.time_s[0]))
    speed, density = float(np.linalg.norm(first[3:6])), float(first[9])
    equilibrium = require_equilibrium(tow, bird, speed, density)
    chain, step_hz = chain_of(tow, bird), scenario.flight.step_hz
    if flown is None:
        flown, step_hz = integrate_under(flight.carrier, hook, chain, equilibrium, tow.step_hz)
    _check(flown, chain, tow, step_hz)
    path = trajectory(flown, hook, bird.facts.cg_t)
    _check_flow(path, flown, hook, math.radians(bird.facts.limits.flow_angle.value))
    every = modes(chain, equilibrium, speed, density)
    slow = sorted(mode for mode in every if 0.0 < mode.frequency_hz < SLOW_HZ)
    notes = {
        "bird": bird.name,
        "coupling": tow.coupling,
        "rope_m": chain.rope.length_m,
        "links": chain.links,
        "mass_kg": chain.body.mass_kg,
        "step_hz": step_hz,
        "log_hz": round(path.rate_hz),
        "steady_trail_deg": math.degrees(equilibrium.trail),
        "steady_pitch_deg": math.degrees(equilibrium.pitch),
        "modes_hz": [mode.frequency_hz for mode in slow],
        "modes_damping": [mode.damping for mode in slow],
        "least_tension_n": flown.least_n,
        "most_tension_n": flown.most_n,
    }
    return flight.with_bird(path, rope_angles(flown, hook), {"tow": notes})


def integrate_under(
    carrier: Trajectory, hook: Hook, chain: Chain, equilibrium: Equilibrium, given_hz: int | None = None
) -> tuple[BirdMotion, int]:
    """Integrate a bird under a carrier that it does not pull on; return the motion and the step rate [Hz].

    Parameters
    ----------
    carrier : Trajectory
        Its first and last times are those of the motion.
    hook : Hook
    chain : Chain
    equilibrium : Equilibrium
        Of the start.
    given_hz : int, optional
        Steps a second; without it the fewest of ``STEPS_HZ`` that the tension allows.
    """
    start_s, last_s = float(carrier.time_s[0]), float(carrier.time_s[-1])
    least_n = MARGIN * float(equilibrium.tension_n.max())
    fitting = [rate for rate in STEPS_HZ if chain.stable_tension_n(rate) >= least_n] or STEPS_HZ[-1:]
    state = hanging_state(chain, equilibrium, hook.calm(start_s))
    for step_hz in fitting if given_hz is None else (given_hz,):
        flown = integrate(
            [chain],
            [state],
            [hook.air],
            start_s=start_s,
            duration_s=[last_s - start_s],
            step_hz=step_hz,
            log_hz=LOG_HZ,
        )[0]
        if flown.lost_s is None and MARGIN * flown.most_n <= chain.stable_tension_n(step_hz):
            break
    return flown, step_hz


def hook_under(
    carrier: Trajectory, scenario: Scenario, aircraft: Aircraft, wind_n: np.ndarray | None, begun_s: float
) -> Hook:
    """Build the hook of a scenario's carrier, with the air along its path.

    Parameters
    ----------
    carrier : Trajectory
        With n rows.
    scenario : Scenario
    aircraft : Aircraft
    wind_n : (n, 3) [m/s], optional
        Without it, the wind of the scenario.
    begun_s : float [s]
        Time of the bird's first gust.
    """
    tow = scenario.tow
    assert tow is not None
    steady_n = np.array([scenario.air.wind_north_mps, scenario.air.wind_east_mps, 0.0])
    wind = np.tile(steady_n, (len(carrier), 1)) if wind_n is None else wind_n
    gust = gusts_n(tow.gusts, carrier.time_s, begun_s, scenario.start.speed_mps, scenario.seed)
    return Hook(carrier, np.array(hook_of(tow, aircraft)), wind, gust)


def trajectory(flown: BirdMotion, hook: Hook, cg_t: tuple[float, float, float]) -> Trajectory:
    """Convert the motion of the bird below the hook to that over the Earth.

    Parameters
    ----------
    flown : BirdMotion
    hook : Hook
    cg_t : (3,) [m]
        Center of gravity of the bird from its datum, bird axes.
    """
    place_e = hook.place_e(flown.time_s) + flown.place_m
    lat, lon, alt = geodetic_from_ecef(place_e)
    lon = np.unwrap(lon)
    rot_ne = rot_ne_at(lat, lon)
    velocity_n = rotate(rot_ne, hook.velocity_e(flown.time_s) + flown.velocity_mps)
    local = quaternion_product(quaternion_inverse(quaternion_en_at(lat, lon)), flown.quaternion)
    attitude = attitude_from_quaternion_nb(local)
    attitude[:, 2] = np.unwrap(attitude[:, 2])
    turning_n = transport_rate(lat, alt, velocity_n)
    rate_b = flown.rate_b - rotate_back(rot_nb_from_attitude(attitude), turning_n)
    return Trajectory(flown.time_s, lat, lon, alt, velocity_n, attitude, rate_b, np.array(cg_t))


def rope_angles(flown: BirdMotion, hook: Hook) -> dict[str, np.ndarray]:
    """Return the angles of the straight line from hook to bridle, along the carrier's course, and the tension.

    Returns
    -------
    dict of str to (n,)
        ``trail_rad``, aft of the vertical, and ``side_rad``, right of it, both as projections; ``tension_n`` at the
        hook.
    """
    lat, lon, _ = geodetic_from_ecef(hook.place_e(flown.time_s))
    rot_ne = rot_ne_at(lat, lon)
    north, east, down = rotate(rot_ne, flown.bridle_m).T
    v_north, v_east, _ = rotate(rot_ne, hook.velocity_e(flown.time_s)).T
    speed = np.hypot(v_north, v_east)
    ahead, right = (north * v_north + east * v_east) / speed, (east * v_north - north * v_east) / speed
    return {
        "trail_rad": np.arctan2(-ahead, down),
        "side_rad": np.arctan2(right, down),
        "tension_n": flown.tension_n[:, 0],
    }


def _check(flown: BirdMotion, chain: Chain, tow: Tow, step_hz: int) -> None:
    """Refuse a flight with too low a step rate, with a slack rope, or with a diverged motion."""
    stable = chain.stable_tension_n(step_hz)
    unstable = flown.lost_s is not None or flown.most_n > stable
    key = "flight.step_hz" if tow.coupling == "two_way" else "tow.step_hz" if tow.step_hz else ""
    if unstable and key:
        what = f"was lost at t = {flown.lost_s:.1f} s" if flown.lost_s is not None else f"took {flown.most_n:.0f} N"
        msg = (
            f"{key}: {step_hz} steps a second bear {stable:.0f} N in a rope of {chain.links} links, but it "
            f"{what}; allowed: more steps, or fewer links"
        )
        raise RequestError(msg)
    # a step rate too low even for the tension at rest makes the rope slack before it diverges
    if flown.slack_s is not None and flown.tension_n[0].max() <= stable:
        msg = (
            f"the rope went slack at t = {flown.slack_s:.1f} s: the hook moved down or turned faster than the bird "
            f"falls; allowed: gentler maneuvers and gusts, less bank, or a heavier bird than {chain.body.mass_kg:g} kg"
        )
        raise DataError(msg)
    if unstable:
        when = "" if flown.lost_s is None else f" at t = {flown.lost_s:.1f} s"
        msg = (
            f"the swing of the bird diverged{when}: {step_hz} steps a second bear {stable:.0f} N in a rope of "
            f"{chain.links} links of {chain.rope.mass_per_m:g} kg/m; allowed: fewer links, or a heavier rope"
        )
        raise DataError(msg)


def _check_flow(path: Trajectory, flown: BirdMotion, hook: Hook, most: float) -> None:
    """Refuse a bird with a flow angle outside its model."""
    rot_ne = rot_ne_at(path.lat_rad, path.lon_rad)
    air_n = rotate(rot_ne, hook.air(flown.time_s)[:, 6:9] - flown.velocity_mps)
    flow_b = rotate_back(rot_nb_from_attitude(path.attitude), air_n)
    angle = np.arctan2(np.hypot(flow_b[:, 1], flow_b[:, 2]), -flow_b[:, 0])
    over = angle > most
    if over.any():
        row = int(over.argmax())
        msg = (
            f"the air met the bird {math.degrees(angle[row]):.0f} deg off its axis at t = {flown.time_s[row]:.1f} s; "
            f"allowed: up to {math.degrees(most):.0f} deg, by gentler gusts and turns or more speed"
        )
        raise DataError(msg)

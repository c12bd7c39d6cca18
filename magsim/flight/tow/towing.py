"""Towing a bird through a finished flight of its carrier."""

import math

import numpy as np

from magsim.aircraft import Aircraft, Bird
from magsim.earth.wgs84 import geodetic_from_ecef, quaternion_en_at, rot_ne_at, transport_rate
from magsim.errors import DataError, RequestError
from magsim.flight.tow.chain import Line
from magsim.flight.tow.equilibrium import Steady, hanging
from magsim.flight.tow.hook import Hook, gusts_n
from magsim.flight.tow.integration import swing
from magsim.flight.tow.modes import modes
from magsim.flight.tow.motion import Swing
from magsim.flight.tow.setup import equilibrium, hook_of, line_of
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
"""Modes below this are noted: swing, pitch, yaw and roll of the bird."""

MARGIN = 1.25
"""The tension that a step rate bears over the largest that was met."""


def tow_bird(
    flight: Flight,
    scenario: Scenario,
    aircraft: Aircraft,
    bird: Bird,
    flown: Swing | None = None,
) -> Flight:
    """The same flight with a bird under it.

    Parameters
    ----------
    flight : Flight
        Its log reaches ``tow.settle_s`` further back than the rows need.
    scenario : Scenario
        With a tow.
    aircraft : Aircraft
    bird : Bird
    flown : Swing, optional
        How the bird swung while it pulled on the carrier; without it, the bird is flown here and does not pull.

    Returns
    -------
    Flight
        With ``bird`` and ``rope``, over the carrier's whole log.

    Raises
    ------
    RequestError
        If the line cannot hang, or the steps asked for are too few.
    DataError
        If the rope goes slack, the bird leaves its model, or the numbers are lost.
    """
    tow = scenario.tow
    assert tow is not None
    begun_s = float(flight.carrier.time_s[0]) if flown is None else flown.begun_s
    hook = hook_under(flight.carrier, scenario, aircraft, flight.wind_n, begun_s)
    first = hook.calm(float(flight.carrier.time_s[0]))
    speed, density = float(np.linalg.norm(first[3:6])), float(first[9])
    found = equilibrium(tow, bird, speed, density)
    line, step_hz = line_of(tow, bird), scenario.flight.step_hz
    if flown is None:
        flown, step_hz = swing_under(flight.carrier, hook, line, found, tow.step_hz)
    _check(flown, line, tow, step_hz)
    path = trajectory(flown, hook, bird.facts.cg_t)
    _check_flow(path, flown, hook, math.radians(bird.facts.limits.flow_angle.value))
    every = modes(line, found, speed, density)
    slow = sorted(mode for mode in every if 0.0 < mode.frequency_hz < SLOW_HZ)
    notes = {
        "bird": bird.name,
        "coupling": tow.coupling,
        "rope_m": line.rope.length_m,
        "links": line.links,
        "mass_kg": line.body.mass_kg,
        "step_hz": step_hz,
        "log_hz": round(path.rate_hz),
        "steady_trail_deg": math.degrees(found.trail),
        "steady_pitch_deg": math.degrees(found.pitch),
        "modes_hz": [mode.frequency_hz for mode in slow],
        "modes_damping": [mode.damping for mode in slow],
        "least_tension_n": flown.least_n,
        "most_tension_n": flown.most_n,
    }
    return flight.with_bird(path, rope_angles(flown, hook), {"tow": notes})


def swing_under(
    carrier: Trajectory, hook: Hook, line: Line, found: Steady, asked_hz: int | None = None
) -> tuple[Swing, int]:
    """How a bird swings under a carrier that it does not pull on, and the steps a second [Hz] that this took.

    Parameters
    ----------
    carrier : Trajectory
        Its first and last times are those of the swing.
    hook : Hook
    line : Line
    found : Steady
        The equilibrium in which it begins.
    asked_hz : int, optional
        Steps a second; without it the fewest of ``STEPS_HZ`` that the tension allows.
    """
    start_s, last_s = float(carrier.time_s[0]), float(carrier.time_s[-1])
    least_n = MARGIN * float(found.tension_n.max())
    fitting = [rate for rate in STEPS_HZ if line.stable_tension_n(rate) >= least_n] or STEPS_HZ[-1:]
    state = hanging(line, found, hook.calm(start_s))
    for step_hz in fitting if asked_hz is None else (asked_hz,):
        flown = swing(
            [line],
            [state],
            [hook.air],
            start_s=start_s,
            duration_s=[last_s - start_s],
            step_hz=step_hz,
            log_hz=LOG_HZ,
        )[0]
        if flown.lost_s is None and MARGIN * flown.most_n <= line.stable_tension_n(step_hz):
            break
    return flown, step_hz


def hook_under(
    carrier: Trajectory, scenario: Scenario, aircraft: Aircraft, wind_n: np.ndarray | None, begun_s: float
) -> Hook:
    """The hook of a scenario's carrier, with the air that it meets.

    Parameters
    ----------
    carrier : Trajectory
        With n rows.
    scenario : Scenario
    aircraft : Aircraft
    wind_n : (n, 3) [m/s], optional
        Without it, the wind of the scenario.
    begun_s : float [s]
        When the bird met the first of its gusts.
    """
    tow = scenario.tow
    assert tow is not None
    steady_n = np.array([scenario.air.wind_north_mps, scenario.air.wind_east_mps, 0.0])
    wind = np.tile(steady_n, (len(carrier), 1)) if wind_n is None else wind_n
    gust = gusts_n(tow.gusts, carrier.time_s, begun_s, scenario.start.speed_mps, scenario.seed)
    return Hook(carrier, np.array(hook_of(tow, aircraft)), wind, gust)


def trajectory(flown: Swing, hook: Hook, cg_t: tuple[float, float, float]) -> Trajectory:
    """Motion of the bird over the Earth from its motion below the hook.

    Parameters
    ----------
    flown : Swing
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


def rope_angles(flown: Swing, hook: Hook) -> dict[str, np.ndarray]:
    """Angles of the straight line from hook to bridle, as seen along the carrier's course over ground; tension.

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


def _check(flown: Swing, line: Line, tow: Tow, step_hz: int) -> None:
    """Refuse a flight whose steps were too few, whose rope was slack, or whose numbers were lost."""
    stable = line.stable_tension_n(step_hz)
    unstable = flown.lost_s is not None or flown.most_n > stable
    key = "flight.step_hz" if tow.coupling == "two_way" else "tow.step_hz" if tow.step_hz else ""
    if unstable and key:
        what = f"was lost at t = {flown.lost_s:.1f} s" if flown.lost_s is not None else f"took {flown.most_n:.0f} N"
        msg = (
            f"{key}: {step_hz} steps a second bear {stable:.0f} N in a rope of {line.links} links, but it "
            f"{what}; allowed: more steps, or fewer links"
        )
        raise RequestError(msg)
    # steps too few even for what it takes at rest shake a rope slack before they lose it
    if flown.slack_s is not None and flown.tension_n[0].max() <= stable:
        msg = (
            f"the rope went slack at t = {flown.slack_s:.1f} s: the hook moved down or turned faster than the bird "
            f"falls; allowed: gentler maneuvers and gusts, less bank, or a heavier bird than {line.body.mass_kg:g} kg"
        )
        raise DataError(msg)
    if unstable:
        when = "" if flown.lost_s is None else f" at t = {flown.lost_s:.1f} s"
        msg = (
            f"the swing of the bird diverged{when}: {step_hz} steps a second bear {stable:.0f} N in a rope of "
            f"{line.links} links of {line.rope.mass_per_m:g} kg/m; allowed: fewer links, or a heavier rope"
        )
        raise DataError(msg)


def _check_flow(path: Trajectory, flown: Swing, hook: Hook, most: float) -> None:
    """Refuse a bird that the air meets from where its model ends."""
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

"""The survey autopilot as JSBSim system XML: inner loops, height, heading and speed loops, swings of maneuvers.

All loops run at the step rate inside JSBSim; Python sets set points ten times a second. Those of ``RAMPED`` come with
a rate and a time, and every step takes its own value of the ramp: a staircase of ten steps a second would shake the
controls, and alias onto the rows of a recording. The swings of maneuvers are cubics of that time (``swing_of``).
Properties that Python writes are in ``INPUTS``. Angles are in radians, times in seconds, height and speed in feet
(JSBSim's units); commands of surfaces are normalized by the larger travel.

The loops, with V the true airspeed, s and c the swing of an axis and its derivative, I[.] clipped integrals::

    path       e_gam = hold_h (clip(k_h (h_set - h)) + climb - hdot) / V
               gam = clip(k_g e_gam + I[e_gam]) + hold_h climb / V
    pitch      e_th = theta_0 + gam + turn + flaps + s_pitch - theta
               elevator = elevator_s - (k_q (k_th e_th + c - thetadot) + I[e_th])
    heading    bank = clip(k_c V/g hold clip(psi_set - psi) + bank_ff)
    roll       e_phi = bank + s_roll - phi
               aileron = k_p (k_phi e_phi + c - phidot) + I[e_phi]
    turn       rudder_t = -k_r ((g/V) tan(phi) - psidot)
    yaw held   rudder_y = -k_y (k_psi (psi_set + s_yaw - psi) + c - psidot)
               rudder = rudder_t + hold_y (rudder_y - rudder_t)
    speed      throttle = clip(k_v e_v + I[e_v])

``elevator_s`` flies the pitch swing by itself (``_swing_elevator``): loops alone would be late, and leave a tail.
The holds are shares from 0 to 1 by which the guidance fades height hold, heading hold and yaw hold in and out; an
integral whose error is faded out keeps its value. Headings psi are those of grid north near the poles
(``magsim.earth.grid``). Every error is multiplied by ``ap/on``, which is 0 while the model is trimmed.
"""

import math
from collections.abc import Callable

from magsim.aircraft.facts import Facts
from magsim.flight.model.aero import derivatives, inertia
from magsim.units import FT, G0, LBF

AXES = ("pitch", "roll", "yaw")

RAMPED = (
    "ap/hold-height",
    "ap/height-ft",
    "ap/climb-fps",
    "ap/hold-heading",
    "ap/heading-rad",
    "ap/bank-rad",
    "ap/hold-yaw",
)
"""Set points that move: each is its value at ``RAMP_START`` plus its rate, ``rate_of``, times the time since."""

RAMP_START = "ap/ramp-start-s"
SWING_ALPHA = "ap/pitch/swing-alpha-rad"


def rate_of(name: str) -> str:
    """Return the property of the rate of a ramped set point, in its unit for each second."""
    return f"{name}-per-s"


def swing_of(axis: str) -> tuple[str, str, str, str]:
    """Return the properties of an axis's swing at ``RAMP_START``: the angle and its first three derivatives.

    Between two times of the guidance the angle is the cubic of these; the guidance joins them without a step of the
    angle or its rate.
    """
    angle, rate, second, third = (f"ap/{axis}/swing-{unit}" for unit in ("rad", "rad_sec", "rad_sec2", "rad_sec3"))
    return angle, rate, second, third


INPUTS = (
    *RAMPED,
    *(rate_of(name) for name in RAMPED),
    *(name for axis in AXES for name in swing_of(axis)),
    RAMP_START,
    "ap/on",
    "ap/theta-rad",
    "ap/grid-norm",
    "ap/speed-fps",
    "ap/flap-rad",
    "ap/flap-lift-norm",
)


def system_xml(facts: Facts) -> str:
    """Write the autopilot and the actuators of an aircraft, for JSBSim."""
    inputs = dict.fromkeys(INPUTS, 0.0)
    inputs |= {f"ap/integral/{name}": 0.0 for name in ("path", "pitch", "roll", "speed")} | {SWING_ALPHA: 0.0}
    declared = "".join(f' <property value="{value!r}">{name}</property>\n' for name, value in inputs.items())
    swings = "".join(_swing(axis) for axis in AXES)
    return f"""<?xml version="1.0"?>
<system name="survey autopilot">
{declared} <channel name="ramps">
{_define("ap/ramp-s", _difference("simulation/sim-time-sec", RAMP_START))} </channel>
 <channel name="swings">
{swings} </channel>
 <channel name="vertical">
{_vertical(facts)} </channel>
 <channel name="lateral">
{_lateral(facts)} </channel>
 <channel name="surfaces">
{_surfaces(facts)} </channel>
</system>
"""


def _tag(name: str) -> Callable[..., str]:
    def build(*parts: object) -> str:
        return f"<{name}>{''.join(_part(p) for p in parts)}</{name}>"

    return build


def _part(part: object) -> str:
    """Write a number as a value and a name as a property; XML stays unchanged."""
    if isinstance(part, int | float):
        return f"<value>{float(part)!r}</value>"
    text = str(part)
    return text if text.startswith("<") else f"<property>{text}</property>"


_sum, _difference, _product, _quotient = _tag("sum"), _tag("difference"), _tag("product"), _tag("quotient")
_min, _max, _cos, _tan, _fmod = _tag("min"), _tag("max"), _tag("cos"), _tag("tan"), _tag("fmod")
_pow = _tag("pow")


def _ramped(name: str) -> str:
    """Write a set point at the time of the step."""
    return _sum(name, _product(rate_of(name), "ap/ramp-s"))


def _clip(value: object, limit: float) -> str:
    return _max(-limit, _min(limit, value))


def _define(output: str, expression: str) -> str:
    """Write one component of the flight control system: a function of properties."""
    name = output.replace("/", " ")
    return f'  <fcs_function name="{name}"><function>{expression}</function><output>{output}</output></fcs_function>\n'


def _integral(name: str, gain: float, error: str, limit: float) -> str:
    """Write a clipped integral by Euler's rule, which holds its value while the error is gated to zero."""
    own = f"ap/integral/{name}"
    return _define(own, _clip(_sum(own, _product(gain, "simulation/dt", error)), limit))


def _swing(axis: str) -> str:
    """Write angle, rate and acceleration of an axis's swing at the time of the step: a cubic, by Horner's rule."""
    angle, rate, second, third = swing_of(axis)
    cubic = _sum(second, _product("ap/ramp-s", third, 1.0 / 3.0))
    turning = _sum(rate, _product("ap/ramp-s", 0.5, cubic))
    bend = _sum(second, _product("ap/ramp-s", 0.5, third))
    text = _define(f"ap/{axis}/angle-rad", _sum(angle, _product("ap/ramp-s", turning)))
    text += _define(f"ap/{axis}/rate-rad_sec", _sum(rate, _product("ap/ramp-s", bend)))
    if axis == "pitch":
        text += _define("ap/pitch/rate-rad_sec2", _sum(second, _product("ap/ramp-s", third)))
    return text


def _least_speed(facts: Facts) -> float:
    """Return an airspeed [m/s] below which nothing flies: a floor for divisions, also at JSBSim's start."""
    return 0.4 * facts.limits.speed_mps[0]


def _airspeed(facts: Facts) -> str:
    """Write the true airspeed [ft/s]."""
    return _max(_least_speed(facts) / FT, "velocities/vt-fps")


def _pressure(facts: Facts) -> str:
    """Write the dynamic pressure [lbf/ft^2]."""
    least = 0.5 * facts.aero.cruise_density.value * _least_speed(facts) ** 2
    return _max(least * FT**2 / LBF, "aero/qbar-psf")


def _vertical(facts: Facts) -> str:
    """Write the loops of height, path, pitch and speed."""
    gains = facts.autopilot
    speed = _airspeed(facts)
    back = _clip(
        _product(gains.altitude.value, _difference(_ramped("ap/height-ft"), "position/geod-alt-ft")),
        gains.climb_limit.value / FT,
    )
    # The planned climb is commanded directly; the loops only correct the remaining error.
    share = _product("ap/on", _ramped("ap/hold-height"))
    planned = _quotient(_product("ap/hold-height-norm", _ramped("ap/climb-fps")), speed)
    climb = _sum(back, _ramped("ap/climb-fps"))
    path_error = _quotient(_product("ap/hold-height-norm", _difference(climb, "velocities/h-dot-fps")), speed)
    steered = _sum(_product(gains.path.value, "ap/path-error-rad"), "ap/integral/path")
    path = _sum(_clip(steered, gains.path_limit.value), planned)
    # In a turn the wing must lift 1/cos(bank) times the weight: more pitch at once, without waiting for the height.
    weight_alpha = facts.mass_kg * G0 / LBF / derivatives(facts).cl_alpha
    alpha = _quotient(weight_alpha, _product(_pressure(facts), "metrics/Sw-sqft"))
    turn = _product(alpha, _difference(_quotient(1.0, _cos("ap/bank-command-rad")), 1.0))
    parts = ["ap/theta-rad", "ap/path-rad", turn, "ap/pitch/angle-rad"]
    if facts.controls.flap:
        # Lift that moving flaps add beyond that of the trim is removed from the wing, as a pilot would do.
        added = _difference("ap/flap-lift-norm", "aero/coefficient/cl-flap")
        parts.append(_quotient(added, derivatives(facts).cl_alpha))
    wanted = _sum(*parts)
    rate = _sum(
        _product(gains.pitch.value, "ap/pitch-error-rad"),
        "ap/pitch/rate-rad_sec",
        _product(-1.0, "velocities/thetadot-rad_sec"),
    )
    corrected = _product("ap/on", _sum(_product(gains.pitch_rate.value, rate), "ap/integral/pitch"))
    speed_error = _product("ap/on", _difference("ap/speed-fps", "velocities/vt-fps"))
    throttle = _clip(_sum(_product(gains.speed.value * FT, "ap/speed-error-fps"), "ap/integral/speed"), 1.0)
    return (
        _define("ap/hold-height-norm", share)
        + _define("ap/path-error-rad", path_error)
        + _integral("path", gains.path_integral.value, "ap/path-error-rad", gains.path_limit.value)
        + _define("ap/path-rad", path)
        + _define("ap/pitch-error-rad", _product("ap/on", _difference(wanted, "attitude/theta-rad")))
        + _integral("pitch", gains.pitch_integral.value, "ap/pitch-error-rad", gains.pitch_integral_limit.value)
        + _swing_elevator(facts)
        + _define("ap/elevator-norm", _difference("ap/pitch/swing-elevator-norm", corrected))
        + _define("ap/speed-error-fps", speed_error)
        + _integral("speed", gains.speed_integral.value * FT, "ap/speed-error-fps", 1.0)
        + _define("ap/throttle-norm", throttle)
    )


def _swing_elevator(facts: Facts) -> str:
    """Write the elevator that a pitch swing takes, by the linear longitudinal equations about the trim.

    With q and q' the swing's first two derivatives, a its angle of attack, Q the dynamic pressure (Etkin and Reid,
    Dynamics of Flight)::

        Iyy q' = Q S c (Cm_a a + c/(2V) (Cm_q q + Cm_a' a') + Cm_de elevator_s)
        a' = q - (Q S/(m V)) CL - (1 - hold_h) (g/V) ((V/V_set)^2 - 1)

    Lift that a does not make is the tail's, whose moments are known: CL = (CL_a - Cm_a CL_de/Cm_de) a. What of it turns
    the aircraft is left out: q' Iyy/(m V l_t), 0.012 s q' for the Cessna. While no height is held the speed swings, and
    the lift with it.
    """
    effect, geometry = derivatives(facts), facts.geometry
    area, chord = geometry.wing_area.value, geometry.mean_chord.value
    speed, pressure, rate = _airspeed(facts), _pressure(facts), "ap/pitch/rate-rad_sec"
    alpha_rate = "ap/pitch/swing-alpha-rad_sec"
    slope = effect.cl_alpha - effect.cm_alpha * effect.cl_elevator / effect.cm_elevator
    lift = _product(slope * area / facts.mass_kg * LBF / FT**3, pressure, SWING_ALPHA)
    faster = _difference(_pow(_quotient(speed, _max(_least_speed(facts) / FT, "ap/speed-fps")), 2.0), 1.0)
    faster = _product(G0 / FT, _difference("ap/on", "ap/hold-height-norm"), faster)
    damping = _sum(_product(effect.cm_q, rate), _product(effect.cm_alphadot, alpha_rate))
    moment = _sum(_product(effect.cm_alpha, SWING_ALPHA), _quotient(_product(0.5 * chord / FT, damping), speed))
    needed = _quotient(_product(inertia(facts).yy / (area * chord) * FT**2 / LBF, "ap/pitch/rate-rad_sec2"), pressure)
    low, high = facts.controls.elevator.travel.value
    return (
        _define(alpha_rate, _difference(rate, _quotient(_sum(lift, faster), speed)))
        + _define(SWING_ALPHA, _sum(SWING_ALPHA, _product("simulation/dt", alpha_rate)))
        + _define(
            "ap/pitch/swing-elevator-norm",
            _product(1.0 / (effect.cm_elevator * max(-low, high)), _difference(needed, moment)),
        )
    )


def _lateral(facts: Facts) -> str:
    """Write the loops of heading, roll, coordination, and the yaw maneuver."""
    gains = facts.autopilot
    speed = _airspeed(facts)
    # psi lies in 0..2 pi, and so does its set point where the ramp begins; fmod of a positive argument wraps the
    # difference. Near the poles both are counted from grid north: the longitude, -pi..pi, is added or subtracted.
    grid = _product("ap/grid-norm", "position/long-gc-rad")
    turned = _difference(_sum(_ramped("ap/heading-rad"), 5.0 * math.pi), _sum("attitude/psi-rad", grid))
    heading_error = _product("ap/on", _difference(_fmod(turned, 2.0 * math.pi), math.pi))
    course = _product(
        gains.course.value / (G0 / FT),
        _ramped("ap/hold-heading"),
        speed,
        _clip("ap/heading-error-rad", gains.intercept_limit.value),
    )
    bank = _clip(_sum(course, _ramped("ap/bank-rad")), gains.bank_limit.value)
    roll_error = _product("ap/on", _difference(_sum("ap/bank-command-rad", "ap/roll/angle-rad"), "attitude/phi-rad"))
    rate = _sum(
        _product(gains.roll.value, "ap/roll-error-rad"),
        "ap/roll/rate-rad_sec",
        _product(-1.0, "velocities/phidot-rad_sec"),
    )
    aileron = _product("ap/on", _sum(_product(gains.roll_rate.value, rate), "ap/integral/roll"))
    yaw_rate = _sum(
        _product(gains.yaw.value, _sum("ap/heading-error-rad", "ap/yaw/angle-rad")),
        "ap/yaw/rate-rad_sec",
        _product(-1.0, "velocities/psidot-rad_sec"),
    )
    turn_rate = _difference(_quotient(_product(G0 / FT, _tan("attitude/phi-rad")), speed), "velocities/psidot-rad_sec")
    turning = _product(-gains.coordination.value, turn_rate)
    held = _product(-gains.yaw_rate.value, yaw_rate)
    hold = _ramped("ap/hold-yaw")
    rudder = _product("ap/on", _sum(_product(_difference(1.0, hold), turning), _product(hold, held)))
    return (
        _define("ap/heading-error-rad", heading_error)
        + _define("ap/bank-command-rad", bank)
        + _define("ap/roll-error-rad", roll_error)
        + _integral("roll", gains.roll_integral.value, "ap/roll-error-rad", gains.roll_integral_limit.value)
        + _define("ap/aileron-norm", aileron)
        + _define("ap/rudder-norm", rudder)
    )


def _surfaces(facts: Facts) -> str:
    """Write the sum of trim, pilot and autopilot commands, scaled to the larger travel, and the actuators."""
    controls = facts.controls
    lag, rate = controls.actuator_lag.value, controls.actuator_rate.value
    chains = (
        ("elevator", controls.elevator, ("fcs/elevator-cmd-norm", "fcs/pitch-trim-cmd-norm"), "fcs/elevator-pos-rad"),
        ("aileron", controls.aileron, ("fcs/aileron-cmd-norm", "fcs/roll-trim-cmd-norm"), "fcs/left-aileron-pos-rad"),
        ("rudder", controls.rudder, ("fcs/rudder-cmd-norm", "fcs/yaw-trim-cmd-norm"), "fcs/rudder-pos-rad"),
    )
    text = ""
    for name, surface, commands, output in chains:
        low, high = surface.travel.value
        command = f"ap/{name}-rad"
        text += _define(command, _product(max(-low, high), _sum(*commands, f"ap/{name}-norm")))
        text += (
            f'  <actuator name="{name} actuator"><input>{command}</input><lag>{lag!r}</lag>'
            f"<rate_limit>{rate!r}</rate_limit><clipto><min>{low!r}</min><max>{high!r}</max></clipto>"
            f"<output>{output}</output></actuator>\n"
        )
    if controls.flap:
        # A motor of constant rate that stops at its set point.
        step = _product(controls.flap.rate.value, "simulation/dt")
        left = _difference("ap/flap-rad", "fcs/flap-pos-rad")
        moved = _max(_product(-1.0, step), _min(step, left))
        text += _define("fcs/flap-pos-rad", _sum("fcs/flap-pos-rad", moved))
    throttle = _max(0.0, _min(1.0, _sum("fcs/throttle-cmd-norm", "ap/throttle-norm")))
    return text + _define("fcs/throttle-pos-norm", throttle)

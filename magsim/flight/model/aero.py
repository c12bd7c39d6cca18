"""Facts -> stability derivatives and inertias, by textbook formulas.

The formulas are those of preliminary design (lift slope by the Helmbold-DATCOM form, tail volumes, fin as a lifting
surface; Roskam, Airplane Design VI; Etkin and Reid, Dynamics of Flight) with constants from the aircraft file.
Everything here is SI, per radian, about the center of gravity; rates count as ``b/(2V)`` and ``c/(2V)``.
"""

import math
from dataclasses import dataclass

import numpy as np

from magsim.aircraft.facts import Facts
from magsim.flight.model.engines import available_thrust
from magsim.units import G0


@dataclass(frozen=True)
class Derivatives:
    """Stability and control derivatives [1/rad], in the usual notation of flight mechanics."""

    cl_0: float
    cl_alpha: float
    cl_q: float
    cl_alphadot: float
    cl_elevator: float
    cd_0: float
    cd_lift: float
    """Factor of the squared lift coefficient."""
    cd_sideslip: float
    cm_0: float
    cm_alpha: float
    cm_q: float
    cm_alphadot: float
    cm_elevator: float
    neutral_point: float
    """Fraction of the mean chord."""
    cy_beta: float
    cy_p: float
    cy_r: float
    cy_rudder: float
    roll_beta: float
    roll_p: float
    roll_r: float
    roll_aileron: float
    roll_rudder: float
    yaw_beta: float
    yaw_p: float
    yaw_r: float
    yaw_aileron: float
    yaw_rudder: float


@dataclass(frozen=True)
class Inertia:
    """Moments of inertia about the center of gravity, body axes [kg m^2]; ``xz`` is the integral of x z."""

    xx: float
    yy: float
    zz: float
    xz: float


def lift_slope(aspect_ratio: float) -> float:
    """Return the lift slope [1/rad] of a straight wing (Polhamus; USAF DATCOM 4.1.3.2) with section efficiency 0.97."""
    return 2.0 * math.pi * aspect_ratio / (2.0 + math.sqrt((aspect_ratio / 0.97) ** 2 + 4.0))


def inertia(facts: Facts) -> Inertia:
    """Return the moments of inertia by radii of gyration (Roskam, Airplane Design V, ch. 3)."""
    mass, geometry = facts.mass, facts.geometry
    kg, span, length = facts.mass_kg, geometry.span.value, geometry.length.value
    zz = kg * (mass.gyration_yaw.value * (span + length) / 4.0) ** 2
    return Inertia(
        xx=kg * (mass.gyration_roll.value * span / 2.0) ** 2,
        yy=kg * (mass.gyration_pitch.value * length / 2.0) ** 2,
        zz=zz,
        xz=mass.ixz_over_izz.value * zz,
    )


def derivatives(facts: Facts) -> Derivatives:
    """Return the stability derivatives of an aircraft of the usual layout."""
    geometry, aero, mass = facts.geometry, facts.aero, facts.mass
    area, span, chord = geometry.wing_area.value, geometry.span.value, geometry.mean_chord.value
    aspect = span**2 / area
    effectiveness = aero.surface_effectiveness.value

    # Longitudinal: wing, tailplane in its downwash, elevator.
    tail_area, arm = geometry.tailplane_area.value, geometry.tailplane_arm.value
    wing_slope, tail_slope = lift_slope(aspect), lift_slope(geometry.tailplane_span.value**2 / tail_area)
    downwash = aero.downwash_factor.value * 2.0 * wing_slope / (math.pi * aspect)
    pressure = aero.tailplane_efficiency.value
    volume = tail_area * arm / (area * chord)
    cl_alpha = wing_slope + pressure * tail_area / area * tail_slope * (1.0 - downwash)
    neutral = (
        aero.wing_center_chord_fraction.value
        + pressure * volume * tail_slope / cl_alpha * (1.0 - downwash)
        - aero.power_shift_chord_fraction.value
    )
    cl_q = 2.0 * aero.pitch_damping_factor.value * pressure * tail_slope * volume
    cl_alphadot = 2.0 * pressure * tail_slope * volume * downwash
    cl_elevator = pressure * tail_area / area * tail_slope * effectiveness
    cd_lift = 1.0 / (math.pi * aspect * aero.oswald_efficiency.value)

    # Lateral: the fin as a lifting surface, and the parts of body and wing.
    fin_area, fin_arm, fin_up = geometry.fin_area.value, geometry.fin_arm.value, geometry.fin_center_above_cg.value
    fin_slope = lift_slope(aero.fin_aspect_factor.value * geometry.fin_height.value**2 / fin_area)
    fin = -aero.fin_efficiency.value * fin_slope * fin_area / area
    cy_rudder = fin_slope * effectiveness * fin_area / area
    lift = aero.reference_lift.value
    return Derivatives(
        cl_0=aero.lift_at_zero_alpha.value,
        cl_alpha=cl_alpha,
        cl_q=cl_q,
        cl_alphadot=cl_alphadot,
        cl_elevator=cl_elevator,
        cd_0=_drag_at_zero_lift(facts, cd_lift),
        cd_lift=cd_lift,
        cd_sideslip=aero.sideslip_drag.value,
        cm_0=aero.pitch_at_zero_alpha.value,
        cm_alpha=-cl_alpha * (neutral - mass.cg_chord_fraction.value),
        cm_q=-cl_q * arm / chord,
        cm_alphadot=-cl_alphadot * arm / chord,
        cm_elevator=-cl_elevator * arm / chord,
        neutral_point=neutral,
        cy_beta=fin + aero.body_side_force.value,
        cy_p=2.0 * fin * fin_up / span,
        cy_r=-2.0 * fin * fin_arm / span,
        cy_rudder=cy_rudder,
        roll_beta=aero.dihedral_roll.value + aero.high_wing_roll.value + fin * fin_up / span,
        roll_p=aero.roll_damping.value,
        roll_r=lift / 4.0 - 2.0 * fin * fin_up * fin_arm / span**2,
        roll_aileron=aero.aileron_roll.value,
        roll_rudder=cy_rudder * fin_up / span,
        yaw_beta=-fin * fin_arm / span + aero.body_yaw_stiffness.value,
        yaw_p=-lift / 8.0,
        yaw_r=2.0 * fin * (fin_arm / span) ** 2 + aero.body_yaw_damping.value,
        yaw_aileron=aero.aileron_yaw.value,
        yaw_rudder=-cy_rudder * fin_arm / span,
    )


def _drag_at_zero_lift(facts: Facts, cd_lift: float) -> float:
    """Return the drag coefficient that lets the published top speed balance the thrust."""
    aero = facts.aero
    speed = aero.cruise_speed.value
    pressure = 0.5 * aero.cruise_density.value * speed**2
    thrust = available_thrust(facts.engine, speed, aero.cruise_density.value)
    lift = aero.cruise_mass.value * G0 / (pressure * facts.geometry.wing_area.value)
    return thrust / (pressure * facts.geometry.wing_area.value) - cd_lift * lift**2


def lift_curve(facts: Facts) -> tuple[tuple[float, float], ...]:
    """Return points (angle of attack [rad], lift coefficient) from -90 to 90 degrees.

    The straight line of the derivatives inside the linear range, the points of the aircraft file outside it.
    """
    curve, derived = facts.aero.lift_curve, derivatives(facts)
    low, high = facts.aero.lift_linear_range.value
    points = [(math.radians(at), value) for at, value in zip(curve.at, curve.value, strict=True)]
    line = [(a, derived.cl_0 + derived.cl_alpha * a) for a in (low, high)]
    return (*(p for p in points if p[0] < low), *line, *(p for p in points if p[0] > high))


def stall_angle(facts: Facts) -> float:
    """Return the angle of attack of the largest lift [rad]."""
    return max(lift_curve(facts), key=lambda point: point[1])[0]


def bank_below_stall(facts: Facts, speed_mps: float, density: float, part: float) -> float:
    """Return the bank [rad] of a level turn at a part of the largest lift: ``cos(bank) = W / (part L)``; no flaps."""
    lift = part * max(value for _, value in lift_curve(facts))
    most = 0.5 * density * speed_mps**2 * facts.geometry.wing_area.value * lift
    return math.acos(min(1.0, facts.mass_kg * G0 / most))


def flap_curve(facts: Facts) -> tuple[tuple[float, float, float], ...]:
    """Return points (deflection [rad], lift coefficient, drag coefficient) of the flaps; none without flaps.

    The lift is the same at every angle of attack: that of the largest lift of a wing of which a part has flaps
    (Raymer, Aircraft Design, eq. 12.21), 0.9 times section lift, chord extension and area fraction. The drag is
    Raymer's eq. 12.61; the induced part follows from the lift.
    """
    flap = facts.controls.flap
    if flap is None:
        return ()
    full = 0.9 * flap.section_lift.value * flap.chord_extension.value * flap.area_fraction.value
    shape = flap.section_drag.value * flap.chord_fraction.value * flap.area_fraction.value
    return tuple(
        (math.radians(at), full * part, shape * max(0.0, at - 10.0))
        for at, part in zip(flap.effect.at, flap.effect.value, strict=True)
    )


def flap_lift(facts: Facts, flap_rad: float) -> float:
    """Return the lift coefficient of the flaps at a deflection, straight between the points of ``flap_curve``."""
    points = flap_curve(facts)
    return float(np.interp(flap_rad, [p[0] for p in points], [p[1] for p in points])) if points else 0.0

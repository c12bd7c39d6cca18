"""Derivatives from facts, and the modes of motion that JSBSim makes of them."""

import math

import jsbsim
import numpy as np
import pytest

from magsim.aircraft import Aircraft
from magsim.flight.model.aero import Derivatives, derivatives, inertia, lift_curve, lift_slope
from magsim.flight.model.instance import load
from magsim.flight.model.setup import PlantSetup
from magsim.units import FT, G0

SPEED, ALTITUDE = 75.0, 3000.0


@pytest.fixture(scope="module")
def d(cessna: Aircraft) -> Derivatives:
    return derivatives(cessna.facts)


@pytest.fixture(scope="module")
def trimmed(cessna: Aircraft) -> jsbsim.FGFDMExec:
    """In trim in still air, the autopilot off."""
    setup = PlantSetup(0.0, 0.0, ALTITUDE, 0.0, SPEED)
    fdm = load(cessna.facts, setup.step_hz, twin=True)
    fdm["ic/h-sl-ft"] = ALTITUDE / FT
    fdm["ic/vt-fps"] = SPEED / FT
    fdm["ic/gamma-deg"] = 0.0
    fdm["propulsion/fuel_freeze"] = 1.0
    fdm.run_ic()
    fdm["propulsion/set-running"] = -1
    fdm.do_trim(1)
    return fdm


def test_lift_slope_has_its_limits() -> None:
    # Slender wing: pi AR / 2; infinite wing with section efficiency 0.97: 2 pi 0.97.
    assert lift_slope(1e-3) == pytest.approx(math.pi * 1e-3 / 2.0, rel=1e-3)
    assert lift_slope(1e6) == pytest.approx(2.0 * math.pi * 0.97, rel=1e-3)


def test_derivatives_are_those_of_a_light_turboprop(d: Derivatives) -> None:
    # de Havilland Twin Otter, the same class (UIUC/NASA, FlightGear Aircraft-uiuc/TwinOtter/aircraft.dat).
    assert d.cl_alpha == pytest.approx(5.66, rel=0.05)
    assert d.cl_elevator == pytest.approx(0.61, rel=0.15)
    assert d.cm_q == pytest.approx(-34.2, rel=0.1)
    assert d.cy_beta == pytest.approx(-0.6, rel=0.1)
    assert d.roll_p == pytest.approx(-0.5, rel=0.1)
    assert d.yaw_p == pytest.approx(-0.06, rel=0.1)
    assert d.neutral_point > 0.4033  # stable with the center of gravity at its aft limit


def test_lift_curve_is_the_line_inside_and_stalls_outside(cessna: Aircraft, d: Derivatives) -> None:
    alpha, lift = (np.array(column) for column in zip(*lift_curve(cessna.facts), strict=True))
    assert (np.diff(alpha) > 0.0).all()
    inside = np.radians([-9.0, 0.0, 9.0])
    np.testing.assert_allclose(np.interp(inside, alpha, lift), d.cl_0 + d.cl_alpha * inside, rtol=1e-12)
    assert math.degrees(alpha[np.argmax(lift)]) == pytest.approx(16.0)
    attached = (alpha >= math.radians(-12.1)) & (alpha <= math.radians(16.1))
    assert (np.diff(lift[attached]) > 0.0).all()


def test_stall_speed_is_that_of_the_handbook(cessna: Aircraft) -> None:
    # Clean stall about 75 knots calibrated at this mass.
    lift = max(value for _, value in lift_curve(cessna.facts))
    weight = cessna.facts.mass.mass.value * G0
    stall = math.sqrt(2.0 * weight / (1.225 * cessna.facts.geometry.wing_area.value * lift))
    assert stall / 0.514444 == pytest.approx(75.0, abs=3.0)


def test_trim_balances_weight_and_moment(trimmed: jsbsim.FGFDMExec, cessna: Aircraft, d: Derivatives) -> None:
    alpha, elevator = trimmed["aero/alpha-rad"], trimmed["fcs/elevator-pos-rad"]
    pressure = 0.5 * trimmed["atmosphere/rho-slugs_ft3"] * 515.378819 * SPEED**2
    lift = pressure * cessna.facts.geometry.wing_area.value * (d.cl_0 + d.cl_alpha * alpha + d.cl_elevator * elevator)
    thrust = trimmed["propulsion/engine/thrust-lbs"] * 4.4482216
    # The Earth's turning lightens a flight to the north by 0.3 %.
    weight = cessna.facts.mass.mass.value * 9.7803 * (1.0 - 2.0 * ALTITUDE / 6.371e6)
    assert lift + thrust * math.sin(alpha) == pytest.approx(weight, rel=2e-3)
    moment = d.cm_0 + d.cm_alpha * alpha + d.cm_elevator * elevator
    # The thrust line lies 5 cm below the center of gravity and pulls the nose up.
    size = pressure * cessna.facts.geometry.wing_area.value * cessna.facts.geometry.mean_chord.value
    assert moment * size + 0.05 * thrust == pytest.approx(0.0, abs=1e-3 * size)


def test_cruise_speed_is_published(cessna: Aircraft) -> None:
    # 184 knots at 10 000 ft: the drag was solved from it, so engine, drag and trim of JSBSim must give it back.
    fdm = load(cessna.facts, 120, twin=True)
    fdm["ic/h-sl-ft"] = 10000.0
    fdm["ic/vt-fps"] = 94.7 / FT
    fdm["ic/gamma-deg"] = 0.0
    fdm["propulsion/fuel_freeze"] = 1.0
    fdm.run_ic()
    fdm["propulsion/set-running"] = -1
    fdm.do_trim(1)
    assert fdm["fcs/throttle-pos-norm"] == pytest.approx(1.0, abs=0.03)


def modes(trimmed: jsbsim.FGFDMExec, names: list[str]) -> np.ndarray:
    linear = jsbsim.FGLinearization(trimmed)
    index = [list(linear.x_names).index(name) for name in names]
    return np.asarray(linear.system_matrix)[np.ix_(index, index)]


def test_longitudinal_modes(trimmed: jsbsim.FGFDMExec, cessna: Aircraft, d: Derivatives) -> None:
    geometry, facts = cessna.facts.geometry, cessna.facts
    size = 0.5 * trimmed["atmosphere/rho-slugs_ft3"] * 515.378819 * SPEED**2 * geometry.wing_area.value
    chord, iyy, mass = geometry.mean_chord.value, inertia(facts).yy, facts.mass.mass.value
    # Short period, Etkin and Reid eq. 6.3-14: two degrees of freedom.
    moment = size * chord / iyy
    z_alpha = -size * d.cl_alpha / (mass * SPEED)
    m_q, m_alphadot = (moment * c * chord / (2.0 * SPEED) for c in (d.cm_q, d.cm_alphadot))
    frequency = math.sqrt(z_alpha * m_q - moment * d.cm_alpha)
    damping = -(z_alpha + m_q + m_alphadot) / (2.0 * frequency)

    eigenvalues = np.linalg.eigvals(modes(trimmed, ["Vt", "Alpha", "Theta", "Q"]))
    fast = eigenvalues[np.argmax(np.abs(eigenvalues))]
    slow = eigenvalues[np.argmin(np.abs(eigenvalues))]
    assert abs(fast) == pytest.approx(frequency, rel=0.05)
    assert -fast.real / abs(fast) == pytest.approx(damping, rel=0.05)
    # Phugoid: Lanchester's sqrt(2) g / V, lengthened by the pitch stiffness.
    assert 2.0 * math.pi / abs(slow.imag) == pytest.approx(math.sqrt(2.0) * math.pi * SPEED / G0, rel=0.25)
    assert 0.02 < -slow.real / abs(slow) < 0.2


def test_lateral_modes_and_the_sign_of_the_product_of_inertia(
    trimmed: jsbsim.FGFDMExec, cessna: Aircraft, d: Derivatives
) -> None:
    geometry, moments = cessna.facts.geometry, inertia(cessna.facts)
    size = 0.5 * trimmed["atmosphere/rho-slugs_ft3"] * 515.378819 * SPEED**2
    size *= geometry.wing_area.value * geometry.span.value
    # Body axes, product of inertia taken in full: Ixx pdot - Ixz rdot = L, Izz rdot - Ixz pdot = N.
    tensor = np.array([[moments.xx, -moments.xz], [-moments.xz, moments.zz]])
    half = geometry.span.value / (2.0 * SPEED)
    sideslip = np.linalg.solve(tensor, size * np.array([d.roll_beta, d.yaw_beta]))
    rolling = np.linalg.solve(tensor, size * half * np.array([d.roll_p, d.yaw_p]))
    matrix = modes(trimmed, ["Beta", "Phi", "P", "R"])
    np.testing.assert_allclose(matrix[2:, 0], sideslip, rtol=0.02)
    np.testing.assert_allclose(matrix[2:, 2], rolling, rtol=0.02)

    eigenvalues = np.linalg.eigvals(matrix)
    dutch = eigenvalues[np.argmax(eigenvalues.imag)]
    roll = eigenvalues.real.min()
    assert roll == pytest.approx(rolling[0], rel=0.1)
    assert abs(dutch) == pytest.approx(math.sqrt(sideslip[1]), rel=0.2)
    assert 0.05 < -dutch.real / abs(dutch) < 0.3
    spiral = eigenvalues[np.argmin(np.abs(eigenvalues))].real
    assert abs(spiral) < 1.0 / 60.0

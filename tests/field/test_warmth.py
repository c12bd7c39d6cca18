"""Temperature of the climb: air, magnets and metal against their equations, and the parts of a flight that climbs."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from magsim.aircraft import Aircraft, load_aircraft
from magsim.field import compute_field, load_response
from magsim.field.metal import eddy
from magsim.field.sources.dipoles import DeflectedDipole, DeflectedDipoles, dipole_field
from magsim.field.warmth import Warmth
from magsim.population import MAGNETS, aircraft_of
from magsim.population.days import outside_c
from magsim.population.draws import Draws
from magsim.trajectory import Flight
from magsim.truth import FieldTruth
from tests.field.test_flex import flight as level
from tests.support.scenarios import over_the_sea

__all__ = ["level"]

MOUNTS = ("cabin_center", "sgl_mag_1")
SENSORS = {"scalar": [{"name": mount, "mount": mount} for mount in MOUNTS]}
OFF = {"temperature": {"enabled": False}}
STEP_S = 1.0 / 120.0


@pytest.fixture(scope="module")
def today() -> Aircraft:
    return aircraft_of(load_aircraft("c208b"), 0, 4, 3000.0)


@pytest.fixture(scope="module")
def climb(level: Flight) -> Flight:
    """The same swinging, in air that cools as if it climbed 3000 m in these seconds."""
    log = level.carrier
    return replace(level, carrier=replace(log, alt_m=3000.0 + 3000.0 * (log.time_s - log.time_s[0]) / 8.0))


def truth_of(today: Aircraft, flight: Flight, **field: object) -> FieldTruth:
    scenario = over_the_sea(field, SENSORS).model_copy(update={"day": 4})
    return compute_field(scenario, today, flight)


def warmth_of(truth: FieldTruth, flight: Flight) -> Warmth:
    air_c = outside_c(Draws("c208b", 0), 4, 3000.0)
    return Warmth.along(flight.carrier.at(truth.time_s).alt_m, 3000.0, air_c, STEP_S)


def test_magnets_and_metal_follow_the_standard_atmosphere_late() -> None:
    """6.5 K/km; a steady climb is followed by 1 - (1 - exp(-t/T)) T/t of it."""
    time = np.arange(0.0, 1800.0, 0.5)
    found = Warmth.along(1000.0 + 2.5 * time, 1000.0, 5.0, 0.5)
    outside = -0.0065 * 2.5
    for got, lag in ((found.magnets_k, 1100.0), (found.metal_k, 20.0)):
        exact = outside * (time - lag * -np.expm1(-time / lag))
        np.testing.assert_allclose(got, exact, rtol=0, atol=1e-9)


def test_moments_and_resistance_are_those_of_the_temperature() -> None:
    """Linear about 20 degrees, whatever the air at the start was."""
    warmth = Warmth(-5.0, np.array([-10.0, 0.0, 4.0]), np.array([-15.0, 0.0, 3.0]))
    for magnet, (per_k, _) in MAGNETS.items():
        got = (1.0 + per_k * (-5.0 - 20.0)) * (1.0 + warmth.moment(magnet))
        np.testing.assert_allclose(got, 1.0 + per_k * (np.array([-15.0, -5.0, -1.0]) - 20.0), rtol=1e-14)
    got = (1.0 + 0.002 * (-5.0 - 20.0)) * warmth.resistance
    np.testing.assert_allclose(got, 1.0 + 0.002 * (np.array([-20.0, -5.0, -2.0]) - 20.0), rtol=1e-14)


@pytest.mark.parametrize(
    ("tau", "frequency_hz", "within"), [(0.0115, 0.2, 2e-5), (0.0115, 1.0, 4e-4), (0.0115, 5.0, 1e-2)]
)
def test_states_of_warmed_metal_solve_their_equation(tau: float, frequency_hz: float, within: float) -> None:
    """``tau dq/dt + r(t) q = -drive . dB/dt`` by an integrator of eighth order, r rising as in a descent of 5 m/s."""
    time, omega = np.arange(0.0, 20.0, STEP_S), 2.0 * np.pi * frequency_hz
    amplitude = np.array([30.0, -10.0, 20.0])
    modes = eddy.Modes(np.array([tau]), np.array([[2.0, -1.0, 0.5]]), np.ones((1, 3, 1)))
    rate = omega * np.cos(omega * time)[:, None] * amplitude
    resistance = 0.98 + 6.5e-5 * time
    got = eddy.warmed(modes, eddy.states(modes, rate, STEP_S), rate, STEP_S, resistance)[:, 0]
    drive = float(modes.drive[0] @ amplitude) * omega

    def slope(t: float, q: np.ndarray) -> np.ndarray:
        return -(drive * np.cos(omega * t) + (0.98 + 6.5e-5 * t) * q) / tau

    exact = solve_ivp(slope, (0.0, 20.0), [got[0]], "DOP853", time, rtol=1e-10, atol=1e-10 * abs(drive)).y[0]
    plain = eddy.states(modes, rate, STEP_S)[:, 0]
    off = np.abs(got - exact)[120:].max() / np.abs(exact).max()
    assert off < within
    assert np.abs(plain - exact)[120:].max() / np.abs(exact).max() > 0.018


def test_without_lag_they_are_the_slow_limit() -> None:
    modes = eddy.Modes(np.array([0.01]), np.array([[2.0, -1.0, 0.5]]), np.ones((1, 3, 1)))
    rate, resistance = np.ones((5, 3)), np.linspace(0.98, 1.03, 5)
    got = eddy.warmed(modes, eddy.states(modes, rate, STEP_S, lag=False), rate, STEP_S, resistance)
    np.testing.assert_allclose(got[:, 0], -1.5 / resistance, rtol=1e-14)


def test_magnets_weaken_and_strengthen_with_the_height(today: Aircraft, climb: Flight) -> None:
    """Fixed and hinged ones, dipole by dipole; steel keeps its moment."""
    truth, still = truth_of(today, climb), truth_of(today, climb, **OFF)
    warmth, rows = warmth_of(truth, climb), np.arange(0, len(truth.time_s), 60)
    assert warmth.magnets_k.min() < -0.05
    angles = climb.controls_at(truth.time_s)
    for mount in MOUNTS:
        place = np.array(today.mounts[mount])
        fixed, hinged = np.zeros((len(truth.time_s), 3)), np.zeros((len(truth.time_s), 3))
        for dipole in (d for d in today.magnetics.permanent if d.magnet):
            field = dipole_field(np.array(dipole.position_m), np.array(dipole.moment_am2), place)
            fixed += warmth.moment(dipole.magnet)[:, None] * field
        for dipole in (d for d in today.magnetics.hinged if d.magnet):
            angle = angles[dipole.surface]
            turned = DeflectedDipole(
                np.array(dipole.position_m),
                np.array(dipole.moment_am2),
                np.array(dipole.hinge_point_m),
                np.array(dipole.hinge_axis),
                np.cos(angle),
                np.sin(angle),
            )
            field = DeflectedDipoles((turned,)).at(place[None])[:, 0]
            hinged += warmth.moment(dipole.magnet)[:, None] * field
        for name, exact in (("permanent", fixed), ("hinged", hinged)):
            got = truth.part(name, mount) - still.part(name, mount)
            np.testing.assert_allclose(got[rows], exact[rows], rtol=0, atol=1e-9)
            assert np.abs(exact).max() > 1e-5
    for name in set(still.parts_b) - {"permanent", "hinged", "eddy"}:
        np.testing.assert_array_equal(truth.parts_b[name], still.parts_b[name])


def test_eddy_currents_strengthen_in_the_cold(today: Aircraft, level: Flight) -> None:
    """Flown 3000 m above the start's height from the first row on: the response of metal that conducts better."""
    high = replace(level, carrier=replace(level.carrier, alt_m=level.carrier.alt_m + 3000.0))
    truth, still = truth_of(today, high), truth_of(today, high, **OFF)
    # Heights above the ellipsoid change by some meters as it swings.
    resistance = float(warmth_of(truth, high).resistance.mean())
    assert resistance == pytest.approx(1.0 - 0.002 * 19.5, abs=3e-3)
    skin = today.magnetics.skin
    parts = tuple(
        part.model_copy(
            update={
                "conductivity_spm": part.conductivity_spm / resistance,
                "seams_ohm_m": tuple(resistance * seam for seam in part.seams_ohm_m),
            }
        )
        for part in skin.parts
    )
    magnetics = today.magnetics.model_copy(update={"skin": skin.model_copy(update={"parts": parts})})
    cold = replace(today, magnetics=magnetics)
    there = compute_field(over_the_sea(OFF, SENSORS).model_copy(update={"day": 4}), cold, high, load_response(cold))
    for mount in MOUNTS:
        change = (there.part("eddy", mount) - still.part("eddy", mount))[120:-120]
        got = (truth.part("eddy", mount) - still.part("eddy", mount))[120:-120]
        np.testing.assert_allclose(got, change, rtol=0, atol=1e-2 * np.abs(change).max())


def test_on_no_day_nothing_changes(climb: Flight) -> None:
    nominal = load_aircraft("c208b")
    with_it, without = (
        compute_field(over_the_sea(field, SENSORS), nominal, climb, load_response(nominal)) for field in ({}, OFF)
    )
    for name, part in without.parts_b.items():
        np.testing.assert_array_equal(with_it.parts_b[name], part)

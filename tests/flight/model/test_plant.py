"""The flight model as a machine: signs, rates, wind, swings, and what is found when it goes wrong."""

import math

import jsbsim
import numpy as np
import pytest

from magsim.aircraft import Aircraft
from magsim.errors import RequestError
from magsim.flight.model.autopilot import RAMP_START
from magsim.flight.model.dryden import Strength
from magsim.flight.model.instance import load
from magsim.flight.model.plant import FlightTroubleError, Plant
from magsim.flight.model.rates import INTEGRATORS
from magsim.flight.model.setup import PlantSetup
from magsim.flight.model.start import start
from magsim.flight.model.trim import trim
from magsim.flight.model.weather import Weather
from magsim.flight.path.wind import crab_heading, ground_speed
from magsim.flight.pilot.response import UNITY
from magsim.flight.pilot.swings import ORDERS, SwingCommands, cubics
from magsim.flight.pilot.trains import SineTrain

LIGHT = Strength(3)
SETUP = PlantSetup(lat_rad=0.3, lon_rad=2.0, alt_m=3000.0, course=1.0, speed_mps=75.0)


def flying(cessna: Aircraft, setup: PlantSetup = SETUP) -> jsbsim.FGFDMExec:
    return start(cessna.facts, setup)


def run(fdm: jsbsim.FGFDMExec, seconds: float) -> None:
    for _ in range(round(seconds / fdm.get_delta_t())):
        fdm.run()


def test_integrators_and_step_are_set(cessna: Aircraft) -> None:
    fdm = flying(cessna)
    assert {name: fdm[f"simulation/integrator/{name}"] for name in INTEGRATORS} == INTEGRATORS
    assert fdm.get_delta_t() == 1.0 / 120.0


def test_jsbsim_is_silent(cessna: Aircraft, capfd: pytest.CaptureFixture[str]) -> None:
    flying(cessna)
    assert capfd.readouterr() == ("", "")


def test_trimmed_flight_stays_level(cessna: Aircraft) -> None:
    plant = Plant(cessna.facts, SETUP)
    for _ in range(200):
        plant.run(12)
    assert plant.value("alt") == pytest.approx(3000.0, abs=0.5)
    assert plant.value("airspeed") == pytest.approx(75.0, abs=0.1)
    assert math.degrees(plant.value("roll")) == pytest.approx(0.0, abs=0.2)
    assert plant.value("heading") == pytest.approx(1.0, abs=math.radians(0.2))


@pytest.mark.parametrize(
    ("command", "deflection", "rate", "sign"),
    [
        # Right-hand rule: trailing edge down about +y pushes the tail up, the nose down.
        ("fcs/elevator-cmd-norm", "fcs/elevator-pos-rad", "velocities/q-rad_sec", -1),
        # Left trailing edge down, right one up: the left wing rises, a roll to the right.
        ("fcs/aileron-cmd-norm", "fcs/left-aileron-pos-rad", "velocities/p-rad_sec", 1),
        # About +z: trailing edge to port pushes the tail to starboard, the nose to port.
        ("fcs/rudder-cmd-norm", "fcs/rudder-pos-rad", "velocities/r-rad_sec", -1),
    ],
)
def test_positive_deflection_turns_the_right_way(
    cessna: Aircraft, command: str, deflection: str, rate: str, sign: int
) -> None:
    fdm = flying(cessna)
    fdm["ap/on"] = 0.0
    run(fdm, 0.5)
    before = fdm[rate], fdm[deflection]
    fdm[command] = fdm[command] + 0.2
    run(fdm, 0.3)
    assert fdm[deflection] - before[1] > 0.05
    assert sign * (fdm[rate] - before[0]) > math.radians(1.0)


@pytest.mark.parametrize("step_hz", [60, 480])
def test_actuators_keep_their_lag_at_every_rate(cessna: Aircraft, step_hz: int) -> None:
    # A step of 0.01 normalized, far below the rate limit: 1 - 1/e of it after 1/20 s.
    fdm = load(cessna.facts, step_hz)
    fdm["ic/h-sl-ft"], fdm["ic/vt-fps"] = 10000.0, 250.0
    fdm.run_ic()
    run(fdm, 0.5)
    before = fdm["fcs/rudder-pos-rad"]
    fdm["fcs/rudder-cmd-norm"] = 0.01
    # The command is read in the step after it was given; JSBSim's lag is the trapezoidal rule, half a step ahead.
    run(fdm, 0.05)
    reached = (fdm["fcs/rudder-pos-rad"] - before) / (0.01 * 0.436332)
    assert reached == pytest.approx(1.0 - math.exp(-1.0), abs=20.0 / step_hz * 0.4)


def test_actuators_have_a_rate_limit_and_stops(cessna: Aircraft) -> None:
    fdm = flying(cessna)
    fdm["ap/on"] = 0.0
    before = fdm["fcs/rudder-pos-rad"]
    fdm["fcs/rudder-cmd-norm"] = 1.0
    run(fdm, 0.1)
    assert fdm["fcs/rudder-pos-rad"] - before == pytest.approx(0.12, abs=0.015)
    run(fdm, 0.5)
    assert fdm["fcs/rudder-pos-rad"] == pytest.approx(math.radians(25.0), abs=1e-5)


@pytest.mark.parametrize("course_deg", [0.0, 75.0, 200.0])
def test_wind_acts_from_the_first_moment(cessna: Aircraft, course_deg: float) -> None:
    wind = (-6.0, 14.0)
    setup = PlantSetup(0.3, 2.0, 3000.0, math.radians(course_deg), 75.0, wind_mps=wind)
    plant = Plant(cessna.facts, setup)
    plant.run(1)
    heading = crab_heading(75.0, setup.course, wind)
    assert plant.value("airspeed") == pytest.approx(75.0, abs=0.05)
    assert plant.value("v_north") == pytest.approx(75.0 * math.cos(heading) + wind[0], abs=0.05)
    assert plant.value("v_east") == pytest.approx(75.0 * math.sin(heading) + wind[1], abs=0.05)
    assert math.hypot(plant.value("v_north"), plant.value("v_east")) == pytest.approx(
        ground_speed(75.0, setup.course, wind), abs=0.05
    )
    for _ in range(100):
        plant.run(12)
    flown = math.atan2(plant.value("v_east"), plant.value("v_north"))
    assert (flown - setup.course + math.pi) % (2.0 * math.pi) - math.pi == pytest.approx(0.0, abs=math.radians(0.3))
    assert plant.value("airspeed") == pytest.approx(75.0, abs=0.1)


def test_turbulence_belongs_to_its_seed(cessna: Aircraft) -> None:
    def rolled(seed: int, strength: Strength | None = LIGHT) -> list[float]:
        weather = Weather(turbulence=strength, seed=seed)
        plant = Plant(cessna.facts, PlantSetup(0.3, 2.0, 3000.0, 1.0, 75.0, weather=weather))
        return [plant.run(12)[6] for _ in range(50)]

    first = rolled(7)
    assert first == rolled(7)
    assert first != rolled(8)
    assert np.std(first) > 10.0 * np.std(rolled(7, None))


def command_swings(plant: Plant, swings: SwingCommands) -> int:
    """Command the swings of a tick; return how many orders that takes."""
    which, values = np.zeros(len(ORDERS), dtype=int), np.zeros(len(ORDERS))
    count = cubics(*swings.table, swings.last, plant.time_s, which, values, 0, 0)
    for number, value in zip(which[:count].tolist(), values[:count].tolist(), strict=True):
        plant.command(ORDERS[number], value)
    return count


def test_swings_are_the_trains_that_are_planned(cessna: Aircraft) -> None:
    train = SineTrain(
        "yaw", 1, 1, start_s=3.03, period_s=4.0, cycles=2, amplitude_deg=6.0, ease_in_s=2.0, ease_out_s=1.0
    )
    plant, swings = Plant(cessna.facts, SETUP), SwingCommands()
    swings.add([train], UNITY)
    largest, turning = 0.0, []
    for tick in range(140):
        assert ([*swings.begun(plant.time_s)] == [train]) == (tick == 10)
        plant.command(RAMP_START, plant.clock_s)
        command_swings(plant, swings)
        for _ in range(12):
            # The clock is advanced before the flight controls run.
            plant.run(1)
            wanted, given = train.angle(plant.time_s), plant._fdm["ap/yaw/angle-rad"]
            off, largest = abs(given - wanted), max(largest, abs(given))
            # A cubic of a sine over a tick is off by (omega h)^4 / 384 of its amplitude, more where an easing ends.
            assert off < (1e-5 if 3.2 < plant.time_s < 11.0 else 1e-3) * math.radians(6.0)
            turning.append((given, plant._fdm["ap/yaw/rate-rad_sec"]))
    assert largest == pytest.approx(math.radians(6.0), rel=1e-3)
    angle, rate = np.array(turning).T
    np.testing.assert_allclose(np.gradient(angle, 1.0 / 120.0)[1:-1], rate[1:-1], atol=math.radians(0.05))
    assert command_swings(plant, swings) == 0


def test_no_trim_is_reported(cessna: Aircraft) -> None:
    with pytest.raises(RequestError, match=r"start.speed_mps: .* no straight and level flight at 40 m/s and 3000 m"):
        trim(cessna.facts, PlantSetup(0.0, 0.0, 3000.0, 0.0, 40.0))


def two_minutes(plant: Plant) -> None:
    for _ in range(1200):
        plant.run(12)


def trouble(plant: Plant) -> str:
    with pytest.raises(FlightTroubleError) as caught:
        two_minutes(plant)
    assert f"t = {plant.time_s:.1f} s" in str(caught.value)
    return str(caught.value)


def test_ground_contact_is_found(cessna: Aircraft) -> None:
    plant = Plant(cessna.facts, PlantSetup(0.3, 2.0, 30.0, 1.0, 75.0))
    plant.command("ap/height-ft", -500.0)
    assert trouble(plant).startswith("the flight touched the ground at t = ")


def test_a_stall_is_found(cessna: Aircraft) -> None:
    plant = Plant(cessna.facts, SETUP)
    plant.command("ap/hold-height", 0.0)
    plant.command("ap/theta-rad", math.radians(40.0))
    assert trouble(plant).startswith("the flight stalled at t = ")


def test_not_a_number_is_found(cessna: Aircraft) -> None:
    plant = Plant(cessna.facts, SETUP)
    plant.command("ap/theta-rad", math.nan)
    assert trouble(plant).startswith("the flight diverged (not a number) at t = 0.1 s")


def test_divergence_is_found(cessna: Aircraft) -> None:
    plant = Plant(cessna.facts, SETUP)
    plant.command("ap/on", 0.0)
    plant.command("ap/hold-heading", 0.0)
    plant._fdm["fcs/aileron-cmd-norm"] = 1.0
    assert trouble(plant).startswith("the flight diverged at t = ")

"""The composed field of a flight: places, times, parts, switches."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from magsim.aircraft import Aircraft, load_aircraft
from magsim.columns import PLATFORM
from magsim.earth import decimal_years, ecef_from_geodetic, geodetic_from_ecef, igrf, rot_ne_at
from magsim.earth.harmonics import unpack_gradient
from magsim.errors import RequestError
from magsim.field import AircraftResponse, compute_field, load_response
from magsim.field.background.main_field import earth_along
from magsim.field.composition import parts_on
from magsim.field.parts import PARTS
from magsim.field.situation import simulation_times, used_mounts
from magsim.field.sources.dipoles import dipole_field
from magsim.field.sources.memory import hysteresis, viscosity
from magsim.frames import rot_nb_from_attitude, rotate, rotate_back
from magsim.scenario import Scenario
from magsim.trajectory import Flight, Trajectory
from tests.support.rotations import body_rates, rotate_about
from tests.support.scenarios import over_the_sea

REFERENCE_B = np.array([-0.15, 0.0, 0.25])
SWING, PERIOD_S = np.radians([12.0, 9.0, 8.0]), np.array([7.0, 8.3, 6.1])
SURFACES = ("elevator", "aileron_left", "aileron_right", "rudder", "flap")


def _attitude(time_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Roll, pitch and heading, (n, 3) [rad], and their time derivatives; heading turns slowly, too."""
    phase = 2.0 * np.pi * time_s[:, None] / PERIOD_S
    angles = SWING * np.sin(phase) + np.array([0.0, 0.04, 0.3]) + time_s[:, None] * [0.0, 0.0, 0.01]
    return angles, SWING * 2.0 * np.pi / PERIOD_S * np.cos(phase) + [0.0, 0.0, 0.01]


@pytest.fixture(scope="module")
def flight() -> Flight:
    time = np.arange(-10 * 30, 70 * 30 + 1) / 30.0
    attitude, rates = _attitude(time)
    speed = 75.0
    velocity = speed * np.column_stack([np.cos(attitude[:, 2]), np.sin(attitude[:, 2]), -np.sin(attitude[:, 1])])
    path = np.cumsum(velocity, axis=0) / 30.0
    carrier = Trajectory(
        time_s=time,
        lat_rad=np.radians(16.72) + path[:, 0] / 6.36e6,
        lon_rad=np.radians(112.729) + path[:, 1] / 6.1e6,
        alt_m=3000.0 - path[:, 2],
        velocity_n=velocity,
        attitude=attitude,
        rate_b=body_rates(attitude, rates),
        reference_b=REFERENCE_B,
    )
    controls = {name: 0.1 * np.sin(0.8 * time + i) for i, name in enumerate(SURFACES)}
    return Flight(carrier, 60.0, 120.0, controls, (), ())


@pytest.fixture(scope="module")
def aircraft() -> Aircraft:
    return load_aircraft("c208b")


@pytest.fixture(scope="module")
def response(aircraft: Aircraft) -> AircraftResponse:
    return load_response(aircraft)


def _scenario(**physics: object) -> Scenario:
    return over_the_sea(
        physics,
        {
            "scalar": [{"name": "tail", "mount": "sgl_mag_1"}, {"name": "cabin", "mount": "cabin_center"}],
            "fluxgate": [{"name": "vector", "mount": "cabin_center"}, {"name": "d", "mount": "sgl_flux_d"}],
        },
    )


@pytest.fixture(scope="module")
def run(aircraft: Aircraft, flight: Flight, response: AircraftResponse) -> Callable:
    return lambda **physics: compute_field(_scenario(**physics), aircraft, flight, response)


OFF = {"enabled": False}


def test_times_hold_zero_and_fill_the_log(flight: Flight) -> None:
    time = simulation_times(flight)
    assert 0.0 in time
    np.testing.assert_allclose(np.diff(time), 1.0 / 120.0, rtol=1e-9)
    assert (time[0], time[-1]) == (-10.0, 70.0)


def test_mounts_in_the_order_of_first_use(run: Callable) -> None:
    assert used_mounts(_scenario()) == ("sgl_mag_1", "cabin_center", "sgl_flux_d")
    truth = run()
    assert truth.mounts == ("sgl_mag_1", "cabin_center", "sgl_flux_d")
    assert tuple(truth.parts_b) == tuple(name for name in parts_on(_scenario()) if name != "crew")
    assert all(np.all(np.isfinite(part)) for part in truth.parts_b.values())


def test_few_knots_hold_the_earth(flight: Flight) -> None:
    """The spline through few knots a second against IGRF at every sample."""
    scenario, time = _scenario(), simulation_times(flight)
    inside = slice(120, -120)  # the ends of a flight are run-in for the filters
    table = earth_along(scenario, flight.carrier, time)(time)
    path = flight.carrier.at(time)
    years = decimal_years(scenario.start.time_utc, time)
    exact, slopes = igrf(path.lat_rad, path.lon_rad, path.alt_m, years, gradient=True)
    rot_ne = rot_ne_at(path.lat_rad, path.lon_rad)
    gradient = np.einsum("nij,njk,nlk->nil", rot_ne, unpack_gradient(table[:, 3:]), rot_ne)
    assert np.abs(rotate(rot_ne, table[:, :3]) - exact)[inside].max() < 1e-5
    assert np.abs(gradient - slopes)[inside].max() < 1e-9


def test_every_mount_has_the_earth_at_its_own_place(flight: Flight, run: Callable, aircraft: Aircraft) -> None:
    """There and back: the mount's own latitude, longitude and height, from body axes over NED and ECEF."""
    truth = run()
    rows = slice(1200, -1200, 600)
    path = flight.carrier.at(truth.time_s[rows])
    rot_nb = rot_nb_from_attitude(path.attitude)
    rot_ne = rot_ne_at(path.lat_rad, path.lon_rad)
    center = ecef_from_geodetic(path.lat_rad, path.lon_rad, path.alt_m)
    year = decimal_years(_scenario().start.time_utc, path.time_s)
    for mount in truth.mounts:
        arm_n = rotate(rot_nb, np.broadcast_to(np.array(aircraft.mounts[mount]) - REFERENCE_B, center.shape))
        lat, lon, alt = geodetic_from_ecef(center + rotate_back(rot_ne, arm_n))
        field_e = rotate_back(rot_ne_at(lat, lon), igrf(lat, lon, alt, year))
        exact = rotate_back(rot_nb, rotate(rot_ne, field_e))
        assert np.abs(truth.part("earth", mount)[rows] - exact).max() < 2e-5
    # The tail sits 11 m behind the cabin: the check must be able to distinguish them.
    difference = truth.part("earth", "sgl_mag_1") - truth.part("earth", "cabin_center")
    assert 0.05 < np.abs(difference).max() < 1.0


def test_earth_of_the_start_point_everywhere(run: Callable) -> None:
    truth = run(earth={"along_path": False})
    place = np.radians([16.72]), np.radians([112.729]), np.array([3000.0])
    exact = np.linalg.norm(igrf(*place, decimal_years(_scenario().start.time_utc, np.zeros(1))))
    for mount in truth.mounts:
        np.testing.assert_allclose(np.linalg.norm(truth.part("earth", mount), axis=1), exact, rtol=1e-14)


def test_permanent_and_induced(run: Callable, response: AircraftResponse, aircraft: Aircraft) -> None:
    truth = run(earth={"along_path": False})
    for mount in truth.mounts:
        row = response.mounts.index(mount)
        exact = sum(
            dipole_field(np.array(d.position_m), np.array(d.moment_am2), np.array(aircraft.mounts[mount]))
            for d in aircraft.magnetics.permanent
        )
        np.testing.assert_allclose(truth.part("permanent", mount)[[0, -1]], [exact, exact], rtol=1e-12)
        induced = np.stack([response.induced[row] @ b for b in truth.part("earth", mount)[::500]])
        np.testing.assert_allclose(truth.part("induced", mount)[::500], induced, atol=1e-9)


def test_hinged_dipoles_follow_their_surfaces(run: Callable, flight: Flight, aircraft: Aircraft) -> None:
    truth = run()
    rows = np.arange(0, len(truth.time_s), 700)
    angles = flight.controls_at(truth.time_s[rows])
    place = np.array(aircraft.mounts["sgl_mag_1"])
    exact = np.zeros((len(rows), 3))
    for dipole in aircraft.magnetics.hinged:
        angle = angles[dipole.surface]
        axis, hinge = np.array(dipole.hinge_axis), np.array(dipole.hinge_point_m)
        position = hinge + rotate_about(axis, angle, np.array(dipole.position_m) - hinge)
        exact += dipole_field(position, rotate_about(axis, angle, np.array(dipole.moment_am2)), place)
    np.testing.assert_allclose(truth.part("hinged", "sgl_mag_1")[rows], exact, atol=1e-11)
    assert np.ptp(exact[:, 0]) > 0.01


def test_a_surface_that_is_not_logged_is_named(aircraft: Aircraft, flight: Flight, response: AircraftResponse) -> None:
    controls = {name: angle for name, angle in flight.controls.items() if name != "flap"}
    without = replace(flight, controls=controls)
    with pytest.raises(
        RequestError, match=r"'flap_right' .* 'flap', which the flight does not log .*at_rest = \['flap'\]"
    ):
        compute_field(_scenario(), aircraft, without, response)
    held = compute_field(_scenario(hinged={"at_rest": ["flap"]}), aircraft, without, response)
    still = replace(flight, controls=controls | {"flap": np.zeros(len(flight.carrier))})
    assumed = compute_field(_scenario(), aircraft, still, response)
    np.testing.assert_array_equal(held.parts_b["hinged"], assumed.parts_b["hinged"])


def test_memory_of_the_steel_goes_through_its_tensor(run: Callable, response: AircraftResponse) -> None:
    """Hysteresis and viscosity of B_0, each alone and both, times D at each mount."""
    uniform = {"along_path": False}
    both, alone = run(earth=uniform), [run(earth=uniform, memory={p: False}) for p in ("hysteresis", "viscosity")]
    memory = load_aircraft("c208b").magnetics.memory
    ambient = both.part("earth", "cabin_center")
    states = [
        viscosity(ambient, memory.viscosity_s, memory.viscosity_weights, 1.0 / 120.0, "settled"),
        hysteresis(ambient, memory.radii_nt, memory.weights, "settled"),
    ]
    for mount in both.mounts:
        tensor = response.induced[response.mounts.index(mount)]
        for truth, state in zip((*alone, both), (*states, states[0] + states[1]), strict=True):
            np.testing.assert_allclose(truth.part("memory", mount), state @ tensor.T, atol=1e-6)
    assert np.ptp(both.part("memory", "cabin_center"), axis=0).max() > 1.0


def test_propeller_turns_with_the_flight(aircraft: Aircraft, flight: Flight, response: AircraftResponse) -> None:
    """Its tone has the frequency that was flown, however long a step is; without a log, that of the file."""
    scenario = _scenario()
    logged = {"propeller": np.full(len(flight.carrier), 2.0 * np.pi * 31.0)}
    for hertz, changes in ((31.0, {"rotors": logged}), (1900.0 / 60.0, {})):
        tones = []
        for rate in (120.0, 240.0):
            flown = replace(flight, simulation_rate_hz=rate, **changes)
            truth = compute_field(scenario, aircraft, flown, response)
            counted = truth.part("propeller", "cabin_center")[:, 1]
            first = round(10.0 * rate)  # time 0; windows of 100 ms begin half a step before it
            tones.append(counted[first : first + round(50.0 * rate)].reshape(500, -1).mean(axis=1))
        offset = tones[0] - tones[1]  # windows differ by a quarter of a long step
        assert np.abs(offset).max() < 0.3 * np.ptp(tones[0])
        spectrum = np.abs(np.fft.rfft((tones[0] - tones[0].mean()) * np.hanning(500)))
        alias = abs(hertz - 10.0 * round(hertz / 10.0))
        assert np.fft.rfftfreq(500, 0.1)[spectrum.argmax()] == pytest.approx(alias, abs=0.15)


def _body_derivatives(truth_time: np.ndarray, ambient: np.ndarray) -> np.ndarray:
    """d/dt of a field fixed in space, in body axes: -omega x B, with the rates of the analytic attitude."""
    (roll, pitch, _), rate = _attitude(truth_time)[0].T, _attitude(truth_time)[1]
    omega = np.column_stack(
        [
            rate[:, 0] - rate[:, 2] * np.sin(pitch),
            rate[:, 1] * np.cos(roll) + rate[:, 2] * np.sin(roll) * np.cos(pitch),
            -rate[:, 1] * np.sin(roll) + rate[:, 2] * np.cos(roll) * np.cos(pitch),
        ]
    )
    return -np.cross(omega, ambient)


def test_eddies_without_lag_follow_the_derivative(run: Callable, response: AircraftResponse) -> None:
    truth = run(earth={"along_path": False}, eddy={"lag": False})
    slope = _body_derivatives(truth.time_s, truth.part("earth", "cabin_center"))
    exact = slope @ response.eddy_slow_s[response.mounts.index("cabin_center")].T
    error = truth.part("eddy", "cabin_center") - exact
    assert np.abs(error[120:-120]).max() < 1e-6 * np.abs(exact).max()


def test_eddies_with_lag_are_late_by_their_time_constants(run: Callable, response: AircraftResponse) -> None:
    """Second order of slow motion: B = E dB/dt + E2 d2B/dt2 with E2 = sum tau b g."""
    late, prompt = (run(earth={"along_path": False}, eddy={"lag": lag}) for lag in (True, False))
    ambient = late.part("earth", "cabin_center")
    curve = np.gradient(_body_derivatives(late.time_s, ambient), late.time_s, axis=0)
    row, modes = response.mounts.index("cabin_center"), response.modes
    second = np.einsum("ik,k,kj->ij", modes.field[row], modes.tau_s, modes.drive)
    lag = late.part("eddy", "cabin_center") - prompt.part("eddy", "cabin_center")
    inside = slice(240, -240)
    assert np.abs(lag - curve @ second.T)[inside].max() < 0.02 * np.abs(lag[inside]).max()
    assert np.abs(lag[inside]).max() > 1e-3


def test_eddies_start_settled(aircraft: Aircraft, flight: Flight, response: AircraftResponse) -> None:
    """A log that starts 5 s later gives the same eddies from its first tenths of a second."""
    whole, tail = flight.carrier, {}
    keep = whole.time_s >= -5.0 - 1e-9
    for name in ("time_s", "lat_rad", "lon_rad", "alt_m", "velocity_n", "attitude", "rate_b"):
        tail[name] = getattr(whole, name)[keep]
    controls = {name: angle[keep] for name, angle in flight.controls.items()}
    shorter = Flight(Trajectory(**tail, reference_b=REFERENCE_B), 60.0, 120.0, controls, (), ())
    scenario = _scenario()
    long = compute_field(scenario, aircraft, flight, response).part("eddy", "cabin_center")
    short = compute_field(scenario, aircraft, shorter, response).part("eddy", "cabin_center")
    same = long[-len(short) :]
    assert np.abs(short - same).max() < 5e-3 * np.abs(same).max()
    assert np.abs(short - same)[120:].max() < 1e-5 * np.abs(same).max()


@pytest.mark.parametrize("name", [name for name in PLATFORM if name in PARTS and name != "crew"])
def test_parts_can_be_switched_and_scaled(run: Callable, name: str) -> None:
    """But for the crew, which is aboard on days alone (``test_crew``)."""
    plain, double = (run(**{name: {"enabled": True, "scale": scale}}).parts_b for scale in (1.0, -2.0))
    off = run(**{name: OFF}).parts_b
    assert name not in off
    np.testing.assert_allclose(double[name], -2.0 * plain[name], rtol=1e-14)
    for other in off:
        np.testing.assert_array_equal(off[other], plain[other])


def test_linear_world_is_the_tolles_lawson_sum(run: Callable, response: AircraftResponse) -> None:
    """With a constant field the projection is exactly p.u + F u.Du + F u.E du/dt (E without lag)."""
    truth = run(
        earth={"along_path": False}, hinged=OFF, propeller=OFF, memory=OFF, eddy={"lag": False}, electronics=OFF
    )
    ambient = truth.part("earth", "cabin_center")
    size = np.linalg.norm(ambient, axis=1)
    u = ambient / size[:, None]
    row = response.mounts.index("cabin_center")
    du = _body_derivatives(truth.time_s, u)
    linear = (
        u @ response.permanent_nt[row]
        + size * np.einsum("ni,ij,nj->n", u, response.induced[row], u)
        + size * np.einsum("ni,ij,nj->n", u, response.eddy_slow_s[row], du)
    )
    projection = np.einsum("ni,ni->n", truth.platform("cabin_center"), u)
    # Differences of fourth order: 2e-7 of an eddy field of some tens of nT.
    assert np.abs(projection - linear)[120:-120].max() < 1e-5
    assert np.std(projection) > 10.0


def test_parts_add_up(run: Callable) -> None:
    truth = run()
    total = sum(part[:, truth.mounts.index("cabin_center")] for part in truth.parts_b.values())
    np.testing.assert_allclose(truth.total("cabin_center"), total, atol=1e-9)


def test_progress_ends_at_one(aircraft: Aircraft, flight: Flight, response: AircraftResponse) -> None:
    shares: list[float] = []
    compute_field(_scenario(), aircraft, flight, response, progress=shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)


def test_the_scenario_chooses_the_model_of_the_eddy_currents(
    aircraft: Aircraft, flight: Flight, response: AircraftResponse
) -> None:
    whole, loops = (compute_field(_scenario(eddy={"model": m}), aircraft, flight) for m in ("skin", "coils"))
    first, second = whole.part("eddy", "cabin_center"), loops.part("eddy", "cabin_center")
    assert np.abs(second).max() < 0.3 * np.abs(first).max()
    given = compute_field(_scenario(), aircraft, flight, response)
    np.testing.assert_array_equal(first, given.part("eddy", "cabin_center"))

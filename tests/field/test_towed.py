"""The field in a towed bird: the carrier's, against its own response at each place; the background; the swing."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from magsim.aircraft import Aircraft, Bird, Magnetics, load_aircraft, load_bird
from magsim.earth import decimal_years, ecef_from_geodetic, geodetic_from_ecef, igrf, rot_ne_at
from magsim.errors import RequestError
from magsim.field import compute_field, compute_tow_field, load_response, response_at
from magsim.field.background.crust import crust_of
from magsim.field.composition import with_background
from magsim.field.platform import eddy_field
from magsim.field.situation import Situation, simulation_times
from magsim.field.sources.dipoles import dipole_field
from magsim.field.sources.memory import remembered
from magsim.field.sources.rotors import turning_of
from magsim.field.towed import carrier_field, metal_field, smoothed, steady_background, turning_field, whittaker
from magsim.flight import fly
from magsim.frames import body_rates, rot_nb_from_attitude, rotate_about
from magsim.scenario import Scenario
from magsim.terrain import TangentPlane
from magsim.trajectory import Flight, Trajectory

SPEED_MPS, HEIGHT_M = 28.0, 1250.0
START = {"lat_deg": 48.7, "lon_deg": 127.2, "alt_m": HEIGHT_M, "speed_mps": SPEED_MPS}
HOOK_B = np.array([0.0, 0.0, 1.1])
REFERENCE_B = np.array([0.3, 0.1, -0.2])
BODY_HZ = 30.0

STEEL = {
    "kind": "bar",
    "name": "block",
    "center_m": [-1.2, 0.0, -0.6],
    "size_m": [0.6, 0.3, 0.3],
    "element_m": 0.15,
    "mu_r": 60.0,
    "source": "a test",
}
RING = [[2.0, 1.0, 0.4], [-2.0, 1.0, 0.5], [-2.0, -1.0, 0.5], [2.0, -1.0, 0.4]]
CABLE = [[1.0, 0.5, 0.2], [1.0, -0.5, 0.2], [0.4, -0.5, 0.2], [0.4, 0.5, 0.2]]
PULSE = {"kind": "pulse", "current_a": 300.0, "period_s": 1.3, "width_s": 0.4, "rise_s": 0.02}
TOY = {
    "datum": "a place of the toy",
    "mounts": {"tail": {"position_m": [-8.0, 0.0, 0.0], "source": "a test"}},
    "permanent": [
        {"name": "engine", "position_m": [0.8, 0.2, -0.5], "moment_am2": [30.0, -50.0, 80.0], "source": "a test"}
    ],
    "hinged": [
        {
            "name": "flap",
            "surface": "elevator",
            "position_m": [-4.0, 1.0, 0.2],
            "moment_am2": [20.0, 5.0, -60.0],
            "hinge_point_m": [-3.5, 0.0, 0.0],
            "hinge_axis": [0.0, 1.0, 0.0],
            "source": "a test",
        }
    ],
    "rotors": {"main": {"axis": [0.0, 0.0, 1.0], "speed_rpm": 60.0, "source": "a test"}},
    "rotating": [
        {
            "name": "hub",
            "rotor": "main",
            "position_m": [0.0, 0.0, -1.5],
            "moment_am2": [40.0, 0.0, -20.0],
            "blade": [1.0, 0.0, 0.0],
            "polarizability_m3": [0.02, 0.004, 0.004],
            "source": "a test",
        }
    ],
    "memory": {
        "radii_nt": [1000.0, 4000.0],
        "weights": [0.1, 0.1],
        "viscosity_s": [1.0, 10.0],
        "viscosity_weights": [0.05, 0.05],
        "source": "a test",
    },
    "steel": [STEEL],
    "coils": [{"name": "ring", "vertices_m": RING, "wire_radius_m": 0.02, "time_constant_s": 0.02, "source": "a test"}],
    "feeders": [
        {
            "name": "lamp",
            "wire_radius_m": 0.005,
            "load": PULSE,
            "source": "a test",
            "paths": [{"kind": "loop", "vertices_m": CABLE}],
        }
    ],
}
PARTS = ("permanent", "hinged", "propeller", "induced", "memory", "eddy", "electronics")


@pytest.fixture(scope="module")
def toy() -> Aircraft:
    return Aircraft("toy", load_aircraft("helicopter").facts, Magnetics.model_validate(TOY), "toy")


@pytest.fixture(scope="module")
def bird() -> Bird:
    """The shipped one, with one dipole alone."""
    shipped = load_bird("bird")
    told = shipped.magnetics.model_dump(by_alias=True, include={"datum", "mounts", "permanent"})
    return Bird("bird", shipped.facts, Magnetics.model_validate(told), "toy bird")


def scenario_of(**field: object) -> Scenario:
    return Scenario.model_validate(
        {
            "schema": 1,
            "seed": 3,
            "aircraft": "toy",
            "start": START,
            "pattern": {"kind": "straight"},
            "tow": {},
            "field": field,
            "sensors": {
                "scalar": [{"name": "above", "mount": "tail"}, {"name": "below", "body": "bird", "mount": "nose"}],
                "fluxgate": [{"name": "flux", "body": "bird", "mount": "tail_boom"}],
            },
        }
    )


def path_of(time_s: np.ndarray, place_e: np.ndarray, attitude: np.ndarray, reference_b: np.ndarray) -> Trajectory:
    """A body's motion through Earth-fixed places."""
    origin = place_e[0]
    curve = CubicSpline(time_s, place_e - origin)
    lat, lon, alt = geodetic_from_ecef(place_e)
    velocity_n = np.einsum("nij,nj->ni", rot_ne_at(lat, lon), curve(time_s, 1))
    rates = body_rates(attitude, CubicSpline(time_s, attitude)(time_s, 1))
    return Trajectory(time_s, lat, lon, alt, velocity_n, attitude, rates, reference_b)


def waves(time_s: np.ndarray, sizes_deg: tuple[float, ...], hertz: tuple[float, ...], shift: float) -> np.ndarray:
    phase = 2.0 * np.pi * np.outer(time_s, hertz) + shift + np.arange(3)
    return np.radians(sizes_deg) * np.sin(phase)


def flown(rope_m: float, trail_deg: float = 12.0, rate_hz: float = BODY_HZ) -> Flight:
    """Half a minute to the north-east, swung about all axes; below the hook a bird on a straight rope."""
    time = np.arange(-4 * rate_hz, 24 * rate_hz + 1) / rate_hz
    plane, along = TangentPlane(np.radians(48.7), np.radians(127.2), HEIGHT_M), SPEED_MPS * time
    lat, lon = plane.geodetic(along * np.cos(0.7), along * np.sin(0.7))
    center_e = ecef_from_geodetic(lat, lon, HEIGHT_M + 2.0 * np.sin(0.5 * time))
    attitude = waves(time, (8.0, 4.0, 3.0), (0.12, 0.2, 0.07), 0.3) + np.array([0.0, -0.03, 0.7])
    carrier = path_of(time, center_e, attitude, REFERENCE_B)
    to_n = rot_ne_at(lat, lon)
    to_e = np.einsum("nji,njk->nik", to_n, rot_nb_from_attitude(attitude))
    hook_e = center_e + np.einsum("nij,j->ni", to_e, HOOK_B - REFERENCE_B)
    trail, side, yaw = waves(time, (4.0, 9.0, 5.0), (0.09, 0.1, 0.4), 1.0).T
    trail = trail + np.radians(trail_deg)
    ahead, right = -np.sin(trail) * np.cos(side), np.sin(side)
    down = np.sqrt(1.0 - ahead**2 - right**2)
    hang_n = np.column_stack(
        [ahead * np.cos(0.7) - right * np.sin(0.7), ahead * np.sin(0.7) + right * np.cos(0.7), down]
    )
    bird_e = hook_e + rope_m * np.einsum("nji,nj->ni", to_n, hang_n)
    turned = np.column_stack([side, 0.15 + 0.5 * trail, 0.7 + yaw])
    controls = {"elevator": 0.3 * np.sin(0.9 * time)}
    segments: tuple = ()
    flight = Flight(carrier, 20.0, 120.0, controls, segments, ())
    return flight.with_bird(path_of(time, bird_e, turned, np.array([0.1, 0.0, 0.05])), {}, {"tow": {}})


def both(scenario: Scenario, toy: Aircraft, bird: Bird, flight: Flight) -> tuple[Situation, Situation]:
    above = with_background(Situation.of(scenario, toy.magnetics, flight, load_response(toy)))
    mounts, time = ("nose", "tail_boom"), above.time_s
    below = Situation.of(scenario, bird.magnetics, flight.of_bird(), load_response(bird), mounts=mounts, time_s=time)
    return above, with_background(below)


def turns(path: Trajectory) -> np.ndarray:
    """Rotations from body axes to Earth-fixed ones, (n, 3, 3)."""
    return np.einsum("nji,njk->nik", rot_ne_at(path.lat_rad, path.lon_rad), rot_nb_from_attitude(path.attitude))


def places_of(path: Trajectory, place_b: np.ndarray) -> np.ndarray:
    """Earth-fixed places of a point of a body."""
    center = ecef_from_geodetic(path.lat_rad, path.lon_rad, path.alt_m)
    return center + np.einsum("nij,j->ni", turns(path), np.asarray(place_b) - path.reference_b)


def seen_from(carrier: Trajectory, place_e: np.ndarray) -> np.ndarray:
    """Earth-fixed places in the axes of a carrier, from its datum."""
    center = ecef_from_geodetic(carrier.lat_rad, carrier.lon_rad, carrier.alt_m)
    return np.einsum("nji,nj->ni", turns(carrier), place_e - center) + carrier.reference_b


ROWS = np.arange(300, 3000, 190)


def directly(above: Situation, toy: Aircraft, places: np.ndarray) -> np.ndarray:
    """The field of the toy's fixed parts at one place for each of the rows, by its response there, (r, 3)."""
    field, out = above.scenario.field, np.zeros((len(ROWS), 3))
    response = response_at(toy, {f"{i}": tuple(place) for i, place in enumerate(places)})
    number = np.arange(len(ROWS))
    if field.is_on("permanent"):
        out += response.permanent_nt
    if field.is_on("induced"):
        out += np.einsum("nij,nj->ni", response.induced, above.ambient_b[ROWS])
    if field.is_on("memory"):
        out += np.einsum("nij,nj->ni", response.induced, remembered(above)[ROWS])
    if field.is_on("eddy"):
        late = eddy_field(response, number, above.ambient_rate_b, above.step_s, field.eddy)
        out += late[ROWS, number]
    if field.is_on("electronics"):
        out += response.wiring_nt_per_a[:, :, 0] * above.onboard.currents_a["lamp"][ROWS, None]
    return out


def turning_by_hand(above: Situation, places: np.ndarray) -> np.ndarray:
    """The field of what turns at one place for each of the rows, dipole by dipole, (r, 3)."""
    field, out, magnetics = above.scenario.field, np.zeros((len(ROWS), 3)), above.magnetics
    if field.is_on("hinged"):
        flap, angle = magnetics.hinged[0], 0.3 * np.sin(0.9 * above.time_s[ROWS])
        axis, hinge = np.array(flap.hinge_axis), np.array(flap.hinge_point_m)
        at = hinge + rotate_about(axis, angle, np.array(flap.position_m) - hinge)
        out += dipole_field(at, rotate_about(axis, angle, np.array(flap.moment_am2)), places)
    if field.is_on("propeller"):
        hub, motion = magnetics.rotating[0], turning_of(above, "main")
        # The mean over the step around each sample; the rotor keeps its speed in it, the places and the field stay.
        within = (np.arange(40) - 19.5) / 40.0 * above.step_s
        axis, along = np.array([0.0, 0.0, 1.0]), 1e-7 * 4.0 * np.pi * 1e9
        for ahead in within:
            angle = motion.phase[ROWS] + motion.speed[ROWS] * ahead
            blade = rotate_about(axis, angle, np.array(hub.blade))
            across = np.cross(axis, blade)
            alpha = zip(hub.polarizability_m3, (blade, across, np.broadcast_to(axis, blade.shape)), strict=True)
            steel = sum(
                size * np.einsum("ni,ni->n", unit, above.ambient_b[ROWS])[:, None] * unit for size, unit in alpha
            )
            moment = rotate_about(axis, angle, np.array(hub.moment_am2)) + steel / along
            out += dipole_field(np.array(hub.position_m), moment, places) / len(within)
    return out


@pytest.mark.parametrize("rope_m", [5.0, 12.0, 60.0])
@pytest.mark.parametrize("on", [PARTS, *((part,) for part in PARTS)], ids=lambda on: on[0] if len(on) == 1 else "all")
def test_the_carriers_field_is_that_of_its_response_at_each_place(
    toy: Aircraft, bird: Bird, rope_m: float, on: tuple[str, ...]
) -> None:
    """At places that the interpolation never saw, each part alone and all together."""
    field = {part: {"enabled": part in on} for part in PARTS}
    above, below = both(scenario_of(**field), toy, bird, flown(rope_m))
    got = carrier_field(above, toy, below)
    for s, mount in enumerate(below.mounts):
        places = seen_from(above.motion, places_of(below.motion, bird.mounts[mount]))[ROWS]
        assert np.ptp(places, axis=0).max() > 0.2 * rope_m
        field_c = directly(above, toy, places) + turning_by_hand(above, places)
        exact = np.einsum(
            "nij,njk,nk->ni", np.swapaxes(turns(below.motion)[ROWS], 1, 2), turns(above.motion)[ROWS], field_c
        )
        size = np.linalg.norm(exact, axis=1)
        assert size.max() > 1e-4
        assert np.abs(got[ROWS, s] - exact).max() < 1e-3 * size.max()


def test_what_turns_is_followed_exactly(toy: Aircraft, bird: Bird) -> None:
    above, _ = both(scenario_of(), toy, bird, flown(5.0))
    places = np.array([0.5, -2.0, 6.0]) + 2.0 * np.sin(above.time_s[:, None, None] * [0.3, 0.5, 0.7])
    exact = turning_by_hand(above, places[ROWS, 0])
    got = turning_field(above, places)[ROWS, 0]
    # The turning of the rotor by midpoints of 40 parts of a step leaves 1e-7 of it.
    np.testing.assert_allclose(got, exact, rtol=0, atol=1e-6 * np.abs(exact).max())


def test_a_bird_in_the_metal_is_refused(toy: Aircraft, bird: Bird) -> None:
    """Two decimeters beside a wire the field cannot be interpolated: it is said how badly, and what helps."""
    above, _ = both(scenario_of(), toy, bird, flown(5.0))
    time = above.time_s[:, None, None]
    near = np.array([0.0, 1.2, 0.6]) + np.array([1.5, 0.0, 0.1]) * np.sin(np.array([0.9, 0.5, 0.7]) * time)
    metal_field(above, toy, near + np.array([0.0, 0.0, 6.0]))
    with pytest.raises(
        RequestError,
        match=r"^tow\.rope: the bird swings so near to the metal of toy that its field there is known to [\d.e+]+ nT "
        r"of [\d.e+]+ nT only; allowed: a longer rope, a hook farther off, or field\.carrier\.enabled = false$",
    ):
        metal_field(above, toy, near)


def test_parts_and_bodies(toy: Aircraft, bird: Bird) -> None:
    """The carrier is as without a bird, to the bit; the parts at the bird add up; the carrier's part has its scale."""
    flight = flown(12.0)
    truths = compute_tow_field(scenario_of(), toy, bird, flight)
    alone = compute_field(scenario_of(), toy, flight)
    assert truths["carrier"].mounts == alone.mounts == ("tail",)
    assert set(truths["carrier"].parts_b) == set(alone.parts_b)
    for name, part in alone.parts_b.items():
        np.testing.assert_array_equal(truths["carrier"].parts_b[name], part)
    below = truths["bird"]
    assert below.mounts == ("nose", "tail_boom")
    assert set(below.steady_nt) == {"nose"}
    assert "carrier" in below.parts_b
    for s, mount in enumerate(below.mounts):
        whole = sum(part[:, s] for part in below.parts_b.values())
        np.testing.assert_allclose(below.total(mount), whole, rtol=0, atol=1e-9)
        own = sum(below.part(name, mount) for name in below.parts_b if name not in {"earth", "carrier"})
        np.testing.assert_allclose(below.platform(mount), own + below.part("carrier", mount), rtol=0, atol=1e-9)
        # The dipole of the bird, at its own mount.
        moments = bird.magnetics.permanent
        own = sum(dipole_field(d.position_m, np.array(d.moment_am2), bird.mounts[mount]) for d in moments)
        np.testing.assert_allclose(below.part("permanent", mount)[::500], np.tile(own, (7, 1)), rtol=1e-12)
    double = compute_tow_field(scenario_of(carrier={"scale": -2.0}), toy, bird, flight)["bird"]
    np.testing.assert_allclose(double.parts_b["carrier"], -2.0 * below.parts_b["carrier"], rtol=1e-12)
    off = compute_tow_field(scenario_of(carrier={"enabled": False}), toy, bird, flight)["bird"]
    assert "carrier" not in off.parts_b
    np.testing.assert_array_equal(off.parts_b["earth"], below.parts_b["earth"])


def test_both_bodies_have_the_same_samples(toy: Aircraft, bird: Bird) -> None:
    """Logs of different rates end and begin where they do; what is computed lies within both."""
    flight = flown(12.0)
    rows = (flight.bird.time_s > -3.96) & (flight.bird.time_s < 23.95)
    shorter = replace(flight, bird=flight.bird.take(rows))
    time = simulation_times(shorter)
    assert 0.0 in time
    assert flight.bird.time_s[rows][0] <= time[0] < flight.bird.time_s[rows][0] + 1.0 / 120.0
    truths = compute_tow_field(scenario_of(), toy, bird, shorter)
    for truth in truths.values():
        np.testing.assert_array_equal(truth.time_s, time)
    whole = compute_tow_field(scenario_of(), toy, bird, flight)["bird"]
    same = np.isin(whole.time_s, time)
    inside = slice(240, -240)
    for name in ("earth", "carrier"):
        np.testing.assert_allclose(
            truths["bird"].parts_b[name][inside], whole.parts_b[name][same][inside], rtol=0, atol=5e-3
        )


# ---- the background at the bird --------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def towed() -> tuple[Scenario, Flight]:
    """A bird as it is flown, in gusts, over rough geology."""
    helicopter, bird = load_aircraft("helicopter"), load_bird("bird")
    raw = scenario_of(crust={"rms_nt": 200.0, "depth_m": 150.0}, hinged={"enabled": False}).model_dump(by_alias=True)
    raw |= {"aircraft": "helicopter", "pattern": {"kind": "straight", "leg_m": 800.0}, "recording": {"valid_legs": []}}
    raw["tow"] = {"settle_s": 20.0, "gusts": {"speed_mps": 1.0}}
    raw["sensors"]["scalar"] = [raw["sensors"]["scalar"][1]]
    scenario = Scenario.model_validate(raw, context={"aircraft": helicopter, "bird": bird})
    return scenario, fly(scenario, helicopter, bird=bird)


def test_the_background_is_that_at_the_birds_own_place(
    towed: tuple[Scenario, Flight], toy: Aircraft, bird: Bird
) -> None:
    """IGRF and crust evaluated at each mount's own Earth-fixed place, through a swinging and shaking bird."""
    scenario, flight = towed
    truth = compute_tow_field(scenario, toy, bird, flight)["bird"]
    rows = slice(480, -480, 37)
    path, crust = flight.bird.at(truth.time_s[rows]), crust_of(scenario, None)
    years = decimal_years(scenario.start.time_utc, path.time_s)
    for mount in truth.mounts:
        place_e = places_of(path, np.array(bird.mounts[mount]))
        lat, lon, alt = geodetic_from_ecef(place_e)
        to_n = rot_ne_at(lat, lon)
        main_e = np.einsum("nji,nj->ni", to_n, igrf(lat, lon, alt, years))
        crust_e = crust.field_e(place_e)
        for name, exact in (("earth", main_e), ("crust", crust_e)):
            got = np.einsum("nij,nj->ni", turns(path), truth.part(name, mount)[rows])
            assert np.abs(got - exact).max() < 2e-4
        clean = np.linalg.norm(truth.background(mount)[rows], axis=1)
        assert np.abs(clean - np.linalg.norm(main_e + crust_e, axis=1)).max() < 2e-4
    # It is not that of the carrier, thirty meters higher.
    lat, lon, alt = (getattr(flight.carrier.at(path.time_s), name) for name in ("lat_rad", "lon_rad", "alt_m"))
    higher = np.linalg.norm(igrf(lat, lon, alt, years), axis=1)
    lower = np.linalg.norm(truth.part("earth", "nose")[rows], axis=1)
    assert 0.3 < np.mean(lower - higher) < 1.5


# ---- swing -----------------------------------------------------------------------------------------------------


def gain_of(hertz: float) -> float:
    """Of the smoother: 1 / (1 + (sin(pi f T) / sin(pi f0 T))^6), T = 0.5 s, f0 = 0.03 Hz."""
    return 1.0 / (1.0 + (np.sin(0.5 * np.pi * hertz) / np.sin(0.5 * np.pi * 0.03)) ** 6)


def test_the_smoother_passes_parabolas() -> None:
    time = np.arange(400.0)
    rows = np.column_stack([np.ones(400), 3.0 * time - 20.0, 0.01 * time**2 - time])
    np.testing.assert_allclose(whittaker(rows, 1e7), rows, rtol=0, atol=1e-4)


@pytest.mark.parametrize(("hertz", "low", "high"), [(0.005, 0.9999, 1.0), (0.03, 0.499, 0.501), (0.3, 0.0, 2e-6)])
def test_half_of_a_motion_of_30_millihertz_is_left(hertz: float, low: float, high: float) -> None:
    """On the track of a body: a motion aside of some frequency, in the middle of eight minutes."""
    time = np.arange(-240.0, 240.01, 0.1)
    moved = still_path(time, aside_m=10.0 * np.sin(2.0 * np.pi * hertz * time))
    plain = places_of(still_path(time), np.zeros(3))
    smooth = smoothed(moved, places_of(moved, np.zeros(3)))
    aside = places_of(smooth, np.zeros(3)) - plain
    right = (places_of(moved, np.zeros(3)) - plain) / 10.0
    middle = np.abs(time) < 60.0
    share = np.einsum("ni,ni->n", aside, right)[middle].sum() / (
        10.0 * np.einsum("ni,ni->n", right, right)[middle].sum()
    )
    assert low <= share <= high
    assert share == pytest.approx(gain_of(hertz), rel=2e-3, abs=1e-6)
    np.testing.assert_allclose(smooth.velocity_n[middle, 0], SPEED_MPS, rtol=0, atol=1e-3)


def still_path(time_s: np.ndarray, aside_m: float | np.ndarray = 0.0, up_m: float | np.ndarray = 0.0) -> Trajectory:
    """Straight to the north, but for motions to the right and up; the body itself does not turn."""
    plane = TangentPlane(np.radians(48.7), np.radians(127.2), HEIGHT_M)
    lat, lon = plane.geodetic(SPEED_MPS * time_s, np.zeros(len(time_s)) + aside_m)
    place_e = ecef_from_geodetic(lat, lon, HEIGHT_M - 30.0 + up_m)
    return path_of(time_s, place_e, np.zeros((len(time_s), 3)), np.zeros(3))


def swing_of(path: Trajectory, bird: Bird) -> tuple[np.ndarray, np.ndarray, Situation]:
    """Times, clean less steady at the nose, and the situation."""
    scenario = scenario_of()
    flight = Flight(path, float(path.time_s[-1] - 4.0), 120.0, {}, (), ())
    below = Situation.of(scenario, bird.magnetics, flight, load_response(bird), mounts=("nose",))
    below = with_background(below)
    clean = np.linalg.norm(below.background["earth"][:, 0], axis=1)
    return below.time_s, clean - steady_background(below, "nose"), below


def test_swinging_in_a_known_gradient_changes_what_it_should(bird: Bird) -> None:
    """A motion of 0.1 Hz, three meters up and down, in the vertical gradient of the main field."""
    time, hertz = np.arange(-60 * 30, 160 * 30 + 1) / 30.0, 0.1
    path = still_path(time, up_m=3.0 * np.sin(2.0 * np.pi * hertz * time))
    at, swing, below = swing_of(path, bird)
    place = below.motion
    years = decimal_years(below.scenario.start.time_utc, at)
    field, slopes = igrf(place.lat_rad, place.lon_rad, place.alt_m, years, gradient=True)
    down = np.einsum("ni,ni->n", field, slopes[:, :, 2]) / np.linalg.norm(field, axis=1)
    expected = -down * 3.0 * np.sin(2.0 * np.pi * hertz * at)
    largest = np.abs(expected).max()
    assert largest == pytest.approx(0.088, rel=0.1)
    # 7e-4 of such a motion is left in the smooth track; near its ends the track follows a part of it.
    missed = np.abs(swing - (1.0 - gain_of(hertz)) * expected) / largest
    from_end = np.minimum(at - at[0], at[-1] - at)
    assert missed[from_end > 60.0].max() < 1e-3
    assert missed[from_end > 30.0].max() < 0.03
    assert missed[from_end > 10.0].max() < 0.15


def test_a_bird_that_does_not_swing_changes_nothing(bird: Bird) -> None:
    """The path over the round Earth is a parabola: even at its ends nothing is left."""
    time = np.arange(-4 * 30, 60 * 30 + 1) / 30.0
    _, swing, _ = swing_of(still_path(time), bird)
    assert np.abs(swing).max() < 2e-5
    _, swing, _ = swing_of(still_path(time, up_m=0.2 * time + 0.001 * time**2), bird)
    assert np.abs(swing).max() < 2e-5


def test_the_mount_swings_with_the_body(bird: Bird) -> None:
    """A bird that nods about its center moves its nose, 0.95 m ahead, up and down; its tail the other way."""
    time, hertz = np.arange(-4 * 30, 60 * 30 + 1) / 30.0, 0.4
    still = still_path(time)
    nod = np.radians(5.0) * np.sin(2.0 * np.pi * hertz * time)
    attitude = np.column_stack([np.zeros_like(nod), nod, np.zeros_like(nod)])
    rates = body_rates(attitude, np.column_stack([np.zeros_like(nod), np.gradient(nod, time), np.zeros_like(nod)]))
    at, swing, below = swing_of(replace(still, attitude=attitude, rate_b=rates), bird)
    _, level, _ = swing_of(still_path(time, up_m=0.95 * np.sin(nod)), bird)
    assert np.abs(level).max() > 1e-3
    inside = (at > 5.0) & (at < 55.0)
    # The rest is that of cos, of second order and along the line.
    assert np.abs(swing - level)[inside].max() < 0.05 * np.abs(level).max() + 2e-5
    assert below.mounts == ("nose",)

"""A toy carrier with a source of every kind, and the shipped bird below it on a rope that swings."""

import numpy as np
from scipy.interpolate import CubicSpline

from magsim.aircraft import Aircraft, Bird, Magnetics, load_aircraft, load_bird
from magsim.earth import ecef_from_geodetic, geodetic_from_ecef, rot_ne_at
from magsim.field import load_response
from magsim.field.composition import backgrounds_of, situation_of
from magsim.field.excitation import FlightExcitation
from magsim.field.situation import Situation, used_mounts
from magsim.frames import rot_nb_from_attitude
from magsim.scenario import Scenario
from magsim.terrain import TangentPlane
from magsim.trajectory import Flight, Trajectory
from tests.support.rotations import body_rates

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
    "suspension": "rubber",
    "source": "a test",
}
RING = [[2.0, 1.0, 0.4], [-2.0, 1.0, 0.5], [-2.0, -1.0, 0.5], [2.0, -1.0, 0.4]]
CABLE = [[1.0, 0.5, 0.2], [1.0, -0.5, 0.2], [0.4, -0.5, 0.2], [0.4, 0.5, 0.2]]
PULSE = {"kind": "pulse", "current_a": 300.0, "period_s": 1.3, "width_s": 0.4, "rise_s": 0.02}
TOY = {
    "datum": "a place of the toy",
    "mounts": {"tail": {"position_m": [-8.0, 0.0, 0.0], "source": "a test"}},
    "permanent": [
        {
            "name": "engine",
            "position_m": [0.8, 0.2, -0.5],
            "moment_am2": [30.0, -50.0, 80.0],
            "suspension": "rubber",
            "source": "a test",
        }
    ],
    "suspensions": {"rubber": {"position_m": [0.8, 0.2, -0.5], "compliance_mmpg": [0.2, 1.0, 1.5], "source": "a test"}},
    "controls": [
        {
            "name": "yoke",
            "surface": "elevator",
            "position_m": [1.0, 0.0, 0.3],
            "moment_am2": [10.0, 0.0, 30.0],
            "travel_mmpdeg": [10.0, 0.0, 5.0],
            "source": "a test",
        }
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
            "suspension": "rubber",
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


def toy_aircraft() -> Aircraft:
    """Return a carrier with one source of every kind."""
    return Aircraft("toy", load_aircraft("helicopter").facts, Magnetics.model_validate(TOY))


def toy_bird() -> Bird:
    """Return the shipped bird with its dipoles as the only sources."""
    shipped = load_bird("bird")
    kept = shipped.magnetics.model_dump(by_alias=True, include={"datum", "mounts", "permanent"})
    return Bird("bird", shipped.facts, Magnetics.model_validate(kept))


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


def both(scenario: Scenario, toy: Aircraft, bird: Bird, flight: Flight) -> tuple[FlightExcitation, Situation]:
    """The excitation of the carrier and the situation of the bird, both with their background."""
    known = backgrounds_of(scenario, flight)
    carrier = situation_of(scenario, toy, load_response(toy), known["carrier"], used_mounts(scenario))
    below = situation_of(scenario, bird, load_response(bird), known["bird"], ("nose", "tail_boom"))
    return FlightExcitation(carrier), below


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

"""The carrier's field at a bird against its own response at each place."""

import numpy as np
import pytest

from magsim.aircraft import Aircraft, Bird
from magsim.errors import RequestError
from magsim.field import response_at
from magsim.field.excitation import FlightExcitation
from magsim.field.metal import eddy
from magsim.field.sources.dipoles import dipole_field
from magsim.field.sources.memory import remembered
from magsim.field.tow.carrier import carrier_field, linear_field, turning_field
from tests.support.rotations import rotate_about
from tests.support.toy_tow import both, flown, places_of, scenario_of, seen_from, turns

PARTS = ("permanent", "hinged", "controls", "suspension", "propeller", "induced", "memory", "eddy", "electronics")


ROWS = np.arange(300, 3000, 190)


def directly(above: FlightExcitation, toy: Aircraft, places: np.ndarray) -> np.ndarray:
    """The field of the toy's parts that do not turn at one place for each of the rows, (r, 3)."""
    field, out = above.settings, np.zeros((len(ROWS), 3))
    response = response_at(toy, {f"{i}": tuple(place) for i, place in enumerate(places)})
    if field.is_on("permanent"):
        out += response.permanent_nt
    if field.is_on("induced"):
        out += np.einsum("nij,nj->ni", response.induced, above.ambient_b[ROWS])
    if field.is_on("memory"):
        out += np.einsum(
            "nij,nj->ni",
            response.induced,
            remembered(above.magnetics.memory, above.ambient_b, above.step_s, field.memory)[ROWS],
        )
    if field.is_on("eddy"):
        late = eddy.states(response.modes, above.ambient_rate_b, above.step_s)
        out += np.einsum("nik,nk->ni", response.field, late[ROWS])
    if field.is_on("electronics"):
        out += response.wiring_nt_per_a[:, :, 0] * above.currents_a["lamp"][ROWS, None]
    if field.is_on("suspension"):
        engine, hub = toy.magnetics.permanent[0], np.array(toy.magnetics.rotating[0].position_m)
        place, moment, turning = np.array(engine.position_m), np.array(engine.moment_am2), turning_moment(above)
        way = -above.load_g(place)[ROWS] * [0.2e-3, 1.0e-3, 1.5e-3]
        out += dipole_field(place + way, moment, places) - dipole_field(place, moment, places)
        out += np.mean(dipole_field(hub + way, turning, places) - dipole_field(hub, turning, places), axis=0)
        from_there = response_at(toy, {f"{i}": tuple(place) for i, place in enumerate(places - way)})
        out += np.einsum("nij,nj->ni", from_there.induced - response.induced, above.ambient_b[ROWS])
    return out


def turning_moment(above: FlightExcitation) -> np.ndarray:
    """The moment of the rotor at instants of the step around each of the rows, (m, r, 3)."""
    hub, motion = above.magnetics.rotating[0], above.rotations["main"]
    # The rotor keeps its speed in a step; the places and the field stay.
    axis, along = np.array([0.0, 0.0, 1.0]), 1e-7 * 4.0 * np.pi * 1e9
    out = []
    for ahead in (np.arange(40) - 19.5) / 40.0 * above.step_s:
        angle = motion.phase[ROWS] + motion.speed[ROWS] * ahead
        blade = rotate_about(axis, angle, np.array(hub.blade))
        across = np.cross(axis, blade)
        alpha = zip(hub.polarizability_m3, (blade, across, np.broadcast_to(axis, blade.shape)), strict=True)
        steel = sum(size * np.einsum("ni,ni->n", unit, above.ambient_b[ROWS])[:, None] * unit for size, unit in alpha)
        out.append(rotate_about(axis, angle, np.array(hub.moment_am2)) + steel / along)
    return np.stack(out)


def turning_by_hand(above: FlightExcitation, places: np.ndarray) -> np.ndarray:
    """The field of what turns at one place for each of the rows, dipole by dipole, (r, 3)."""
    field, out, magnetics = above.settings, np.zeros((len(ROWS), 3)), above.magnetics
    if field.is_on("hinged"):
        flap, angle = magnetics.hinged[0], 0.3 * np.sin(0.9 * above.situation.time_s[ROWS])
        axis, hinge = np.array(flap.hinge_axis), np.array(flap.hinge_point_m)
        at = hinge + rotate_about(axis, angle, np.array(flap.position_m) - hinge)
        out += dipole_field(at, rotate_about(axis, angle, np.array(flap.moment_am2)), places)
    if field.is_on("controls"):
        yoke, angle = magnetics.controls[0], 0.3 * np.sin(0.9 * above.situation.time_s[ROWS])
        at = np.array(yoke.position_m) + np.outer(np.degrees(angle), [0.01, 0.0, 0.005])
        out += dipole_field(at, np.array(yoke.moment_am2), places)
    if field.is_on("propeller"):
        hub = np.array(magnetics.rotating[0].position_m)
        out += np.mean(dipole_field(hub, turning_moment(above), places), axis=0)
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
        places = seen_from(above.situation.motion, places_of(below.motion, bird.mounts[mount]))[ROWS]
        assert np.ptp(places, axis=0).max() > 0.2 * rope_m
        field_c = directly(above, toy, places) + turning_by_hand(above, places)
        exact = np.einsum(
            "nij,njk,nk->ni", np.swapaxes(turns(below.motion)[ROWS], 1, 2), turns(above.situation.motion)[ROWS], field_c
        )
        size = np.linalg.norm(exact, axis=1)
        assert size.max() > 1e-8
        assert np.abs(got[ROWS, s] - exact).max() < 1e-3 * size.max()


def test_turning_parts_are_followed_exactly(toy: Aircraft, bird: Bird) -> None:
    above, _ = both(scenario_of(), toy, bird, flown(5.0))
    places = np.array([0.5, -2.0, 6.0]) + 2.0 * np.sin(above.situation.time_s[:, None, None] * [0.3, 0.5, 0.7])
    exact = turning_by_hand(above, places[ROWS, 0])
    got = turning_field(above, places)[ROWS, 0]
    # The turning of the rotor by midpoints of 40 parts of a step leaves 1e-7 of it.
    np.testing.assert_allclose(got, exact, rtol=0, atol=1e-6 * np.abs(exact).max())


def test_a_bird_in_the_metal_is_refused(toy: Aircraft, bird: Bird) -> None:
    """Two decimeters beside a wire the field cannot be interpolated: the message has the error and the remedies."""
    above, _ = both(scenario_of(), toy, bird, flown(5.0))
    time = above.situation.time_s[:, None, None]
    near = np.array([0.0, 1.2, 0.6]) + np.array([1.5, 0.0, 0.1]) * np.sin(np.array([0.9, 0.5, 0.7]) * time)
    linear_field(above, toy, near + np.array([0.0, 0.0, 6.0]))
    with pytest.raises(
        RequestError,
        match=r"^tow\.rope: the bird swings so near to the metal of toy that its field there is known to [\d.e+]+ nT "
        r"of [\d.e+]+ nT only; allowed: a longer rope, a hook farther off, or field\.carrier\.enabled = false$",
    ):
        linear_field(above, toy, near)

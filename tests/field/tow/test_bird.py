"""The field of a tow: carrier and bird, their parts, and the background at the bird's own place."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.aircraft import Aircraft, Bird, load_aircraft, load_bird
from magsim.columns import PLATFORM
from magsim.earth import decimal_years, geodetic_from_ecef, igrf, rot_ne_at
from magsim.field import compute_field, compute_tow_field
from magsim.field.background.crust import crust_of
from magsim.field.background.departure import departure_of, vector_along
from magsim.field.situation import simulation_times
from magsim.field.sources.dipoles import dipole_field
from magsim.flight import fly
from magsim.scenario import Scenario
from magsim.trajectory import Flight
from tests.support.toy_tow import flown, places_of, scenario_of, turns


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
        own = sum(below.part(name, mount) for name in below.parts_b if name in set(PLATFORM) - {"carrier"})
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
    """IGRF, departure and crust at each mount's own Earth-fixed place, through a swinging and shaking bird."""
    scenario, flight = towed
    truth = compute_tow_field(scenario, toy, bird, flight)["bird"]
    rows = slice(480, -480, 37)
    path, crust, departure = flight.bird.at(truth.time_s[rows]), crust_of(scenario, None), departure_of(scenario)
    years = decimal_years(scenario.start.time_utc, path.time_s)
    for mount in truth.mounts:
        place_e = places_of(path, np.array(bird.mounts[mount]))
        lat, lon, alt = geodetic_from_ecef(place_e)
        to_n = rot_ne_at(lat, lon)
        main_e = np.einsum("nji,nj->ni", to_n, igrf(lat, lon, alt, years))
        crust_e = crust.field_e(place_e)
        vector_e = vector_along(departure, scenario, truth.time_s)[rows]
        departure_e = departure.expanded(place_e)[0] + vector_e
        for name, exact in (("earth", main_e), ("departure", departure_e), ("crust", crust_e)):
            got = np.einsum("nij,nj->ni", turns(path), truth.part(name, mount)[rows])
            assert np.abs(got - exact).max() < 2e-4
        clean = np.linalg.norm(truth.background(mount)[rows], axis=1)
        assert np.abs(clean - np.linalg.norm(main_e + departure_e + crust_e, axis=1)).max() < 2e-4
    # It is not that of the carrier, thirty meters higher.
    lat, lon, alt = (getattr(flight.carrier.at(path.time_s), name) for name in ("lat_rad", "lon_rad", "alt_m"))
    higher = np.linalg.norm(igrf(lat, lon, alt, years), axis=1)
    lower = np.linalg.norm(truth.part("earth", "nose")[rows], axis=1)
    assert 0.3 < np.mean(lower - higher) < 1.5

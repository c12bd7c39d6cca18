"""A bird under a kinematic carrier."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from magsim.aircraft import Aircraft, Bird
from magsim.earth import rot_ne_at
from magsim.flight import fly
from magsim.scenario import Scenario
from tests.support.helicopters import HEIGHT_M, LINE, PLACES, SPEED_MPS, WIND, places

ScenarioOf = Callable[..., Scenario]


@pytest.mark.parametrize("place", list(PLACES))
def test_a_bird_trails_behind_wherever_it_is_towed(
    helicopter_scenario: ScenarioOf, helicopter: Aircraft, bird: Bird, place: str
) -> None:
    """The place of the bird from Earth-fixed places; the Earth's turning pulls it aside by 2 w V sin(lat)."""
    flight = fly(
        helicopter_scenario(LINE, place, tow={"settle_s": 30.0, "gusts": {"speed_mps": 0.0}}, air=WIND),
        helicopter,
        bird=bird,
    )
    time = np.arange(0.0, flight.duration_s, 0.5)
    above, below = flight.carrier.at(time), flight.bird.at(time)
    hang = np.einsum("nij,nj->ni", rot_ne_at(above.lat_rad, above.lon_rad), places(below) - places(above))
    air_n = above.velocity_n - flight.wind_at(time)
    forward = air_n[:, :2] / SPEED_MPS
    ahead = np.einsum("ni,ni->n", hang[:, :2], forward)
    right = hang[:, 1] * forward[:, 0] - hang[:, 0] * forward[:, 1]
    # The hook is 1.1 m under the carrier's center of gravity; the rope has 30 m.
    np.testing.assert_allclose(np.linalg.norm(hang - [0.0, 0.0, 1.1], axis=1), 30.2, rtol=0, atol=0.15)
    trail = np.degrees(np.arctan2(-ahead, hang[:, 2] - 1.1))
    assert np.abs(trail - 9.0).max() < 0.2
    ground_mps = math.hypot(*above.velocity_n[0, :2])
    aside = 2.0 * 7.292115e-5 * ground_mps * math.sin(above.lat_rad[0]) / 9.81
    # The lift of the bird, some percent of its weight, lets it hang the farther aside.
    np.testing.assert_allclose(right / hang[:, 2], aside, rtol=0.25, atol=2e-4)
    assert flight.bird.alt_m.max() < HEIGHT_M - 29.0
    assert np.abs(np.diff(flight.bird.lon_rad)).max() < math.radians(0.2)


def test_a_bird_swings_the_same_however_densely_its_carrier_is_logged(
    helicopter_scenario: ScenarioOf, helicopter: Aircraft, bird: Bird
) -> None:
    """The hook lies 1.1 m under a body that rolls with the sway: what it does must not be an effect of the log."""
    tow = {"settle_s": 20.0, "gusts": {"speed_mps": 0.0}}
    flights = [
        fly(helicopter_scenario(LINE, flight={"log_hz": rate}, tow=tow), helicopter, bird=bird)
        for rate in (30, 20, 60, 120)
    ]
    time = np.arange(0.0, 20.0, 0.1)
    first, *others = flights
    assert np.ptp(np.degrees(first.rope_at(time)["side_rad"])) > 3.0
    for other in others:
        assert np.abs(places(other.bird.at(time)) - places(first.bird.at(time))).max() < 0.03
        assert np.degrees(np.abs(other.bird.at(time).attitude - first.bird.at(time).attitude)).max() < 0.1
    # 1.4 degrees of roll, even up to 0.4 Hz and gone beyond: some times (2 pi 0.3)^2, on 1.1 m.
    rolling = np.diff(first.carrier.rate_b[:, 0]) * first.carrier.rate_hz
    assert 1.1 * np.std(rolling) < 0.2

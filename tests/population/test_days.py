"""Days of an individual: what walks, what follows the weather, and what is drawn afresh."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import kstest

from magsim.aircraft import Aircraft, load_aircraft, load_bird
from magsim.population import DAY, MAGNETS, individual_of, on_day
from magsim.population.days import walk
from magsim.streams import stream
from tests.support.populations import day_p_values, dipoles

COLD_C, WARM_C = -10.0, 30.0


@pytest.fixture(scope="module")
def third() -> Aircraft:
    return individual_of(load_aircraft("c208b"), 3)


def _moments(vehicle: Aircraft) -> dict[str, np.ndarray]:
    return {dipole.name: np.array(dipole.moment_am2) for dipole in dipoles(vehicle.magnetics)}


def test_day_0_is_the_individual_as_built(third: Aircraft) -> None:
    assert on_day(third, 3, 0, WARM_C) is third


def test_a_day_is_the_same_whichever_is_asked_for_first(third: Aircraft) -> None:
    fifth = on_day(third, 3, 5, 20.0)
    on_day(third, 3, 9, 20.0)
    assert on_day(third, 3, 5, 20.0).digest == fifth.digest
    assert len({on_day(third, 3, day, 20.0).digest for day in range(5)}) == 5
    assert fifth.nominal is third.nominal


def test_remanence_walks_by_steps_of_the_stated_size() -> None:
    """Day d is day d - 1 and one step: median 1 %, 95th percentile 5 %, in any direction."""
    steps = []
    for number in range(60):
        places = [walk(stream(number, "a test"), day) for day in range(1, 11)]
        steps += [places[0], *np.diff(places, axis=0)]
    sizes = np.linalg.norm(steps, axis=1)
    median, late = DAY["remanence"].size
    sigma = math.log(late / median) / 1.6448536
    assert kstest(np.log(sizes / median) / sigma, "norm").pvalue > 0.01
    assert np.quantile(sizes, 0.5) == pytest.approx(median, rel=0.1)
    assert np.quantile(sizes, 0.95) == pytest.approx(late, rel=0.2)
    assert kstest(0.5 * (np.array(steps)[:, 2] / sizes + 1.0), "uniform").pvalue > 0.01


def test_part_by_part_steel_walks_and_magnets_follow_the_temperature(third: Aircraft) -> None:
    built, cold, warm = _moments(third), *(_moments(on_day(third, 3, 4, air_c)) for air_c in (COLD_C, WARM_C))
    changes = []
    for dipole in dipoles(third.magnetics):
        name = dipole.name
        if dipole.magnet:
            per_k = MAGNETS[dipole.magnet][0]
            np.testing.assert_allclose(cold[name], built[name] * (1.0 + per_k * (COLD_C - 20.0)), rtol=1e-12)
            np.testing.assert_allclose(warm[name], built[name] * (1.0 + per_k * (WARM_C - 20.0)), rtol=1e-12)
        else:
            np.testing.assert_array_equal(cold[name], warm[name])
            changes.append(np.linalg.norm(warm[name] - built[name]) / np.linalg.norm(built[name]))
    assert 0.003 < np.median(changes) < 0.1
    assert len(np.unique(np.round(changes, 9))) == len(changes)


def test_cold_aluminum_conducts_better(third: Aircraft) -> None:
    """0.2 % for each kelvin, and with it every time constant of a loop."""
    cold = on_day(third, 3, 1, 0.0).magnetics.skin
    for part, built in zip(cold.parts, third.magnetics.skin.parts, strict=True):
        assert part.conductivity_spm == pytest.approx(built.conductivity_spm / 0.96)
        assert part.seams_ohm_m != built.seams_ohm_m
    drone = individual_of(load_aircraft("uav"), 1)
    for coil, built in zip(on_day(drone, 1, 1, 0.0).magnetics.coils, drone.magnetics.coils, strict=True):
        assert (coil.time_constant_s or coil.conductivity_spm) == pytest.approx(
            (built.time_constant_s or built.conductivity_spm) / 0.96
        )


def test_what_walks_and_scatters_does_so_as_stated(third: Aircraft) -> None:
    found = day_p_values(third, 3, 30)
    assert {name: p for name, p in found.items() if not p > 0.01} == {}


def test_crew_and_cases_sit_elsewhere_every_day(third: Aircraft) -> None:
    boxes = {part.name: part for part in third.magnetics.carried}
    assert len(boxes) >= 3
    places = []
    for day in range(1, 31):
        today = on_day(third, 3, day, 20.0).magnetics
        assert not today.carried
        aboard = [dipole for dipole in today.permanent if dipole.name in boxes]
        assert len(aboard) == len(boxes)
        for dipole in aboard:
            box = boxes[dipole.name]
            least, largest = box.moment_am2
            assert least <= np.linalg.norm(dipole.moment_am2) <= largest
            off = np.array(dipole.position_m) - np.array(box.center_m)
            assert np.all(np.abs(off) <= 0.5 * np.array(box.size_m))
            room = 0.3 if dipole.seated else 0.2
            assert min(math.dist(dipole.position_m, place) for place in third.mounts.values()) >= room
            places.append(dipole.position_m)
    assert len(set(places)) == len(places)
    assert {dipole.name for dipole in third.magnetics.permanent}.isdisjoint(boxes)


def test_a_bird_has_days_too() -> None:
    bird = individual_of(load_bird("bird"), 2)
    later = on_day(bird, 2, 3, 5.0)
    assert later.magnetics.permanent[0].moment_am2 != bird.magnetics.permanent[0].moment_am2
    assert later.magnetics.steel == bird.magnetics.steel
    assert on_day(replace(bird, name="other"), 2, 3, 5.0).magnetics.permanent != later.magnetics.permanent

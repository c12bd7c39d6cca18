"""The chain of a scenario's tow: default values, and messages without an equilibrium."""

import math
import re

import pytest

from magsim.aircraft import Bird, load_aircraft, load_bird
from magsim.errors import RequestError
from magsim.flight.tow.equilibrium import find_equilibrium
from magsim.flight.tow.setup import MOST_TRAIL, chain_of, hangs, hook_of, require_equilibrium
from magsim.scenario import Tow

DENSITY = 1.1


@pytest.fixture(scope="module")
def bird() -> Bird:
    return load_bird("bird")


def tow_of(bird: Bird, *, rope: dict | None = None, **body: object) -> Tow:
    return Tow.model_validate({"rope": rope or {}, "body": body}, context={"bird": bird})


def test_what_a_scenario_leaves_out_is_what_the_file_says(bird: Bird) -> None:
    plain = chain_of(tow_of(bird), bird)
    assert plain.body.mass_kg == bird.facts.body.mass.value
    assert plain.rope.length_m == bird.facts.rope.length.value
    given = chain_of(
        tow_of(
            bird,
            rope={"length_m": 20.0, "diameter_m": 0.02, "mass_kgpm": 0.3, "links": 8},
            mass_kg=40.0,
            drag_area_m2=0.0,
            cross_area_m2=0.1,
            fin_area_m2=0.5,
            fin_station_m=-1.5,
            bridle_m=[0.1, 0.0, -0.3],
        ),
        bird,
    )
    assert (given.rope.length_m, given.rope.diameter_m, given.rope.mass_per_m, given.links) == (20.0, 0.02, 0.3, 8)
    assert (given.rope.normal_drag, given.rope.tangential_drag) == (plain.rope.normal_drag, plain.rope.tangential_drag)
    body = given.body
    assert (body.mass_kg, body.drag_area_m2, body.cross_area_m2) == (40.0, (0.0, 0.0, 0.0), 0.1)
    assert (body.fin_area_m2, body.fin_station_m, body.bridle_m) == (0.5, -1.5, (0.1, 0.0, -0.3))
    # a body of half the mass has half the moments of inertia
    assert body.inertia_kgm2 == pytest.approx([0.5 * value for value in plain.body.inertia_kgm2])


def test_places_count_from_the_center_of_gravity(bird: Bird) -> None:
    center = bird.facts.body.center_of_gravity.model_copy(update={"value": (0.2, 0.0, 0.05)})
    moved = bird.facts.body.model_copy(update={"center_of_gravity": center})
    other = Bird(bird.name, bird.facts.model_copy(update={"body": moved}), bird.magnetics)
    body = chain_of(tow_of(other), other).body
    assert body.bridle_m == pytest.approx((0.15 - 0.2, 0.0, -0.22 - 0.05))
    assert body.fin_station_m == pytest.approx(-1.1 - 0.2)


def test_hook_is_that_of_the_file_or_of_the_scenario() -> None:
    helicopter = load_aircraft("helicopter")
    assert hook_of(Tow(), helicopter) == (0.0, 0.0, 1.1)
    assert hook_of(Tow(hook_m=(-1.0, 0.0, 0.5)), helicopter) == (-1.0, 0.0, 0.5)


TOO_LIGHT = re.compile(
    r"^tow\.body\.mass_kg: [\d.]+ kg are too light for their drag and that of the rope: at [\d.]+ m/s the bird "
    r"(?:lifts off|trails \d+ deg behind the hook); allowed: up to 70 deg, that is "
    r"(?:at least (?P<mass>[\d.]+) kg, or )?(?:up to (?P<speed>[\d.]+) m/s, or )?a shorter or thinner rope$"
)


@pytest.mark.parametrize(
    ("rope", "body", "speed_mps"),
    [
        ({}, {"mass_kg": 5.0}, 60.0),
        ({}, {"mass_kg": 2.0, "drag_area_m2": 1.0}, 28.0),
        ({"length_m": 500.0, "diameter_m": 0.05}, {}, 28.0),
        # tied far ahead of the center of gravity: at rest in no pitch where it is slow
        ({}, {"mass_kg": 3.0, "bridle_m": [0.8, 0.0, 0.0]}, 60.0),
    ],
)
def test_mass_and_speed_of_the_message_are_allowed(bird: Bird, rope: dict, body: dict, speed_mps: float) -> None:
    with pytest.raises(RequestError) as caught:
        require_equilibrium(tow_of(bird, rope=rope, **body), bird, speed_mps, DENSITY)
    found = TOO_LIGHT.match(str(caught.value))
    assert found, str(caught.value)
    mass, speed = float(found["mass"]), float(found["speed"])

    def works(mass_kg: float, at_mps: float) -> bool:
        try:
            require_equilibrium(tow_of(bird, rope=rope, **(body | {"mass_kg": mass_kg})), bird, at_mps, DENSITY)
        except RequestError:
            return False
        return True

    now = body.get("mass_kg", 80.0)
    assert works(mass, speed_mps)
    assert not works(mass - 0.2, speed_mps)
    assert works(now, speed)
    assert not works(now, speed + 0.2)


@pytest.mark.parametrize(
    ("rope", "body"),
    [
        # a parachute on a thick rope
        ({"length_m": 500.0, "diameter_m": 0.1, "links": 2}, {"drag_area_m2": 10.0, "mass_kg": 3.0}),
        # tied below its center of gravity: where it is heavier or slower it turns over or swings up
        ({}, {"mass_kg": 3.0, "bridle_m": [0.0, 0.0, 0.3]}),
    ],
)
def test_where_neither_mass_nor_speed_helps_the_rope_is_left(bird: Bird, rope: dict, body: dict) -> None:
    with pytest.raises(RequestError, match=r"allowed: up to 70 deg, that is a shorter or thinner rope$"):
        require_equilibrium(tow_of(bird, rope=rope, **body), bird, 60.0, DENSITY)


def test_a_bird_without_a_pitch_at_rest_is_reported(bird: Bird) -> None:
    with pytest.raises(RequestError, match=r"^tow\.body: bird finds no pitch in which it hangs at rest at 60 m/s; "):
        require_equilibrium(tow_of(bird, fin_area_m2=0.0, bridle_m=[0.0, 0.0, 0.0]), bird, 60.0, DENSITY)


def test_an_equilibrium_hangs_up_to_the_largest_trail(bird: Bird) -> None:
    chain = chain_of(tow_of(bird, mass_kg=6.0), bird)
    trails = [(speed, find_equilibrium(chain, speed, DENSITY)) for speed in (20.0, 40.0, 60.0, 80.0)]
    assert [hangs(found) for _, found in trails] == [found.trail <= MOST_TRAIL for _, found in trails if found]
    assert math.degrees(MOST_TRAIL) == pytest.approx(70.0)
    assert not hangs(None)

"""Individuals of a type: what they share, and how far they differ."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.aircraft import Aircraft, load_aircraft, load_bird
from magsim.errors import RequestError
from magsim.population import individual_of
from tests.support.populations import individual_p_values, pairs

NUMBERS = range(1, 41)


@pytest.fixture(scope="module")
def cessna() -> Aircraft:
    return load_aircraft("c208b")


@pytest.fixture(scope="module")
def fleet(cessna: Aircraft) -> list[Aircraft]:
    return [individual_of(cessna, number) for number in NUMBERS]


def test_number_0_is_the_type_itself(cessna: Aircraft) -> None:
    assert individual_of(cessna, 0) is cessna


def test_an_individual_is_the_same_whatever_was_drawn_before(cessna: Aircraft, fleet: list[Aircraft]) -> None:
    again = individual_of(cessna, 7)
    assert again.magnetics == fleet[6].magnetics
    assert again.digest == fleet[6].digest
    assert len({one.digest for one in fleet}) == len(fleet)
    assert again.nominal is cessna


def test_a_part_more_changes_no_other(cessna: Aircraft, fleet: list[Aircraft]) -> None:
    """Each part draws from a stream of its name."""
    few = {"permanent": cessna.magnetics.permanent[3:], "feeders": cessna.magnetics.feeders[:2]}
    fewer = cessna.magnetics.model_copy(update=few | {"buses": ()})
    one = individual_of(replace(cessna, magnetics=fewer), 7).magnetics
    whole = fleet[6].magnetics
    assert one.permanent == whole.permanent[3:]
    assert one.feeders == whole.feeders[:2]
    assert (one.mounts, one.steel, one.skin, one.hinged) == (whole.mounts, whole.steel, whole.skin, whole.hinged)


def test_types_and_birds_draw_apart(cessna: Aircraft) -> None:
    """Two types with one part of the same name do not get the same part."""
    other = replace(cessna, name="other")
    first, second = individual_of(cessna, 1).magnetics, individual_of(other, 1).magnetics
    assert first.permanent[0].moment_am2 != second.permanent[0].moment_am2
    bird = individual_of(load_bird("bird"), 1)
    assert bird.magnetics.permanent[0].moment_am2 != bird.nominal.magnetics.permanent[0].moment_am2


def test_geometry_of_the_metal_is_that_of_the_type(cessna: Aircraft, fleet: list[Aircraft]) -> None:
    shape = {"mu_r", "thickness_m"}
    for one in fleet[:5]:
        for part, nominal in zip(one.magnetics.steel, cessna.magnetics.steel, strict=True):
            assert part.model_dump(exclude=shape) == nominal.model_dump(exclude=shape)
        for shell, nominal in zip(one.magnetics.skin.parts, cessna.magnetics.skin.parts, strict=True):
            assert shell.sections == nominal.sections


def test_all_that_scatters_does_so_as_stated(cessna: Aircraft, fleet: list[Aircraft]) -> None:
    found = individual_p_values(cessna, fleet)
    assert len(found) == 13
    assert {name: p for name, p in found.items() if not p > 0.01} == {}


def test_a_seat_moves_by_whole_notches_of_its_rail(cessna: Aircraft, fleet: list[Aircraft]) -> None:
    for own, nominal in pairs(cessna, fleet, "permanent"):
        off = np.subtract(own.position_m, nominal.position_m)
        steps = 0.0 if nominal.notch_m is None else off[0] / nominal.notch_m[0]
        assert steps == pytest.approx(round(steps), abs=1e-9)
        np.testing.assert_allclose(off, steps * np.array(nominal.notch_m or (0.0, 0.0, 0.0)), atol=1e-12)


def test_wires_keep_what_they_enclose(cessna: Aircraft, fleet: list[Aircraft]) -> None:
    """A loop moves as a whole, so that its field scatters with the share alone; two wires stay as far apart."""
    for feeder, nominal in pairs(cessna, fleet, "feeders"):
        for path, drawn in zip(feeder.paths, nominal.paths, strict=True):
            off = np.array(path.vertices_m) - np.array(drawn.vertices_m)
            if path.kind == "loop":
                np.testing.assert_allclose(off, np.tile(off[:1], (len(off), 1)), atol=1e-12)
            else:
                assert path.share == drawn.share
            if path.kind == "pair":
                assert np.linalg.norm(path.offset_m) == pytest.approx(np.linalg.norm(drawn.offset_m), rel=1e-9)


def test_loops_that_stand_for_the_skin() -> None:
    """Their time constants scatter with the sheet, and joints make them shorter."""
    drone = load_aircraft("uav")
    fleet = [individual_of(drone, number) for number in NUMBERS]
    factors = [
        (c.time_constant_s or c.section_m2) / (n.time_constant_s or n.section_m2)
        for one in fleet
        for c, n in zip(one.magnetics.coils, drone.magnetics.coils, strict=True)
    ]
    assert np.median(factors) == pytest.approx(1.0 / 1.1, abs=0.03)
    assert max(factors) < 1.15


def test_a_type_whose_scatter_breaks_its_own_rules_is_refused(cessna: Aircraft) -> None:
    """A mount a hair from what keeps it off, on a rail whose notches carry that to it."""
    seat = next(dipole for dipole in cessna.magnetics.permanent if dipole.notch_m)
    near = seat.model_copy(update={"notch_m": (0.0, 0.0, 0.0), "name": "near"})
    mount = cessna.magnetics.mounts["cabin_center"]
    spots = [
        near.model_copy(update={"name": f"near_{k}", "position_m": tuple(0.2001 * s for s in side)})
        for k, side in enumerate([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)])
    ]
    assert mount.position_m == (0.0, 0.0, 0.0)
    crowded = cessna.magnetics.model_copy(update={"permanent": tuple(spots)})
    with pytest.raises(RequestError, match=r"no individual 1 of c208b can be built: .*cabin_center"):
        individual_of(replace(cessna, magnetics=crowded), 1)

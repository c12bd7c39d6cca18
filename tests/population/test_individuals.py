"""Individuals of a type: what they share, and how far they differ."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chisquare, kstest, norm

from magsim.aircraft import Aircraft, load_aircraft, load_bird
from magsim.errors import RequestError
from magsim.population import INDIVIDUAL, individual_of
from tests.support.populations import angle_deg, fittings, machines, sizes_over

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
    fewer = cessna.magnetics.model_copy(
        update={"permanent": cessna.magnetics.permanent[3:], "feeders": cessna.magnetics.feeders[:2], "buses": ()}
    )
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


def test_fittings(cessna: Aircraft, fleet: list[Aircraft]) -> None:
    """Lognormal in size, in any direction: cosine and azimuth are even."""
    ratios, moments = sizes_over(cessna, fleet, fittings)
    assert kstest(np.log(ratios), norm(0.0, INDIVIDUAL["fitting"].size[0]).cdf).pvalue > 0.01
    unit = moments / np.linalg.norm(moments, axis=1, keepdims=True)
    assert kstest(0.5 * (unit[:, 2] + 1.0), "uniform").pvalue > 0.01
    assert kstest(np.arctan2(unit[:, 1], unit[:, 0]) / (2.0 * np.pi) + 0.5, "uniform").pvalue > 0.01


def test_machines(cessna: Aircraft, fleet: list[Aircraft]) -> None:
    size, turn_deg = INDIVIDUAL["machine"].size
    ratios, moments = sizes_over(cessna, fleet, machines)
    assert kstest((ratios - 1.0) / size, "norm").pvalue > 0.01
    nominal = np.array([dipole.moment_am2 for dipole in machines(cessna.magnetics)])
    turns = angle_deg(moments, np.tile(nominal, (len(fleet), 1)))
    assert kstest(turns / turn_deg, lambda x: 2.0 * norm.cdf(x) - 1.0).pvalue > 0.01


def test_steel_and_sheets(cessna: Aircraft, fleet: list[Aircraft]) -> None:
    pairs = [(p, q) for one in fleet for p, q in zip(one.magnetics.steel, cessna.magnetics.steel, strict=True)]
    heats = np.log([(p.mu_r - 1.0) / (q.mu_r - 1.0) for p, q in pairs]) / INDIVIDUAL["susceptibility"].size[0]
    assert kstest(heats, "norm").pvalue > 0.01
    pairs += [
        (p, q) for one in fleet for p, q in zip(one.magnetics.skin.parts, cessna.magnetics.skin.parts, strict=True)
    ]
    sheets = np.array([p.thickness_m / q.thickness_m for p, q in pairs if hasattr(p, "thickness_m")])
    assert kstest((sheets - 1.0) / INDIVIDUAL["thickness"].size[0], "norm").pvalue > 0.01
    median, sigma = INDIVIDUAL["seam"].size
    seams = np.concatenate([part.seams_ohm_m for one in fleet for part in one.magnetics.skin.parts])
    assert kstest(np.log(seams / median) / sigma, "norm").pvalue > 0.01


def test_places(cessna: Aircraft, fleet: list[Aircraft]) -> None:
    moved = np.array([np.array(one.mounts[name]) - place for one in fleet for name, place in cessna.mounts.items()])
    reach = INDIVIDUAL["mount"].size[0]
    assert kstest(moved.ravel() / (2.0 * reach) + 0.5, "uniform").pvalue > 0.01
    seat = next(dipole for dipole in cessna.magnetics.permanent if dipole.notch_m)
    places = np.array([d.position_m for one in fleet for d in one.magnetics.permanent if d.name == seat.name])
    steps = (places - seat.position_m)[:, 0] / seat.notch_m[0]
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)
    np.testing.assert_allclose(places[:, 1:], np.tile(seat.position_m[1:], (len(fleet), 1)))
    assert chisquare(np.bincount(np.round(steps).astype(int) + 3, minlength=7)).pvalue > 0.01


def test_wires(cessna: Aircraft, fleet: list[Aircraft]) -> None:
    reach, spread = INDIVIDUAL["wire"].size[0], INDIVIDUAL["chassis"].size[0]
    moved, shares, offsets, pitches = [], [], [], []
    for one in fleet:
        for feeder, nominal in zip(one.magnetics.feeders, cessna.magnetics.feeders, strict=True):
            for path, drawn in zip(feeder.paths, nominal.paths, strict=True):
                off = np.array(path.vertices_m) - np.array(drawn.vertices_m)
                assert np.abs(off).max() <= reach + 1e-12
                if path.kind == "loop":
                    # moved as a whole, so that what it encloses scatters with the share alone
                    np.testing.assert_allclose(off, np.tile(off[:1], (len(off), 1)), atol=1e-12)
                    moved.append(off[:1])
                    shares.append(path.share / drawn.share - 1.0)
                else:
                    moved.append(off)
                    assert path.share == drawn.share
                if path.kind == "pair":
                    offsets.append(np.linalg.norm(path.offset_m) / np.linalg.norm(drawn.offset_m))
                if path.kind == "twisted":
                    pitches.append(np.log(path.pitch_m / drawn.pitch_m))
    assert kstest(np.concatenate(moved).ravel() / (2.0 * reach) + 0.5, "uniform").pvalue > 0.01
    assert kstest(np.array(shares) / (2.0 * spread) + 0.5, "uniform").pvalue > 0.01
    np.testing.assert_allclose(offsets, 1.0, rtol=1e-9)
    assert kstest(np.array(pitches) / INDIVIDUAL["pitch"].size[0], "norm").pvalue > 0.01


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

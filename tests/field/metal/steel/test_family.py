"""The steel of an individual from that of its type, beside the whole solution."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from magsim.aircraft import Vehicle, load_aircraft, load_bird
from magsim.field import compute_response, load_response
from magsim.field.metal.steel import compute_steel, family, load_steel
from magsim.population import individual_of
from magsim.storage import cache

FAR = np.array([[0.6, 0.9, -0.7]])


@pytest.fixture(autouse=True)
def empty(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("MAGSIM_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def _off(first: np.ndarray, second: np.ndarray) -> float:
    """Largest relative difference over the places."""
    off, size = ((array.reshape(len(array), -1) ** 2).sum(axis=1) for array in (first - second, second))
    return float(np.sqrt(off / size).max())


@pytest.mark.parametrize("vehicle", [load_bird("bird"), load_aircraft("uav")], ids=lambda vehicle: vehicle.name)
def test_an_individual_is_as_by_the_whole_solution(vehicle: Vehicle) -> None:
    nominal = compute_response(vehicle)
    for number in (1, 2, 3):
        one = individual_of(vehicle, number)
        fast, whole = load_response(one), compute_response(one)
        assert _off(fast.induced, whole.induced) < 1e-6
        slopes = [steel(one).at(fast.positions_m).induced_gradient for steel in (load_steel, compute_steel)]
        assert _off(*slopes) < 1e-6
        assert _off(fast.induced, nominal.induced) > 1e-2
        for name in ("positions_m", "permanent_nt", "tau_s", "drive", "field", "wiring_nt_per_a"):
            np.testing.assert_array_equal(getattr(fast, name), getattr(whole, name))


def test_the_family_is_made_once_and_from_the_shapes(empty: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    vehicle = load_aircraft("uav")
    for number in (1, 2):
        load_response(individual_of(vehicle, number))
    assert len(list((empty / "steel_family").glob("*.npz"))) == 1
    monkeypatch.setattr(family, "_whole_solution", None)  # nothing is solved as a whole any more
    load_response(individual_of(vehicle, 3))
    assert cache.cache_folder() == empty


def test_corners_of_the_span_are_within_the_tolerance() -> None:
    """All parts at the ends of what a family may be asked for: the field is far within the tolerance of the charge."""
    vehicle = load_aircraft("uav")
    for factors in ((2.9, 2.9), (1 / 2.9, 1 / 2.9), (2.9, 1 / 2.9), (1 / 2.9, 2.9)):
        steel = tuple(
            part.model_copy(update={"mu_r": 1.0 + (part.mu_r - 1.0) * factors[number % 2]})
            for number, part in enumerate(vehicle.magnetics.steel)
        )
        changed = replace(vehicle, magnetics=vehicle.magnetics.model_copy(update={"steel": steel}))
        fast, whole = load_steel(replace(changed, nominal=vehicle)).at(FAR), load_steel(changed).at(FAR)
        assert _off(fast.induced, whole.induced) < 1e-6


def test_what_is_no_member_is_solved_as_a_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    """Another shape, a permeability beyond the span, or a moment that magnetizes the steel beside it."""
    vehicle = load_aircraft("uav")
    magnetics = vehicle.magnetics
    core, *others = magnetics.steel
    changes = [
        {"steel": (core.model_copy(update={"radius_m": 1.01 * core.radius_m}), *others)},
        {"steel": (core.model_copy(update={"mu_r": 1.0 + 4.0 * (core.mu_r - 1.0)}), *others)},
        {
            "permanent": (
                magnetics.permanent[0].model_copy(update={"position_m": (0.0, 0.6, 0.0), "installed": False}),
                *magnetics.permanent[1:],
            )
        },
    ]
    monkeypatch.setattr("magsim.field.metal.steel.model.load_family", None)
    for change in changes:
        changed = replace(vehicle, magnetics=magnetics.model_copy(update=change))
        member = load_steel(replace(changed, nominal=vehicle))
        np.testing.assert_array_equal(member.charge, load_steel(changed).charge)


def test_a_space_that_is_too_small_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(family, "MOST", family.BATCH)
    monkeypatch.setattr(family, "TOLERANCE", 1e-12)
    bird = load_bird("bird")
    with pytest.raises(ValueError, match="cannot be told from 4 solutions"):
        load_steel(individual_of(bird, 1))


def test_an_individual_of_which_no_place_is_asked_for_has_an_empty_response() -> None:
    """A carrier all of whose instruments hang below it."""
    vehicle = individual_of(load_aircraft("uav"), 3)
    assert load_response(vehicle, mounts=()).induced.shape == (0, 3, 3)

"""What hangs on rubber mounts, against the field of everything where it has gone."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.aircraft import Aircraft
from magsim.field import compute_response
from magsim.field.hanging import hanging_strengths
from magsim.field.metal.steel.model import compute_steel
from magsim.field.sources.dipoles import dipole_field
from tests.support.toy_tow import toy_aircraft

WAY = np.array([[0.4e-3, -0.9e-3, 1.1e-3], [0.0, 0.0, 0.0]])
AMBIENT = np.array([[18000.0, -4000.0, 50000.0], [18000.0, -4000.0, 50000.0]])
MOMENT = np.array([[40.0, 10.0, -20.0], [40.0, 10.0, -20.0]])
NONE = np.zeros((2, 3))


@pytest.fixture(scope="module")
def toy() -> Aircraft:
    """A moment, a rotor and the only steel on one suspension."""
    return toy_aircraft()


def moved(toy: Aircraft, way: np.ndarray, *, installed: bool = True) -> Aircraft:
    """The same with everything on the suspension a way off."""
    magnetics = toy.magnetics
    there = {
        "permanent": tuple(
            d.model_copy(update={"position_m": tuple(d.position_m + way), "installed": installed})
            for d in magnetics.permanent
        ),
        "steel": tuple(s.model_copy(update={"center_m": tuple(s.center_m + way)}) for s in magnetics.steel),
    }
    return replace(toy, magnetics=magnetics.model_copy(update=there))


def change(toy: Aircraft, way: np.ndarray, ambient: np.ndarray, moment: np.ndarray) -> np.ndarray:
    """The sum of gains and strengths at the tail, (n, 3)."""
    strengths = hanging_strengths(toy.magnetics, {"rubber": way}, ambient, {"rubber": [moment]})
    return strengths @ compute_response(toy).hanging[0].T


@pytest.mark.parametrize("installed", [True, False])
def test_the_moment_goes_with_what_it_induces_there(toy, installed):
    one = moved(toy, np.zeros(3), installed=installed)
    there, back = (compute_response(moved(toy, sign * WAY[0], installed=installed)) for sign in (1.0, -1.0))
    exact = 0.5 * (there.permanent_nt - back.permanent_nt)[0]
    np.testing.assert_allclose(change(one, WAY, NONE, NONE)[0], exact, rtol=0, atol=1e-5 * np.abs(exact).max())


def test_the_steel_goes(toy):
    """It is the only one, so that its field goes with it as it is."""
    seen = toy.mounts["tail"] - np.stack([WAY[0], -WAY[0]])
    there, back = compute_steel(toy).at(seen, gradient=False).induced
    exact = 0.5 * (there - back) @ AMBIENT[0]
    got = change(toy, WAY, AMBIENT, NONE) - change(toy, WAY, NONE, NONE)
    np.testing.assert_allclose(got[0], exact, rtol=0, atol=1e-5 * np.abs(exact).max())


def test_the_propeller_goes(toy):
    place, tail = np.array(toy.magnetics.rotating[0].position_m), np.array(toy.mounts["tail"])
    there, back = (dipole_field(place + sign * WAY[0], MOMENT[0], tail) for sign in (1.0, -1.0))
    exact = 0.5 * (there - back)
    got = change(toy, WAY, NONE, MOMENT) - change(toy, WAY, NONE, NONE)
    np.testing.assert_allclose(got[0], exact, rtol=0, atol=1e-5 * np.abs(exact).max())


def test_nothing_that_rests_changes_the_field(toy):
    np.testing.assert_array_equal(change(toy, WAY, AMBIENT, MOMENT)[1], np.zeros(3))


def test_steel_elsewhere_stays(toy):
    """Of two blocks the one that hangs goes, with the charge that it has beside the other."""
    free = toy.magnetics.steel[0].model_copy(update={"name": "fixed", "center_m": (1.2, 0.0, -0.6), "suspension": None})
    steel = (*toy.magnetics.steel, free)
    two = replace(toy, magnetics=toy.magnetics.model_copy(update={"steel": steel}))

    def shifted(way: np.ndarray) -> Aircraft:
        block = steel[0].model_copy(update={"center_m": tuple(steel[0].center_m + way)})
        return replace(two, magnetics=two.magnetics.model_copy(update={"steel": (block, free)}))

    there, back = (compute_response(shifted(sign * WAY[0])) for sign in (1.0, -1.0))
    exact = 0.5 * (there.induced - back.induced)[0] @ AMBIENT[0]
    got = change(two, WAY, AMBIENT, NONE) - change(two, WAY, NONE, NONE)
    # What the two do to each other is left out: a percent where they are two of their lengths apart.
    np.testing.assert_allclose(got[0], exact, rtol=0, atol=2e-2 * np.abs(exact).max())

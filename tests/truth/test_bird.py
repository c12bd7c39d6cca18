"""The finned bird: its loads by vectors, its equilibrium, its own modes by the eigenvalues of the dense system."""

import numpy as np
import pytest

from magsim.aircraft import load_bird
from magsim.flight.tow import dynamics
from magsim.flight.tow.chain import Chain
from magsim.flight.tow.equilibrium import find_equilibrium
from magsim.flight.tow.modes import modes
from magsim.flight.tow.setup import chain_of
from magsim.scenario import Tow
from magsim.streams import stream
from tests.benchmarks.tow_rows.modes import mode
from tests.benchmarks.tow_rows.steady import TABLE, balance
from tests.support.ropes import AIR, BIRD, air_of, bird_chain, body_loads, dense, parts_of
from tests.support.tows import at_rest, nudged, strongest_mode


def test_loads_are_those_of_the_vectors() -> None:
    rng, chain = stream(7, "bird/loads"), bird_chain()
    for _ in range(20):
        flow, rate = 30.0 * rng.normal(size=3), rng.normal(size=3)
        force, moment = body_loads(BIRD, flow, rate, AIR)
        found = dynamics.body_loads(chain.constants, *flow, *rate, AIR)
        np.testing.assert_allclose(found, [*force, *moment], rtol=1e-12, atol=1e-9)


def test_fins_turn_the_bird_into_the_flow_and_munk_out_of_it() -> None:
    """Air from below the nose: the tail is lifted by the fin, the nose by the body."""
    _, _, _, _, whole, _ = dynamics.body_loads(bird_chain().constants, -30.0, 0.0, -3.0, 0.0, 0.0, 0.0, AIR)
    bare = bird_chain().constants._replace(fin_lift=0.0)
    _, _, _, _, body, _ = dynamics.body_loads(bare, -30.0, 0.0, -3.0, 0.0, 0.0, 0.0, AIR)
    assert whole < 0.0 < body


@pytest.mark.parametrize("speed_mps", [10.0, 25.0, 40.0, 70.0])
def test_forces_and_moments_cancel_in_the_equilibrium(speed_mps: float) -> None:
    force, moment, slope = balance(speed_mps)
    assert force < 1e-9
    assert moment < 1e-9
    assert slope < 1e-9


@pytest.mark.parametrize("row", TABLE)
def test_equilibrium_is_that_of_the_prototype(row: tuple[float, ...]) -> None:
    speed, pitch, trail, top, low = row
    found = find_equilibrium(bird_chain(), speed, AIR)
    assert found is not None
    assert np.degrees([found.pitch, found.trail]) == pytest.approx([pitch, trail], abs=0.005)
    assert found.tension_n[[0, -1]] == pytest.approx([top, low], abs=0.1)


def test_shipped_bird_is_that_of_the_reference() -> None:
    chain = chain_of(Tow(), load_bird("bird"))
    assert chain.body == BIRD
    assert chain.rope == bird_chain().rope


def modes_of(chain: Chain, speed_mps: float) -> np.ndarray:
    """Eigenvalues [1/s] of all oscillations about the equilibrium, of the dense system linearized by differences."""
    state, air, body = at_rest(chain, speed_mps), air_of(speed_mps), 6 * (chain.links - 1)

    def slope(small: np.ndarray) -> np.ndarray:
        # motions: places and a small turn of the body; their rates
        inner = body // 2
        place, rate = small[: inner + 6], small[inner + 6 :]
        now = state.copy()
        now[:inner] += place[:inner]
        now[body : body + 3] += place[inner : inner + 3]
        half = np.array([1.0, *(0.5 * place[inner + 3 :])])
        w, v = state[body + 9], state[body + 10 :]
        now[body + 9 :] = [w * half[0] - v @ half[1:], *(w * half[1:] + half[0] * v + np.cross(v, half[1:]))]
        now[body + 9 :] /= np.linalg.norm(now[body + 9 :])
        now[inner:body] += rate[:inner]
        now[body + 3 : body + 9] += rate[inner:]
        assert np.isfinite(parts_of(chain, now).rot).all()
        return np.concatenate([rate, dense(chain, now, air, dynamics.GAMMA)[0]])

    size = 2 * (body // 2 + 6)
    step = 1e-5 * np.eye(size)
    matrix = np.column_stack([(slope(way) - slope(-way)) / 2e-5 for way in step])
    values = np.linalg.eigvals(matrix)
    return values[values.imag > 0.1]


@pytest.mark.parametrize("speed_mps", [10.0, 28.0])
def test_modes_are_the_eigenvalues_of_the_dense_system(speed_mps: float) -> None:
    chain = bird_chain(5)
    found, exact = find_equilibrium(chain, speed_mps, AIR), modes_of(chain, speed_mps)
    assert found is not None
    slow = [one for one in modes(chain, found, speed_mps, AIR) if one.frequency_hz > 0.02]
    assert len(slow) == len(exact)
    for one in slow:
        away = np.abs(exact - complex(one.growth_ps, 2.0 * np.pi * one.frequency_hz))
        assert away.min() < 1e-4
    # pitch and yaw after a nudge, through time, are two of them
    for axis in (1, 2):
        frequency, damping = strongest_mode(nudged(chain, speed_mps, axis), 1.0 / 8.0, above_hz=0.2)
        value = 2.0 * np.pi * frequency * complex(-damping / np.sqrt(1.0 - damping**2), 1.0)
        assert np.abs(exact - value).min() < 0.01 * abs(value)


@pytest.mark.parametrize(("axis", "periods_s"), [(1, (2.2, 1.7)), (2, (3.0, 2.1))])
def test_modes_lie_in_the_band_of_the_paper(axis: int, periods_s: tuple[float, float]) -> None:
    """Paper 002: 0.3 to 0.8 Hz where it is flown, 25 to 30 m/s; periods of the prototype as it rounds them."""
    for speed in (25.0, 30.0):
        assert 0.3 < mode(speed, axis)[0] < 0.8
    for speed, period in zip((25.0, 40.0), periods_s, strict=True):
        assert 1.0 / mode(speed, axis)[0] == pytest.approx(period, rel=0.1)

"""A flight of a rope: the same bits in any company and any chunk, its log, slack ropes and lost numbers."""

from dataclasses import astuple, replace

import numpy as np
import pytest

from magsim.flight.tow import integration as module
from magsim.flight.tow.chain import Chain
from magsim.flight.tow.equilibrium import Equilibrium, find_equilibrium, hanging_state
from magsim.flight.tow.hook import EARTH_SPIN_E, Hook, gusts_n
from magsim.flight.tow.integration import integrate
from magsim.flight.tow.motion import BirdMotion
from magsim.scenario import Gusts
from magsim.units import G0
from tests.support.carriers import along_parallel
from tests.support.ropes import AIR, ROPE, all_nodes, bird_chain, parts_of, point_chain
from tests.support.tows import at_rest, body_of, level, moved, states


def hook_of(seed: int) -> Hook:
    """A carrier to the east with gusts at its bird."""
    path = along_parallel(30.0, 25.0, 50.0)
    gusts = gusts_n(Gusts(speed_mps=1.0), path.time_s, path.time_s[0], 25.0, seed)
    return Hook(path, np.array([0.0, 0.0, 1.1]), 0.2 * gusts, gusts)


def started(chain: Chain, hook: Hook) -> np.ndarray:
    found = find_equilibrium(chain, 25.0, AIR)
    assert found is not None
    return hanging_state(chain, found, hook.air(np.zeros(1))[0])


def same(one: BirdMotion, other: BirdMotion) -> bool:
    return all(np.array_equal(a, b) for a, b in zip(astuple(one), astuple(other), strict=True))


def test_a_flight_has_the_same_bits_alone_in_a_batch_and_in_any_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    bodies = [bird_chain(), point_chain(20.0), bird_chain(4)]
    chains = [replace(chain, spin=EARTH_SPIN_E) for chain in bodies]
    hooks = [hook_of(seed) for seed in (1, 2, 3)]
    given = [started(chain, hook) for chain, hook in zip(chains, hooks, strict=True)]
    spans, rates = [50.0, 31.7, 44.0], {"start_s": 0.0, "step_hz": 120, "log_hz": 30}
    together = integrate(chains, given, [hook.air for hook in hooks], duration_s=spans, **rates)
    for k, flown in enumerate(together):
        (alone,) = integrate([chains[k]], [given[k]], [hooks[k].air], duration_s=[spans[k]], **rates)
        assert same(flown, alone)
        assert len(flown.time_s) == int(spans[k] * 30) + 1
        assert flown.lost_s is None
        assert flown.slack_s is None
    # what is thrown away behind changes nothing before; other chunks neither
    for chunk_s in (0.1, 7.3, 100.0):
        monkeypatch.setattr(module, "CHUNK_S", chunk_s)
        (cut,) = integrate([chains[0]], [given[0]], [hooks[0].air], duration_s=[50.0], **rates)
        assert same(cut, together[0])
    (short,) = integrate([chains[0]], [given[0]], [hooks[0].air], duration_s=[20.0], **rates)
    np.testing.assert_array_equal(short.place_m, together[0].place_m[:601])


def test_rows_of_the_log_are_the_states_at_their_times() -> None:
    chain, drive = bird_chain(), moved(25.0, 1.5, 11.0)
    (flown,) = integrate(
        [chain], [at_rest(chain, 25.0)], [drive], start_s=0.0, duration_s=[10.0], step_hz=120, log_hz=30
    )
    time, rows, tension = states(chain, at_rest(chain, 25.0), drive, seconds=10.0, step_hz=120, log_hz=30)
    np.testing.assert_array_equal(flown.time_s, time)
    place, _ = body_of(chain, rows)
    np.testing.assert_array_equal(flown.place_m, place)
    bridles = np.array([all_nodes(chain, parts_of(chain, row))[0][-1] for row in rows])
    np.testing.assert_allclose(flown.bridle_m, bridles, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(flown.quaternion, axis=1), 1.0, atol=1e-14)
    # the first link of a rope that hangs pulls most, the last least; the extremes are those of all steps
    assert (flown.tension_n[:, 0] > flown.tension_n[:, 1]).all()
    assert flown.most_n == pytest.approx(max(tension[:, 1].max(), flown.tension_n[:, 0].max()), rel=1e-3)
    assert flown.least_n <= flown.tension_n[:, 1].min()


def test_a_hook_that_falls_makes_the_rope_slack_when_it_does() -> None:
    """Down with 1.2 g from t = 3 s on."""
    chain, calm = bird_chain(), level(20.0)

    def drive(time_s: np.ndarray) -> np.ndarray:
        out, falling = calm(time_s), np.maximum(time_s - 3.0, 0.0)
        out[:, 2] -= np.where(falling > 0.0, 1.2 * G0, 0.0)
        out[:, 5] -= 1.2 * G0 * falling
        out[:, 8] -= 1.2 * G0 * falling
        return out

    (flown,) = integrate(
        [chain], [at_rest(chain, 20.0)], [drive], start_s=-5.0, duration_s=[8.5], step_hz=120, log_hz=30
    )
    assert flown.slack_s == pytest.approx(3.0, abs=0.02)
    assert flown.least_n < 0.0
    (saved,) = integrate(
        [chain], [at_rest(chain, 20.0)], [drive], start_s=-5.0, duration_s=[8.0], step_hz=120, log_hz=30
    )
    assert saved.slack_s is None
    assert saved.least_n > 600.0


def test_a_diverged_motion_is_reported_and_its_rest_is_nan() -> None:
    """Four fifths of the limit hold, 1.3 of it do not: 20 links of 1.5 m at 30 and at 60 steps a second."""
    chain = Chain(ROPE, bird_chain().body, 20)
    settings = {"start_s": 0.0, "duration_s": [60.0], "log_hz": 30}
    (lost,) = integrate([chain], [at_rest(chain, 25.0)], [moved(25.0, 0.5, 7.0)], step_hz=30, **settings)
    assert lost.lost_s is not None
    assert 0.0 < lost.lost_s < 60.0
    after = lost.time_s > lost.lost_s
    assert np.isfinite(lost.place_m[~after]).all()
    assert np.isnan(lost.place_m[after]).all()
    assert np.isnan(lost.tension_n[after]).all()
    (kept,) = integrate([chain], [at_rest(chain, 25.0)], [moved(25.0, 0.5, 7.0)], step_hz=60, **settings)
    assert kept.lost_s is None
    assert np.isfinite(kept.place_m).all()
    assert kept.most_n < chain.stable_tension_n(60)


def test_progress_is_reported_for_each_flight() -> None:
    chain, shares = point_chain(links=3), []
    integrate(
        [chain] * 4,
        [at_rest(chain, 25.0)] * 4,
        [level(25.0)] * 4,
        start_s=0.0,
        duration_s=[0.2] * 4,
        step_hz=60,
        log_hz=30,
        progress=shares.append,
    )
    assert shares == [0.25, 0.5, 0.75, 1.0]


@pytest.mark.parametrize("heading", [0.0, 2.0, -1.3])
def test_a_hanging_line_trails_along_the_wind_below_its_hook(heading: float) -> None:
    """In any direction of tow, with gravity that leans: aft along the flow, nose up by the pitch."""
    chain = bird_chain()
    found = find_equilibrium(chain, 30.0, AIR)
    assert isinstance(found, Equilibrium)
    air = level(30.0)(np.zeros(1))[0]
    cos, sin = np.cos(heading), np.sin(heading)
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    for k in (0, 3, 6):
        air[k : k + 3] = turn @ air[k : k + 3]
    state = hanging_state(chain, found, air)
    parts = parts_of(chain, state)
    np.testing.assert_allclose(parts.place, turn @ [found.hang_m[0], 0.0, found.hang_m[1]], atol=1e-12)
    forward = [np.cos(found.pitch), 0.0, -np.sin(found.pitch)]
    np.testing.assert_allclose(parts.rot[:, 0], turn @ forward, atol=1e-12)
    links = np.diff(all_nodes(chain, parts)[0], axis=0)
    np.testing.assert_allclose(np.linalg.norm(links, axis=1), 3.0, atol=1e-12)


def test_a_rope_of_one_link_is_refused() -> None:
    with pytest.raises(ValueError, match="a rope of 1 links; at least 2 are needed"):
        Chain(ROPE, bird_chain().body, 1)

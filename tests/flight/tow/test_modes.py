"""Modes of a chain: against formulas, and against the same chain integrated in time."""

import math
from dataclasses import replace

import numpy as np
import pytest

from magsim.flight.tow.chain import Chain, ball
from magsim.flight.tow.equilibrium import find_equilibrium, hanging_state
from magsim.flight.tow.integration import integrate
from magsim.flight.tow.modes import level_tow, modes
from magsim.units import G0
from tests.support.ropes import BIRD, ROPE


def slow(chain: Chain, speed: float, density: float = 1.19) -> list:
    found = find_equilibrium(chain, speed, density)
    return sorted(mode for mode in modes(chain, found, speed, density) if 0.0 < mode.frequency_hz < 3.0)


def test_a_pendulum_in_still_air():
    # a rigid rod and a bob: compound pendulum; both swings alike, without damping
    chain = Chain(replace(ROPE, normal_drag=0.0, tangential_drag=0.0), ball(80.0, 0.0))
    rod, length = 0.12 * 30.0, 30.0
    period = (
        2.0
        * math.pi
        * math.sqrt((80.0 * length**2 + rod * length**2 / 3.0) / ((80.0 * length + rod * length / 2.0) * G0))
    )
    found = slow(chain, 25.0)[:2]
    for mode in found:
        assert 1.0 / mode.frequency_hz == pytest.approx(period, rel=1e-3)
        assert mode.growth_ps == pytest.approx(0.0, abs=1e-7)


def test_the_bird_has_a_swing_a_weathercock_and_a_pitch_in_the_band_of_compensation():
    frequencies = [mode.frequency_hz for mode in slow(Chain(ROPE, BIRD), 28.0)]
    assert frequencies[:2] == pytest.approx([0.092, 0.094], abs=0.003)
    assert all(0.28 < frequency < 0.6 for frequency in frequencies[2:4])
    assert all(mode.growth_ps < 0.0 for mode in slow(Chain(ROPE, BIRD), 28.0))


def lateral(chain: Chain, speed: float, push: float, duration_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Sideways place of a bird that was pushed sideways [m] in level tow, over time."""
    air = level_tow(speed, 1.19)
    state = hanging_state(chain, find_equilibrium(chain, speed, 1.19), air)
    # the whole chain turns about the hook by a small angle
    angle = push / chain.rope.length_m
    body = 6 * (chain.links - 1)
    for place in [*range(0, body // 2, 3), body]:
        state[place + 1] = -angle * state[place + 2]
    drive = lambda time: np.tile(air, (len(time), 1))  # noqa: E731
    (flown,) = integrate([chain], [state], [drive], start_s=0.0, duration_s=[duration_s], step_hz=240, log_hz=30)
    return flown.time_s, flown.place_m[:, 1]


@pytest.mark.parametrize(("length", "growing"), [(30.0, False), (3.0, True)])
def test_a_swing_grows_or_decays_in_time_as_its_mode(length, growing):
    chain = Chain(replace(ROPE, length_m=length), BIRD, 5)
    swings = [
        mode for mode in slow(chain, 28.0) if abs(mode.frequency_hz - math.sqrt(G0 / length) / (2.0 * math.pi)) < 0.03
    ]
    mode = max(swings, key=lambda mode: mode.growth_ps)
    assert (mode.growth_ps > 0.0) == growing
    time, place = lateral(chain, 28.0, 0.01 if growing else 0.3, 60.0 if not growing else 30.0)
    # other modes have died away: peaks of one sign tell period and growth
    later = time > (10.0 if growing else 20.0)
    time, place = time[later], place[later]
    peaks = np.flatnonzero((place[1:-1] > place[:-2]) & (place[1:-1] >= place[2:])) + 1
    period = np.diff(time[peaks]).mean()
    growth = np.polyfit(time[peaks], np.log(place[peaks]), 1)[0]
    assert 1.0 / period == pytest.approx(mode.frequency_hz, rel=0.01)
    assert growth == pytest.approx(mode.growth_ps, abs=0.004 if not growing else 0.01)

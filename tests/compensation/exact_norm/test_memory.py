"""The memory of steel against closed forms, and how well its shape is found."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.compensation.background import FluxgateField
from magsim.compensation.exact_norm.estimation import BENT, Estimation, FlightRows, exact_interference
from magsim.compensation.exact_norm.memory import RELAXATIONS_S, WIDTHS_NT, relaxed, remembered
from magsim.compensation.exact_norm.sources import Shape, SourceInputs, Sources
from magsim.compensation.reduction import Reduction
from tests.compensation.exact_norm.test_estimation import TIME_S, TRUTH, turning


def test_a_play_operator_rests_until_it_is_pushed():
    wave = np.repeat((np.concatenate([np.linspace(0, 10, 11), np.linspace(9, -10, 20)]))[:, None], 3, axis=1)
    state = remembered(wave, widths_nt=(3.0,))[0][:, 0]
    np.testing.assert_allclose(state[:4], 0.0)  # starts in the middle, 3 from each side
    np.testing.assert_allclose(state[4:11], np.arange(4, 11) - 3.0)
    np.testing.assert_allclose(state[11:17], 7.0)  # rests until the input has come back by twice the half width
    np.testing.assert_allclose(state[17:], np.arange(3, -11, -1) + 3.0)


def test_what_was_flown_before_sets_the_memory():
    wave = np.repeat(10.0 * np.sin(np.linspace(0.0, 4.0 * np.pi, 400))[:, None], 3, axis=1)
    once, again = remembered(wave, widths_nt=(4.0,))[0], remembered(wave, repeated=True, widths_nt=(4.0,))[0]
    # the last it saw was the way up from -10: held 4 above the lowest, and let go only 8 later
    np.testing.assert_allclose(again[0], -4.0, atol=0.1)
    np.testing.assert_array_equal(once[200:], again[200:])


@pytest.mark.parametrize("number", [0, 1, 2])
def test_the_derivative_by_the_width_is_that_of_a_difference(number):
    field = turning().background
    slopes = remembered(field, repeated=True)[1]
    apart = []
    for step in (-1e-5, 1e-5):
        widths = np.array(WIDTHS_NT)
        widths[number] *= np.exp(step)
        apart.append(remembered(field, repeated=True, widths_nt=tuple(widths))[0])
    numeric = (apart[1] - apart[0]) / 2e-5
    # between two rows at which a state is pushed the derivative may be another one
    assert np.mean(np.abs(slopes[number].T - numeric) > 1e-3 * WIDTHS_NT[number]) < 0.01


def test_relaxations_of_a_sine_lag_as_they_must():
    time_s = np.arange(6000) / 10.0
    omega = 2.0 * np.pi * 0.2
    wave = np.exp(1j * omega * np.arange(6001) / 10.0)
    field = 1000.0 * np.column_stack([wave.real, wave.imag, np.ones(6001)])
    found = relaxed(field, 10.0)[:6000]
    response = np.mean([1.0 / (1.0 + 1j * omega * late_s) for late_s in RELAXATIONS_S])
    wanted = 1000.0 * response * np.exp(1j * omega * time_s)
    np.testing.assert_allclose(found, np.column_stack([wanted.real, wanted.imag, np.full(6000, 1000.0)]), atol=2.0)


def flown_before(shape, memory):
    """Sources, signals of one flight and its target, with hysteresis of so many parts of the induced field."""
    field = turning().background
    sources = Sources(FluxgateField("none"), (), True, True, 8, shape)
    inputs = SourceInputs(field, np.zeros((len(field), 0)), [slice(0, len(field))], 10.0)
    motion = [field, *(np.gradient(field, 0.1, axis=0) * scale for scale in (1.0, 0.0)), relaxed(field, 10.0)]
    truth = np.zeros((len(sources.table), 3))
    truth[:4], truth[10:13] = TRUTH, memory * TRUTH[1:4]
    return sources, inputs, motion, exact_interference(sources.driven(inputs, motion), truth)


def test_half_widths_and_aftereffect_are_found():
    shape = Shape((0.12, -0.1, 0.08, 0.1), 0.0)
    sources, inputs, motion, target = flown_before(shape, 0.06)
    target += 1e-3 * np.random.default_rng(4).standard_normal(len(target))
    estimation = Estimation(sources.table, Reduction([TIME_S], [np.ones(len(TIME_S), dtype=bool)], 10.0))
    at, found = np.zeros((len(sources.table), 3)), Shape((0.0,) * len(BENT), 0.0)
    for number in range(8):
        driven = replace(sources, shape=found).driven(inputs, motion)
        flight = FlightRows(driven, target, np.zeros((len(target), 0)), np.zeros_like)
        at, found, _ = estimation.step([flight], at, found, size_groups=number > 0)
    np.testing.assert_allclose(found.bent[:3], shape.bent[:3], atol=0.01)
    assert found.bent[3] == pytest.approx(0.1, abs=0.04)


def test_a_memory_that_is_not_there_keeps_its_shape():
    sources, inputs, motion, target = flown_before(Shape((0.0,) * len(BENT), 0.0), 0.0)
    target += 1e-2 * np.random.default_rng(4).standard_normal(len(target))
    estimation = Estimation(sources.table, Reduction([TIME_S], [np.ones(len(TIME_S), dtype=bool)], 10.0))
    flight = FlightRows(sources.driven(inputs, motion), target, np.zeros((len(target), 0)), np.zeros_like)
    at = np.zeros((len(sources.table), 3))
    for number in range(4):
        at, found, bent_nt = estimation.step([flight], at, sources.shape, size_groups=number > 0)
    assert found.bent == (0.0,) * len(BENT)
    assert bent_nt == 0.0

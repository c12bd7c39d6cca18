"""Currents over time: means that are exact, lags and inrush against their differential equations."""

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from magsim.field.wiring.loads import Steps, cycles, lagged, longest_cycle, pulses, shortened, switched
from magsim.streams import stream

STEP_S = 1.0 / 120.0


def test_a_pulse_shorter_than_a_step_keeps_its_charge():
    times = pulses(-4.0, 64.0, 1.0, 0.0013, 0.21)
    levels = np.tile([9.0, 0.0], len(times) // 2)
    at = np.arange(0, 60 * 120) * STEP_S
    mean = Steps(times, levels).mean(at, STEP_S)
    assert mean.sum() * STEP_S == pytest.approx(60 * 9.0 * 0.0013, rel=1e-11)
    # A pulse that lies inside one step is seen by that step alone.
    lit = np.flatnonzero(mean)
    np.testing.assert_allclose(np.diff(lit), 120)
    np.testing.assert_allclose(mean[lit], 9.0 * 0.0013 / STEP_S, rtol=1e-9)


def test_a_pulse_over_a_boundary_is_shared():
    # 1 ms before the boundary between the steps around 0 and 1/120 s, 3 ms after it.
    edge = 0.5 * STEP_S
    steps = Steps(np.array([-10.0, edge - 1e-3, edge + 3e-3]), np.array([0.0, 2.0, 0.0]))
    np.testing.assert_allclose(
        steps.mean(np.arange(-1, 3) * STEP_S, STEP_S), [0.0, 2e-3 / STEP_S, 6e-3 / STEP_S, 0.0], atol=1e-12
    )


def test_the_lag_moves_charge_but_loses_none():
    times = np.append(-1e4, pulses(-4.0, 64.0, 1.0, 0.06, 0.0))
    levels = np.append(0.0, np.tile([8.0, 0.0], len(times) // 2))
    at = (np.arange(0, 30 * 120) + 0.5) * STEP_S
    mean = Steps(times, levels, rise_s=0.02).mean(at, STEP_S)
    assert mean.mean() == pytest.approx(8.0 * 0.06, rel=1e-9)
    assert mean.max() < 8.0 * (1.0 - np.exp(-0.06 / 0.02))


@pytest.mark.parametrize(("rise", "inrush", "decay"), [(0.02, 1.0, 1.0), (0.02, 4.0, 0.15), (0.0, 3.0, 0.1)])
def test_current_follows_its_differential_equation(rise, inrush, decay):
    times, levels = np.array([-50.0, 0.1, 0.45, 0.6]), np.array([1.0, 5.0, 5.5, 0.5])
    steps = Steps(times, levels, rise_s=rise, inrush=inrush, inrush_s=decay)

    def drive(t):
        j = np.searchsorted(times, t, side="right") - 1
        extra = (inrush - 1.0) * max(0.0, levels[j] - levels[j - 1]) if j else 0.0
        return levels[j] + extra * np.exp(-(t - times[j]) / decay)

    at = np.arange(0.0, 1.0, STEP_S)
    mean = steps.mean(at, STEP_S)
    kinks = [t for t in times if t > -1.0]
    if rise == 0.0:
        exact = [
            quad(drive, t - 0.5 * STEP_S, t + 0.5 * STEP_S, points=[k for k in kinks if abs(k - t) < STEP_S])[0]
            / STEP_S
            for t in at
        ]
        np.testing.assert_allclose(mean, exact, rtol=1e-8)
        return
    charge, state, start = [], [levels[0], 0.0], -0.5 * STEP_S
    edges = np.append(at - 0.5 * STEP_S, at[-1] + 0.5 * STEP_S)
    for stop in sorted({*edges[1:], *kinks}):
        middle = 0.5 * (start + stop)

        def right(t, y, middle=middle):
            j = np.searchsorted(times, middle, side="right") - 1
            extra = (inrush - 1.0) * max(0.0, levels[j] - levels[j - 1]) if j else 0.0
            return [(levels[j] + extra * np.exp(-(t - times[j]) / decay) - y[0]) / rise, y[0]]

        state = solve_ivp(right, (start, stop), state, rtol=1e-10, atol=1e-12).y[:, -1]
        start = stop
        if np.isclose(stop, edges[1:]).any():
            charge.append(state[1])
    np.testing.assert_allclose(mean, np.diff(charge, prepend=0.0) / STEP_S, rtol=1e-7)


def test_lag_of_samples_is_exact_on_straight_lines():
    time = np.arange(400) * STEP_S
    np.testing.assert_allclose(lagged(np.full(400, 3.0), 0.05, STEP_S), 3.0, rtol=1e-14)
    ramp = lagged(2.0 * time, 0.05, STEP_S)
    np.testing.assert_allclose(ramp, 2.0 * (time - 0.05 * -np.expm1(-time / 0.05)), atol=1e-13)
    np.testing.assert_array_equal(lagged(time, 0.0, STEP_S), time)


def test_cycles_keep_to_their_spans_and_go_on():
    spans = np.diff(cycles(stream(3, "pump"), -4.0, 4000.0, on_s=60.0, off_s=110.0, jitter=0.25))
    on, off = spans[::2], spans[1::2]
    assert 45.0 <= on.min() < on.max() <= 75.0
    assert 82.5 <= off.min() < off.max() <= 137.5
    assert np.mean(on) == pytest.approx(60.0, rel=0.1)
    short, long = (
        cycles(stream(3, "pump"), -4.0, stop, on_s=60.0, off_s=110.0, jitter=0.25) for stop in (500.0, 4000.0)
    )
    np.testing.assert_array_equal(short, long[: len(short)])
    assert short[0] <= -4.0
    assert long[-1] > 4000.0


def test_a_switch_changes_half_way_between_its_rows():
    times, states = switched(np.arange(6) / 30.0, np.array([0.0, 0.0, 1.0, 1.0, 0.2, 0.0]))
    np.testing.assert_allclose(times, [0.0, 1.5 / 30.0, 3.5 / 30.0])
    np.testing.assert_array_equal(states, [0.0, 1.0, 0.0])


@pytest.mark.parametrize(
    ("lengths", "times", "wanted"),
    [
        ((100.0,), 3, 100.0 / 3.0),
        ((100.0, 40.0), 3, 40.0),
        ((100.0, 10.0), 3, 100.0 / 3.0),
        ((50.0, 50.0, 50.0), 3, 50.0),
    ],
)
def test_the_longest_cycle_fits_so_many_times_into_the_spans(lengths, times, wanted):
    starts = np.cumsum((0.0, *lengths[:-1])) + 7.0 * np.arange(len(lengths))
    spans = [(start, start + length) for start, length in zip(starts, lengths, strict=True)]
    cycle = longest_cycle(spans, times)
    assert cycle == pytest.approx(wanted)
    assert sum(int(length / cycle + 1e-9) for length in lengths) >= times
    assert sum(int(length / (1.001 * cycle)) for length in lengths) < times


def test_a_cycle_is_shortened_in_its_pause_first():
    assert shortened(4.0, 240.0, 300.0) == (4.0, 240.0)
    assert shortened(4.0, 240.0, 30.0) == (4.0, 26.0)
    assert shortened(60.0, 110.0, 30.0) == (15.0, 15.0)

"""Hysteresis and viscosity of steel against what is known of them in closed form."""

import itertools

import numpy as np
import pytest

from magsim.field.sources.memory import hysteresis, play, viscosity
from magsim.field.stepping import first_order, hold_weights

RADII = (2500.0, 8000.0, 16000.0)
WEIGHTS = (0.02, 0.03, 0.01)


def column(values: np.ndarray) -> np.ndarray:
    """One axis as (n, 3): the others stay at zero."""
    out = np.zeros((len(values), 3))
    out[:, 0] = values
    return out


def remembered(values: np.ndarray, start: str = "demagnetized") -> np.ndarray:
    return hysteresis(column(values), RADII, WEIGHTS, start)[:, 0]


def path(*turns: float, steps: int = 60) -> np.ndarray:
    """Straight runs through turning points."""
    runs = [np.linspace(a, b, steps, endpoint=False) for a, b in itertools.pairwise(turns)]
    return np.concatenate([*runs, turns[-1:]])


def area(u: np.ndarray, z: np.ndarray) -> float:
    """Area inside a closed path."""
    return float(np.sum(0.5 * (z[1:] + z[:-1]) * np.diff(u)))


@pytest.mark.parametrize("count", [1, 2, 7, 99, 1000])
def test_play_is_the_plain_recursion_to_the_last_bit(count: int) -> None:
    rng = np.random.default_rng(count)
    values = np.cumsum(rng.standard_normal((count, 4)), axis=0)
    for radius in (0.0, 0.3, 2.0, 1e9):
        state = np.array([0.0, 1.0, -3.0, 0.2])
        expected = np.empty_like(values)
        for n, now in enumerate(values):
            state = np.minimum(np.maximum(state, now - radius), now + radius)
            expected[n] = state
        np.testing.assert_array_equal(play(values, radius, np.array([0.0, 1.0, -3.0, 0.2])), expected)


@pytest.mark.parametrize("start", ["settled", "aligned", "demagnetized"])
def test_no_radius_is_linear(start: str) -> None:
    values = column(path(0.0, 30000.0, -20000.0, 10000.0))
    np.testing.assert_allclose(hysteresis(values, (0.0, 0.0), (0.04, 0.03), start), 0.07 * values, atol=1e-10)


def test_a_cycle_closes_on_itself() -> None:
    u = path(0.0, 30000.0, -30000.0, 30000.0, -30000.0, 30000.0)
    z = remembered(u)
    first, second = slice(60, 181), slice(180, 301)
    assert np.abs(z[first] - z[second]).max() < 1e-12 * np.abs(z).max()
    assert np.abs(z[60] - z[:61]).max() > 100.0  # the first rise is another path


def test_loss_of_a_cycle_is_the_area_of_the_parallelograms() -> None:
    """Each operator that is dragged along encloses 4 r (U - r); those of larger radius rest."""
    for amplitude in (2000.0, 12000.0, 30000.0):
        u = path(0.0, amplitude, -amplitude, amplitude, steps=3000)
        z = remembered(u)
        cycle = slice(3000, None)
        exact = sum(w * 4.0 * r * max(0.0, amplitude - r) for r, w in zip(RADII, WEIGHTS, strict=True))
        assert abs(area(u[cycle], z[cycle])) == pytest.approx(exact, rel=2e-3, abs=1e-6)


def test_speed_does_not_count() -> None:
    """The same turning points, gone through at other speeds and with a rest on the way."""
    turns = (0.0, 25000.0, -7000.0, 18000.0, -30000.0, 4000.0)
    slow, fast = remembered(path(*turns, steps=64)), remembered(path(*turns, steps=16))
    np.testing.assert_allclose(slow[::4], fast, atol=1e-9)
    phase = np.linspace(0.0, 1.0, 81)
    uneven = np.concatenate([[0.0], *(a + (b - a) * phase**3 for a, b in itertools.pairwise(turns))])
    np.testing.assert_allclose(remembered(uneven)[81::81], fast[16::16][: len(uneven[81::81])], atol=1e-9)


def test_a_closed_excursion_is_wiped_out() -> None:
    """Return-point memory: after a smaller loop the path goes on as if it had not been."""
    plain = remembered(path(0.0, 30000.0, -30000.0, 20000.0))
    excursion = remembered(path(0.0, 30000.0, -30000.0, 0.0, -15000.0, 0.0, 20000.0))
    assert excursion[-1] == plain[-1]
    assert excursion[5 * 60] == excursion[3 * 60]


def test_loops_between_the_same_ends_are_congruent() -> None:
    """Minor loops between the same fields have the same shape, wherever they were entered."""
    entered_down = remembered(path(0.0, 40000.0, -5000.0, 9000.0, -5000.0))
    entered_up = remembered(path(0.0, -40000.0, 9000.0, -5000.0, 9000.0, -5000.0))
    loops = [z[-121:] - z[-121] for z in (entered_down, entered_up)]
    np.testing.assert_allclose(loops[0], loops[1], atol=1e-9)


def test_weak_fields_follow_rayleigh() -> None:
    """A density w(r) = 2 b of operators: rise b u^2, loop z = 2 b U u +- b (U^2 - u^2) over its reversible part.

    The play sum of a constant density over 0 < r < U is, on the virgin curve, the integral of w (u - r); down from U it
    is z(U) - 2 of the virgin curve of half the way (Masing): Rayleigh's parabolas.
    """
    amplitude, count, b = 20000.0, 400, 1e-9
    radii = (np.arange(count) + 0.5) * amplitude / count
    weights = np.full(count, 2.0 * b * amplitude / count)
    u = path(0.0, amplitude, -amplitude, amplitude, steps=200)
    z = hysteresis(column(u), tuple(radii), tuple(weights), "demagnetized")[:, 0]
    rise, down, up = slice(0, 201), slice(200, 401), slice(400, 601)
    scale = b * amplitude**2
    assert np.abs(z[rise] - b * u[rise] ** 2).max() < 1e-4 * scale
    for part, sign in ((down, 1.0), (up, -1.0)):
        parabola = b * amplitude * u[part] + sign * 0.5 * b * (amplitude**2 - u[part] ** 2)
        assert np.abs(z[part] - parabola).max() < 1e-4 * scale
    loss = abs(area(u[200:], z[200:]))
    assert loss == pytest.approx(4.0 / 3.0 * b * amplitude**3, rel=1e-3)


def test_axes_do_not_mix() -> None:
    u = path(0.0, 25000.0, -7000.0, 18000.0)
    both = np.stack([u, -0.5 * u, 0.0 * u], axis=1)
    out = hysteresis(both, RADII, WEIGHTS, "demagnetized")
    np.testing.assert_array_equal(out[:, 0], remembered(u))
    np.testing.assert_array_equal(out[:, 1], remembered(-0.5 * u))
    assert not np.any(out[:, 2])


def test_starts() -> None:
    """Settled: a second flight after the first changes nothing; the first field; the virgin rise."""
    flight = 9000.0 + path(0.0, 16000.0, -21000.0, 12000.0, 3000.0)
    twice = remembered(np.concatenate([flight, flight]), "aligned")[len(flight) :]
    np.testing.assert_array_equal(remembered(flight, "settled"), twice)
    assert remembered(flight, "aligned")[0] == pytest.approx(9000.0 * sum(WEIGHTS))
    virgin = sum(w * max(0.0, 9000.0 - r) for r, w in zip(RADII, WEIGHTS, strict=True))
    assert remembered(flight, "demagnetized")[0] == pytest.approx(virgin)


def test_viscosity_steps_like_the_exponential() -> None:
    time = np.arange(2000) / 120.0
    step = np.tile([20000.0, 0.0, -3000.0], (2000, 1))
    out = viscosity(step, (0.5, 7.0), (0.01, 0.02), 1.0 / 120.0, "demagnetized")
    shape = 0.01 * (1.0 - np.exp(-time / 0.5)) + 0.02 * (1.0 - np.exp(-time / 7.0))
    np.testing.assert_allclose(out, shape[:, None] * step, atol=1e-8)
    for start in ("settled", "aligned"):
        np.testing.assert_allclose(viscosity(step, (0.5, 7.0), (0.01, 0.02), 1 / 120, start), 0.03 * step, rtol=1e-9)


@pytest.mark.parametrize("time_constant", [0.05, 2.0, 1000.0])
def test_viscosity_of_a_sine_is_the_phasor(time_constant: float) -> None:
    """Whole periods, settled: the response of the straight lines between the samples, and of the sine itself."""
    rate, hertz = 120.0, 0.2
    time = np.arange(round(10 / hertz * rate) + 1) / rate
    omega = 2.0 * np.pi * hertz
    wave = np.exp(1j * omega * time)
    drive = np.stack([wave.real, wave.imag, 0.0 * time], axis=1) * 20000.0
    out = viscosity(drive, (time_constant,), (1.0,), 1.0 / rate, "settled")
    found = out[:, 0] + 1j * out[:, 1]
    exact = 20000.0 * wave / (1.0 + 1j * omega * time_constant)
    # A sine cut into straight lines is smaller by (w dt)^2 / 12: 1e-5 at 0.2 Hz.
    assert np.abs(found - exact).max() < 2e-5 * np.abs(exact).max()


def test_a_straight_line_is_stepped_exactly() -> None:
    time = np.arange(500) * 0.01
    for rate in (-3.0, -1e-4, complex(-0.4, 30.0)):
        out = first_order(rate, 2.0 + 5.0 * time, 0.01, 1.0)
        fine = np.clongdouble(rate)  # the closed form of a slow decay cancels eight digits
        particular = -(2.0 + 5.0 * time) / fine - 5.0 / fine**2
        exact = particular + (1.0 - particular[0]) * np.exp(fine * time)
        np.testing.assert_allclose(out, exact.astype(complex), rtol=1e-10)


def test_weights_of_the_hold_join() -> None:
    """Series and closed form at the size where they meet."""
    for angle in (0.0, 1.0, np.pi):
        low, high = (hold_weights(size * np.exp(1j * angle)) for size in (0.1 - 1e-12, 0.1 + 1e-12))
        np.testing.assert_allclose(low, high, rtol=1e-11)

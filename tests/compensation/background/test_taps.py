"""Finite filters against the sine, and against their own statement of what they are exact for."""

import numpy as np
import pytest

from magsim.compensation.background import taps

TIME_S = np.arange(400) / 10.0


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize(("lookahead", "tolerance"), [(8, 5e-4), (4, 2e-3)])
def test_a_sine_of_the_band_is_advanced_and_differentiated(order, lookahead, tolerance):
    omega, advance_s = 2.0 * np.pi * 0.35, 0.13
    found = taps(order, advance_s, lookahead, 10.0)(np.sin(omega * TIME_S))
    phase = omega * (TIME_S + advance_s) + 0.5 * np.pi * order
    wanted = omega**order * np.sin(phase)
    inside = slice(20, -20)
    # the second derivative amplifies the noise that the filter is designed for
    relative = tolerance * (20.0 if order == 2 else 1.0)
    np.testing.assert_allclose(found[inside], wanted[inside], atol=relative * omega**order)


@pytest.mark.parametrize("lookahead", [0, 3, 8])
def test_a_straight_line_is_exact(lookahead):
    line = 40_000.0 + 3.0 * TIME_S
    assert taps(0, 0.2, lookahead, 10.0)(line)[200] == pytest.approx(line[200] + 0.6, abs=1e-6)
    assert taps(1, 0.2, lookahead, 10.0)(line)[200] == pytest.approx(3.0, abs=1e-6)


def test_a_row_depends_on_no_row_beyond_the_look_ahead():
    values = np.random.default_rng(0).standard_normal(100)
    changed = values.copy()
    changed[60:] += 5.0
    filtered = [taps(1, 0.1, 4, 10.0)(series) for series in (values, changed)]
    np.testing.assert_array_equal(filtered[0][:56], filtered[1][:56])
    assert filtered[0][56] != filtered[1][56]


def test_weights_are_the_least_squares_of_their_statement():
    """Motion that is flat to 0.8 Hz and falls with the eighth power above, white noise, and straight lines exactly."""
    offsets = np.arange(-10, 9) / 10.0
    omega = 2.0 * np.pi * np.linspace(0.0, 5.0, 512)
    power = 1.0 / (1.0 + (omega / (2.0 * np.pi * 0.8)) ** 8)
    root = np.sqrt(power / power.sum())[:, None]
    phase = omega[:, None] * offsets
    wanted = 1j * omega * np.exp(0.13j * omega)
    rows = np.vstack([root * np.cos(phase), root * np.sin(phase), 3e-6 * np.eye(19)])
    target = np.concatenate([root[:, 0] * wanted.real, root[:, 0] * wanted.imag, np.zeros(19)])
    # within the weights that are exact for a straight line
    exact = np.vstack([np.ones(19), offsets])
    start = np.linalg.lstsq(exact, np.array([0.0, 1.0]), rcond=None)[0]
    free = np.linalg.svd(exact)[2][2:].T
    expected = start + free @ np.linalg.lstsq(rows @ free, target - rows @ start, rcond=None)[0]
    np.testing.assert_allclose(taps(1, 0.13, 8, 10.0).weights, expected, atol=1e-4 * np.abs(expected).max())

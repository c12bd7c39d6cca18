"""R-L circuits in a changing field: modes against the phasor, time stepping against exact answers."""

import numpy as np
import pytest

from magsim.field.metal.coils import Loop, inductance_matrix
from magsim.field.metal.eddy import Modes, reduce_to_modes, slow_limit, slow_states, states
from magsim.field.stepping import derivative

TAU = 0.010


def _loops() -> list[Loop]:
    wing = np.array([[0.65, 0.8, -0.9], [0.65, 7.4, -0.95], [-0.35, 7.4, -0.95], [-0.95, 0.8, -0.9]])
    frame = np.array([[1.6, 0.75, -0.7], [1.6, 0.75, 0.7], [1.6, -0.75, 0.7], [1.6, -0.75, -0.7]])
    side = np.array([[1.85, 0.7, -0.55], [3.9, 0.45, -0.35], [3.9, 0.45, 0.5], [1.85, 0.7, 0.65]])
    return [Loop(corners, 0.1) for corners in (wing, wing * (1, -1, 1), frame, side)]


@pytest.fixture(scope="module")
def circuit() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    loops = _loops()
    matrix = inductance_matrix(loops)
    resistance = np.diag(np.diag(matrix) / np.array([0.010, 0.012, 0.008, 0.009]))
    points = np.array([[0.0, 0.0, 0.0], [-3.0, 0.2, 0.1]])
    flux = np.array([loop.area_vector for loop in loops])
    field = np.stack([loop.field(points) for loop in loops], axis=-1)
    return matrix, resistance, flux, field


def test_one_loop_has_the_time_constant_l_over_r() -> None:
    matrix = np.array([[3e-6]])
    modes = reduce_to_modes(matrix, np.array([[2e-4]]), np.array([[1.0, 2.0, 3.0]]), np.ones((1, 3, 1)) * 1e-7)
    assert modes.tau_s[0] == pytest.approx(0.015)
    # E = -S F / R
    np.testing.assert_allclose(slow_limit(modes)[0], -1e-7 / 2e-4 * np.outer(np.ones(3), [1.0, 2.0, 3.0]))


@pytest.mark.parametrize("frequency_hz", [0.01, 0.2, 1.0, 20.0, 500.0])
def test_modes_give_the_phasor_of_the_coupled_circuit(
    circuit: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray], frequency_hz: float
) -> None:
    matrix, resistance, flux, field = circuit
    omega = 2j * np.pi * frequency_hz
    currents = np.linalg.solve(omega * matrix + resistance, -omega * flux)
    exact = np.einsum("sxc,ck->sxk", field, currents)
    modes = reduce_to_modes(*circuit)
    gains = -omega / (1.0 + omega * modes.tau_s)
    got = np.einsum("sxm,m,mk->sxk", modes.field, gains, modes.drive)
    np.testing.assert_allclose(got, exact, atol=1e-11 * np.abs(exact).max())


def test_slow_limit_is_the_low_end_of_the_phasor(
    circuit: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
) -> None:
    _, resistance, flux, field = circuit
    exact = -np.einsum("sxc,ck->sxk", field, np.linalg.solve(resistance, flux))
    np.testing.assert_allclose(slow_limit(reduce_to_modes(*circuit)), exact, atol=1e-12 * np.abs(exact).max())


def test_currents_oppose_the_change(circuit: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]) -> None:
    """Lenz: the moment of the currents is a negative matrix times dB/dt; all time constants are positive."""
    modes = reduce_to_modes(*circuit)
    assert np.all(modes.tau_s > 0.0)
    assert np.all(np.diff(modes.tau_s) <= 0.0)
    assert np.linalg.eigvalsh(-np.einsum("ki,kj->ij", modes.drive, modes.drive)).max() < 1e-9


def test_no_circuit_makes_no_field() -> None:
    modes = reduce_to_modes(np.zeros((0, 0)), np.zeros((0, 0)), np.zeros((0, 3)), np.zeros((2, 3, 0)))
    np.testing.assert_array_equal(slow_limit(modes), np.zeros((2, 3, 3)))


def stepped(tau: float, rate: np.ndarray, step_s: float) -> np.ndarray:
    """The state of one mode that the field along x drives."""
    one = Modes(np.array([tau]), np.array([[1.0, 0.0, 0.0]]), np.zeros((1, 3, 1)))
    return states(one, np.column_stack([rate, np.zeros((len(rate), 2))]), step_s)[:, 0]


def test_steps_is_exact_on_a_broken_line() -> None:
    """A derivative at rest that starts to climb: q = -slope (t - tau (1 - exp(-t / tau)))."""
    step, slope = 1.0 / 120.0, 3.0
    time = np.arange(-20, 200) * step
    got = stepped(TAU, slope * np.maximum(time, 0.0), step)
    after = time.clip(0.0)
    np.testing.assert_allclose(got, -slope * (after + TAU * np.expm1(-after / TAU)), atol=1e-12 * slope)


def test_steps_starts_without_a_transient() -> None:
    step = 1.0 / 120.0
    time = np.arange(0, 600) * step
    got = stepped(TAU, 2.0 + 3.0 * time, step)
    np.testing.assert_allclose(got, -(2.0 + 3.0 * (time - TAU)), rtol=1e-12)


def _sine_error(tau: float, frequency_hz: float, rate_hz: float) -> float:
    """Largest error over the amplitude of the steady answer to a sine."""
    omega = 2.0 * np.pi * frequency_hz
    time = np.arange(int(20.0 * rate_hz)) / rate_hz
    got = stepped(tau, omega * np.cos(omega * time), 1.0 / rate_hz)
    gain = -1j * omega / (1.0 + 1j * omega * tau)
    exact = np.imag(gain * np.exp(1j * omega * time))
    settled = time > 5.0
    return float(np.abs(got - exact)[settled].max() / abs(gain))


@pytest.mark.parametrize(
    ("frequency_hz", "rate_hz", "limit"),
    [(0.5, 10.0, 0.030), (0.5, 50.0, 0.0015), (0.5, 120.0, 0.00026), (1.0, 60.0, 0.0041), (1.0, 120.0, 0.00102)],
)
def test_steps_on_a_sine(frequency_hz: float, rate_hz: float, limit: float) -> None:
    assert _sine_error(TAU, frequency_hz, rate_hz) < limit


def test_steps_converge_with_the_square_of_the_step() -> None:
    errors = [_sine_error(TAU, 0.5, rate) for rate in (240.0, 480.0)]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.25)


def test_slow_states_are_the_stepped_ones_to_second_order(
    circuit: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
) -> None:
    """A slow sine of the field: the error is the square of the angle that a time constant is of it."""
    modes, omega = reduce_to_modes(*circuit), 2.0 * np.pi * 0.5
    time = np.arange(2400) / 1200.0
    axis = np.array([1.0, -0.4, 0.7])
    rate, curve = (np.outer(values, axis) for values in (np.cos(omega * time), -omega * np.sin(omega * time)))
    exact, slow = states(modes, rate, 1.0 / 1200.0), slow_states(modes, rate, curve)
    error = np.abs(exact - slow)[600:].max(axis=0)
    assert np.all(error < 1.1 * (omega * modes.tau_s) ** 2 * np.abs(exact).max(axis=0))


def test_derivative_of_polynomials_is_exact_to_the_ends() -> None:
    step = 0.1
    time = np.arange(12) * step
    values = np.column_stack([time**power for power in range(5)])
    exact = np.column_stack([power * time ** max(power - 1, 0) for power in range(5)])
    np.testing.assert_allclose(derivative(values, step), exact, atol=1e-11)


def test_derivative_of_a_sine_of_one_hertz() -> None:
    time, omega = np.arange(600) / 120.0, 2.0 * np.pi
    got = derivative(np.sin(omega * time), 1.0 / 120.0)
    assert np.abs(got - omega * np.cos(omega * time))[2:-2].max() < 3e-7 * omega


def test_derivative_needs_five_samples() -> None:
    with pytest.raises(ValueError, match="needs 5 samples"):
        derivative(np.zeros(4), 0.1)


def test_modes_hold_the_seconds_of_the_slow_limit() -> None:
    modes = Modes(np.array([0.01]), np.array([[1.0, 0.0, 0.0]]), np.array([[[2e-4], [0.0], [0.0]]]))
    np.testing.assert_allclose(slow_limit(modes)[0], np.diag([-2e-4, 0.0, 0.0]))

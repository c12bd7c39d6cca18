"""What turns, remembers and bends: means over steps, loops and their loss, slow magnetization, oscillators, speed."""

import itertools
import time

import numpy as np

from magsim.field.flex import BendingMode, bend
from magsim.field.sources.memory import hysteresis, play, viscosity
from magsim.field.sources.rotors import Rotation, mean_tone
from magsim.units import G0
from tests.benchmarks.rows import Row, at_most, stated

RADII, WEIGHTS = (2650.0, 7950.0, 15900.0), (0.02, 0.02, 0.02)
SAMPLES = 144_000
"""Twenty minutes at 120 Hz."""


def _tone(hertz: float, step_hz: int, seconds: int) -> np.ndarray:
    """Reading of a 100 ms counter, ten times a second, from means over steps."""
    time_s = (np.arange(seconds * step_hz) + 0.5) / step_hz
    omega, zero = 2.0 * np.pi * hertz, np.zeros(seconds * step_hz)
    samples = mean_tone(Rotation(omega * time_s, omega + zero, zero, zero), 1.0 / step_hz)
    return samples.reshape(-1, step_hz // 10).mean(axis=1)


def _counter_error(hertz: float) -> float:
    """Largest relative departure of the counter's reading from the integral of the tone."""
    edges, omega = np.arange(101) * 0.1, 2.0 * np.pi * hertz
    exact = np.diff(np.exp(1j * omega * edges)) / (0.1j * omega)
    return max(float(np.max(np.abs(_tone(hertz, step, 10) - exact) / np.abs(exact))) for step in (120, 240))


def _alias_hz(hertz: float) -> float:
    """Frequency at which the counter shows a tone."""
    spectrum = np.abs(np.fft.rfft(_tone(hertz, 120, 100).real * np.hanning(1000)))
    return float(np.fft.rfftfreq(1000, 0.1)[spectrum.argmax()])


def _loop(amplitude: float) -> tuple[np.ndarray, np.ndarray]:
    """Field and answer over a virgin rise and two cycles, 4000 samples a half cycle."""
    turns = (0.0, amplitude, -amplitude, amplitude, -amplitude, amplitude)
    runs = [np.linspace(a, b, 4000, endpoint=False) for a, b in itertools.pairwise(turns)]
    field = np.concatenate([*runs, turns[-1:]])
    return field, hysteresis(field[:, None], RADII, WEIGHTS, "demagnetized")[:, 0]


def _closing() -> float:
    """Largest departure of the second cycle from the first, over the amplitude of the answer."""
    _, answer = _loop(30000.0)
    first, second = answer[4000:12001], answer[12000:20001]
    return float(np.max(np.abs(first - second)) / np.max(np.abs(answer)))


def _loss_pct() -> float:
    """Loss of a cycle against the sum of 4 w r (U - r)."""
    field, answer = _loop(30000.0)
    u, z = field[4000:12001], answer[4000:12001]
    loss = abs(float(np.sum(0.5 * (z[1:] + z[:-1]) * np.diff(u))))
    exact = sum(4.0 * w * r * (30000.0 - r) for r, w in zip(RADII, WEIGHTS, strict=True))
    return 100.0 * abs(loss / exact - 1.0)


def _recursion_differs() -> float:
    """Samples at which the blocked play operator is not, to the last bit, the plain recursion."""
    values = np.cumsum(np.random.default_rng(1).standard_normal((5000, 3)), axis=0)
    state, plain = np.zeros(3), np.empty_like(values)
    for n, now in enumerate(values):
        state = np.minimum(np.maximum(state, now - 2.0), now + 2.0)
        plain[n] = state
    return float(np.sum(play(values, 2.0, np.zeros(3)) != plain))


def _phasor_pct() -> float:
    """Viscosity of a field that swings at 0.2 Hz against 1 / (1 + i w T)."""
    time_s, omega = np.arange(6001) / 120.0, 0.4 * np.pi
    wave = np.exp(1j * omega * time_s)
    drive = np.stack([wave.real, wave.imag, 0.0 * time_s], axis=1)
    worst = 0.0
    for constant in (1.0, 10.0, 100.0):
        out = viscosity(drive, (constant,), (1.0,), 1.0 / 120.0, "settled")
        exact = wave / (1.0 + 1j * omega * constant)
        error = np.max(np.abs(out[:, 0] + 1j * out[:, 1] - exact)) / abs(exact[0])
        worst = max(worst, 100.0 * float(error))
    return worst


MODE = BendingMode(np.array([0.0, 0.0, 1.0]), 4.0, 0.03, 1.566, np.zeros(3))


def _load(load_g: np.ndarray) -> np.ndarray:
    """Deflection [m] under a load factor."""
    return bend(MODE, -G0 * load_g[:, None] * MODE.direction, 1.0 / 120.0)


def _static_error() -> float:
    """Deflection under one more g over p g / w^2, less one."""
    exact = 1.566 * G0 / (8.0 * np.pi) ** 2
    return float(np.max(np.abs(_load(np.full(500, 2.0)) / exact - 1.0)))


def _resonance_error_pct() -> float:
    """A load that swings at the natural frequency, against the driven oscillator."""
    time_s, omega = np.arange(7200) / 120.0, 8.0 * np.pi
    gain = 1.566 * 0.3 * G0 / (0.06j * omega**2) * np.sinc(4.0 / 120.0) ** 2
    exact = (gain * np.exp(1j * omega * time_s)).real
    found = _load(1.0 + 0.3 * np.cos(omega * time_s))
    return 100.0 * float(np.max(np.abs(found - exact)[3600:]) / abs(gain))


def _us_per_sample() -> tuple[float, float]:
    """CPU time for a sample of three axes: three settled play operators, three exponentials."""
    field = np.cumsum(np.random.default_rng(2).standard_normal((SAMPLES, 3)), axis=0) * 100.0
    begin = time.process_time()
    hysteresis(field, RADII, WEIGHTS, "settled")
    middle = time.process_time()
    viscosity(field, (1.0, 10.0, 100.0), (0.002, 0.002, 0.002), 1.0 / 120.0, "settled")
    return 1e6 * (middle - begin) / SAMPLES, 1e6 * (time.process_time() - middle) / SAMPLES


def rows() -> list[Row]:
    """Figures of this subject."""
    play_us, viscous_us = _us_per_sample()
    return [
        at_most("rotor_counter_31_7hz_error", _counter_error(31.7), "1", 1e-9),
        at_most("rotor_counter_103hz_error", _counter_error(103.0), "1", 1e-9),
        at_most("rotor_alias_31_7hz_error", abs(_alias_hz(31.7) - 1.7), "Hz", 0.01),
        at_most("rotor_alias_103hz_error", abs(_alias_hz(103.0) - 3.0), "Hz", 0.01),
        at_most("hysteresis_loop_closing", _closing(), "1", 1e-12),
        at_most("hysteresis_loss_error_pct", _loss_pct(), "%", 0.1),
        at_most("hysteresis_samples_off_the_recursion", _recursion_differs(), "1", 0.0),
        at_most("viscosity_phasor_error_pct", _phasor_pct(), "%", 0.01),
        at_most("flex_static_error", _static_error(), "1", 1e-12),
        at_most("flex_resonance_error_pct", _resonance_error_pct(), "%", 0.05),
        stated("hysteresis_us_per_sample", play_us, "us"),
        stated("viscosity_us_per_sample", viscous_us, "us"),
    ]

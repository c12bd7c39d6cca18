"""What is learned in flight: against direct least squares, over hours, and what must not be learned."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal, stats

from magsim.compensation.recursive import Adaptation, Known, kernel
from magsim.compensation.recursive.adaptation import MEDIAN, CausalBand
from magsim.signals import BAND_HZ, EDGE_S

RATE_HZ = 10.0
EDGE = round(EDGE_S * RATE_HZ)


def motion(rng, count, columns, *, gain=1.0):
    """Columns that move in the band of compensation, (n, c)."""
    noise = rng.normal(size=(count, columns))
    return gain * signal.sosfilt(signal.butter(2, (0.08, 0.8), "bandpass", fs=RATE_HZ, output="sos"), noise, axis=0)


def known_of(rng, columns=16):
    rows = CausalBand(RATE_HZ)(motion(rng, 6000, columns) @ np.diag(np.logspace(0.0, 4.0, columns)))[EDGE:]
    truth = np.logspace(2.0, -2.0, columns)
    return Known.of(rows, rows @ truth + rng.normal(scale=0.01, size=len(rows)), truth)


def test_filter_is_that_of_scipy():
    rng = np.random.default_rng(1)
    table = 5e4 + rng.normal(size=(500, 3))
    band = CausalBand(RATE_HZ)
    states, out = band.begun(table[0]), []
    for row in table:
        channels = row.copy()
        kernel.filtered(band.sos, states, channels)
        out.append(channels)
    sos = signal.butter(4, BAND_HZ, "bandpass", fs=RATE_HZ, output="sos")
    expected, _ = signal.sosfilt(sos, table, axis=0, zi=signal.sosfilt_zi(sos)[:, :, None] * table[0])
    np.testing.assert_allclose(out, expected, rtol=0.0, atol=1e-9)


def test_cholesky_solves_as_numpy_does():
    rng = np.random.default_rng(2)
    root = rng.normal(size=(16, 16))
    matrix, right, out = root @ root.T + np.eye(16), rng.normal(size=16), np.zeros(16)
    kernel.solved(matrix, right, np.zeros((16, 16)), out)
    np.testing.assert_allclose(out, np.linalg.solve(matrix, right), rtol=1e-12)


def test_each_row_gives_the_answer_of_weighted_least_squares():
    """All rows at once, with their weights, and the training as so many seconds; no error is beyond the limit."""
    rng = np.random.default_rng(3)
    known = replace(known_of(rng, 5), deviation_nt=1e6)
    forgetting_s, anchor_s, count = 40.0, 7.0, 900
    adaptation = Adaptation(known, RATE_HZ, forgetting_s=forgetting_s, anchor_s=anchor_s)
    rows = motion(rng, count, 5) @ np.diag(np.logspace(0.0, 4.0, 5))
    change = 0.3 * known.coefficients
    readings = 5e4 + rows @ (known.coefficients + change) + rng.normal(scale=0.001, size=count)
    for row, reading in zip(rows, readings, strict=True):
        adaptation.learn(row, reading)
    filtered = CausalBand(RATE_HZ)(np.column_stack([rows, readings]))[EDGE:]
    errors = filtered[:, -1] - filtered[:, :-1] @ known.coefficients
    scaled = filtered[:, :-1] / known.scale
    ages = np.arange(len(scaled))[::-1] / RATE_HZ
    weights = np.exp(-ages / forgetting_s)
    matrix = anchor_s * RATE_HZ * known.products + scaled.T @ (weights[:, None] * scaled)
    expected = known.coefficients + np.linalg.solve(matrix, scaled.T @ (weights * errors)) / known.scale
    np.testing.assert_allclose(adaptation.coefficients, expected, rtol=1e-9)


def test_ten_hours_leave_the_covariance_symmetric_and_positive():
    """Maneuvers, then hours of straight and level flight without excitation, then maneuvers."""
    rng = np.random.default_rng(4)
    known = known_of(rng)
    adaptation = Adaptation(known, RATE_HZ, forgetting_s=600.0, anchor_s=30.0)
    scales = np.diag(np.logspace(0.0, 4.0, 16))
    truth = 1.02 * known.coefficients
    least = np.linalg.eigvalsh(30.0 * RATE_HZ * known.products)[0]
    for hour in range(10):
        quiet = 2 <= hour < 8
        rows = motion(rng, 36_000, 16, gain=1e-6 if quiet else 1.0) @ scales
        noise = 0.3 * np.sin(np.arange(36_000) / 40.0) + rng.normal(scale=0.01, size=36_000)
        for row, reading in zip(rows, 5e4 + rows @ truth + noise, strict=True):
            adaptation.learn(row, reading)
        covariance = adaptation.covariance
        np.testing.assert_array_equal(covariance, covariance.T)
        scaled = covariance * np.outer(known.scale, known.scale)
        values = np.linalg.eigvalsh(scaled)
        assert values[0] > 0.0
        # never more than what the training by itself leaves open
        assert values[-1] <= 1.001 * adaptation._deviation_nt**2 / least
        if not quiet:
            np.testing.assert_allclose(adaptation.coefficients, truth, rtol=2e-3)


def test_what_is_not_a_reading_is_not_learned():
    """A held reading and the step at its end, and the first rows of a piece."""
    rng = np.random.default_rng(5)
    known = known_of(rng)
    adaptation = Adaptation(known, RATE_HZ, forgetting_s=600.0, anchor_s=30.0)
    rows = motion(rng, 2000, 16) @ np.diag(np.logspace(0.0, 4.0, 16))
    readings = 5e4 + rows @ known.coefficients + rng.normal(scale=0.01, size=2000)
    readings[800:900] = readings[799]
    readings[900:] += 500.0
    for row, reading in zip(rows[:EDGE], readings, strict=False):
        adaptation.learn(row, reading)
    np.testing.assert_array_equal(adaptation.coefficients, known.coefficients)
    for row, reading in zip(rows[EDGE:], readings[EDGE:], strict=True):
        adaptation.learn(row, reading)
    np.testing.assert_allclose(adaptation.coefficients, known.coefficients, rtol=1e-3)


def test_a_gap_keeps_what_was_learned_and_begins_the_filter_anew():
    rng = np.random.default_rng(6)
    known = known_of(rng)
    adaptation = Adaptation(known, RATE_HZ, forgetting_s=600.0, anchor_s=30.0)
    rows = motion(rng, 1500, 16) @ np.diag(np.logspace(0.0, 4.0, 16))
    readings = rows @ (1.05 * known.coefficients) + rng.normal(scale=0.01, size=1500)
    for row, reading in zip(rows[:1000], readings, strict=False):
        adaptation.learn(row, reading)
    learned = adaptation.coefficients.copy()
    assert np.abs(learned - known.coefficients).max() > 0.0
    adaptation.end_piece()
    for row, reading in zip(rows[1000 : 1000 + EDGE], readings[1000:] + 3000.0, strict=False):
        adaptation.learn(row, reading)
    np.testing.assert_array_equal(adaptation.coefficients, learned)


def test_the_deviation_is_that_of_the_middle():
    rng = np.random.default_rng(7)
    rows = rng.normal(size=(20_000, 2))
    errors = rng.normal(scale=0.3, size=20_000)
    errors[::50] = 100.0
    known = Known.of(rows, rows @ np.array([1.0, 2.0]) + errors, np.array([1.0, 2.0]))
    assert known.deviation_nt == pytest.approx(0.3, rel=0.05)
    assert stats.norm.ppf(0.75) == pytest.approx(MEDIAN, abs=1e-4)

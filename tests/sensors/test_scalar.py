import numpy as np
import pytest

from magsim import columns
from magsim.scenario import ScalarSensor
from magsim.sensors.scalar import scalar_columns


def still(*vector):
    return lambda t: tuple(np.full(len(t), v) for v in vector)


SILENT = ScalarSensor(name="cabin", mount="cabin", noise_nt_rthz=0.0)
NOISY = ScalarSensor(name="cabin", mount="cabin", noise_nt_rthz=0.5)


def test_norm_and_projection_of_known_vectors(make_truth, acquisition):
    """Earth (30000, 0, 40000); the aircraft adds (300, 400, 0) and (0, 0, 100)."""
    truth = make_truth(earth=still(30e3, 0.0, 40e3), permanent=still(300.0, 400.0, 0.0), eddy=still(0.0, 0.0, 100.0))
    out = scalar_columns(SILENT, truth, acquisition, 1)
    total = np.sqrt(30_300.0**2 + 400.0**2 + 40_100.0**2)
    wanted = {
        "mag_cabin_nt": total,
        "clean_cabin_nt": 50_000.0,
        "total_cabin_nt": total,
        "interference_cabin_nt": total - 50_000.0,
        "projection_cabin_nt": 300.0 * 0.6 + 100.0 * 0.8,
        "error_cabin_nt": 0.0,
        "earth_cabin_z_nt": 40_000.0,
        "permanent_cabin_y_nt": 400.0,
        "eddy_cabin_z_nt": 100.0,
    }
    for name, value in wanted.items():
        np.testing.assert_allclose(out[name], value, rtol=0, atol=1e-9, err_msg=name)
    assert len(out) == 6 + 9
    assert all(columns.find(name) for name in out)


def test_parts_add_up_through_the_filter(make_truth, acquisition):
    truth = make_truth(
        earth=lambda t: (30e3 + np.sin(t), 100 * np.cos(2 * t), 40e3),
        permanent=still(10.0, 20.0, 30.0),
        hinged=lambda t: (np.sin(20 * t), 0.0, np.cos(9 * t)),
        induced=lambda t: (5 * np.sin(3 * t), 0.1, 0.2),
        eddy=lambda t: (0.0, np.cos(3 * t), 0.0),
    )
    out = scalar_columns(SILENT, truth, acquisition, 1)
    for k, axis in enumerate("xyz"):
        parts = sum(out[f"{component}_cabin_{axis}_nt"] for component in truth.parts_b)
        np.testing.assert_allclose(parts, acquisition(truth.total("cabin"))[:, k], rtol=0, atol=1e-9)


def test_labels_and_truth_are_free_of_noise(make_truth, acquisition):
    truth = make_truth(earth=lambda t: (30e3 + np.sin(t), 0.0, 40e3), permanent=still(300.0, 400.0, 0.0))
    quiet, noisy, other = (
        scalar_columns(sensor, truth, acquisition, seed) for sensor, seed in ((SILENT, 1), (NOISY, 1), (NOISY, 2))
    )
    same = [name for name in quiet if not name.startswith(("mag", "error"))]
    for name in same:
        np.testing.assert_array_equal(quiet[name], noisy[name])
        np.testing.assert_array_equal(quiet[name], other[name])
    assert np.std(noisy["error_cabin_nt"]) > 0.1
    assert not np.array_equal(noisy["mag_cabin_nt"], other["mag_cabin_nt"])
    np.testing.assert_allclose(
        noisy["mag_cabin_nt"], noisy["total_cabin_nt"] + noisy["error_cabin_nt"], rtol=0, atol=1e-10
    )
    assert np.std(quiet["error_cabin_nt"]) < 1e-9


def test_what_would_fold_back_is_gone(make_truth, acquisition):
    """The platform's 9.7 Hz ripple of 100 nT would appear at 0.3 Hz in plain samples."""
    truth = make_truth(earth=still(0.0, 0.0, 50e3), eddy=lambda t: (0.0, 0.0, 100.0 * np.sin(2 * np.pi * 9.7 * t)))
    out = scalar_columns(SILENT, truth, acquisition, 1)
    for name in ("mag_cabin_nt", "interference_cabin_nt", "projection_cabin_nt", "eddy_cabin_z_nt"):
        assert np.std(out[name]) < 0.01


def test_a_lag_is_that_of_the_instrument_and_not_of_the_truth(make_truth, acquisition):
    """First order: a ramp is late by the time constant."""
    truth = make_truth(earth=lambda t: (0.0, 0.0, 50e3 + 3.0 * t))
    lazy = ScalarSensor(name="cabin", mount="cabin", noise_nt_rthz=0.0, lag_s=0.15)
    out = scalar_columns(lazy, truth, acquisition, 1)
    np.testing.assert_allclose(out["error_cabin_nt"][5:], -3.0 * 0.15, rtol=0, atol=1e-3)
    np.testing.assert_allclose(out["total_cabin_nt"], 50e3 + 3.0 * acquisition.time_s, rtol=0, atol=1e-6)


def test_noise_belongs_to_the_name(make_truth, acquisition):
    truth = make_truth(earth=still(0.0, 0.0, 50e3))
    other = ScalarSensor(name="tail", mount="cabin", noise_nt_rthz=0.5)
    cabin, tail = (scalar_columns(s, truth, acquisition, 1)[f"error_{s.name}_nt"] for s in (NOISY, other))
    assert abs(np.corrcoef(cabin, tail)[0, 1]) < 0.3


def test_noise_of_the_rows(make_truth, acquisition):
    """White noise of density d leaves d sqrt(bandwidth of the anti-alias filter)."""
    truth = make_truth(earth=still(0.0, 0.0, 50e3))
    errors = [scalar_columns(NOISY, truth, acquisition, seed)["error_cabin_nt"] for seed in range(40)]
    gain2 = np.sum(acquisition.decimator.taps**2) * acquisition.rate_in_hz / 2
    # 40 x 201 rows.
    assert np.std(errors) == pytest.approx(0.5 * np.sqrt(gain2), rel=0.04)
    assert gain2 == pytest.approx(3.75, rel=0.1)

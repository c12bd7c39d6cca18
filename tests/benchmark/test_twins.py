"""Twins: anomalies that are drawn, and consistent in all that reads the field."""

import numpy as np
import pytest

from magsim import columns, signals
from magsim.benchmark.twins import PEAKS_NT, SPACING_S, anomalies, twin_of
from tests.support.worlds import World, calibration


@pytest.fixture(scope="module")
def recording():
    return calibration(World(circuits=1))


@pytest.mark.parametrize("peak_nt", PEAKS_NT)
def test_every_anomaly_has_the_height_and_there_is_one_in_each_stretch(peak_nt):
    time_s = 100.0 + np.arange(12_000) / 20.0
    drawn = anomalies(time_s, np.random.default_rng(3), peak_nt)
    assert 0.999 * peak_nt < np.abs(drawn).max() < 2.5 * peak_nt  # wide ones overlap
    stretches = np.array_split(np.abs(drawn), round(np.ptp(time_s) / SPACING_S))
    assert all(part.max() > 0.4 * peak_nt for part in stretches)
    assert drawn.min() < -0.9 * peak_nt
    # enough of it lies in the band of compensation
    assert np.std(signals.band_pass(drawn, 20.0)) > 0.05 * peak_nt


def test_one_alone_is_a_gaussian_or_its_derivative():
    time_s = np.arange(200) / 10.0
    kinds = set()
    for seed in range(20):
        drawn = anomalies(time_s, np.random.default_rng(seed), 1.0)
        kinds.add(bool(drawn.min() < -1e-3 and drawn.max() > 1e-3))
        assert np.abs(drawn).max() == pytest.approx(1.0, abs=0.1)
    assert kinds == {True, False}


def test_fluxgates_see_what_the_magnetometer_sees(recording):
    twin = twin_of(recording, "cabin", np.random.default_rng(1), 20.0)
    changed = {name for name in recording.data if not np.array_equal(recording[name], twin.recording[name])}
    assert changed == {"mag_cabin_nt", "flux_cabin_x_nt", "flux_cabin_y_nt", "flux_cabin_z_nt"}
    np.testing.assert_allclose(
        twin.recording["mag_cabin_nt"] - recording["mag_cabin_nt"], twin.injected, rtol=0, atol=1e-9
    )
    before, after = (one.vector(columns.FLUX, sensor="cabin") for one in (recording, twin.recording))
    lengths = np.linalg.norm(after, axis=1) - np.linalg.norm(before, axis=1)
    np.testing.assert_allclose(lengths, twin.injected, rtol=0, atol=1e-8)
    np.testing.assert_allclose(np.cross(after, before), 0.0, rtol=0, atol=1e-3)


def test_some_twins_have_no_anomaly(recording):
    twin = twin_of(recording, "cabin", np.random.default_rng(1), 0.0)
    assert twin.recording == recording
    assert not twin.injected.any()


def test_pieces_are_drawn_apart(recording):
    rows = np.r_[0:2000, 4000:6000]
    twin = twin_of(recording.take(rows), "cabin", np.random.default_rng(1), 1.0)
    steps = np.abs(np.diff(twin.injected))
    assert len(twin.injected) == 4000
    for part in (twin.injected[:2000], twin.injected[2000:]):
        assert np.abs(part).max() > 0.9
    assert steps.max() < 1.0

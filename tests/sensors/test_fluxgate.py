import numpy as np
import pytest

from magsim.frames import rot_nb_from_attitude, rotate
from magsim.scenario import FluxgateSensor
from magsim.sensors.fluxgate import fluxgate_columns, measure, response, sensing_axes
from magsim.streams import stream


def correct(reading_s: np.ndarray, sensor: FluxgateSensor) -> np.ndarray:
    """Return the field from a reading with known errors: the inverse of ``measure`` for offset, scale and angles.

    Parameters
    ----------
    reading_s : (n, 3) [nT]
    sensor : FluxgateSensor

    Returns
    -------
    (n, 3) [nT]
        Body axes.
    """
    return rotate(np.linalg.inv(response(sensor)), reading_s - np.array(sensor.offset_nt))


def fluxgate(**errors):
    return FluxgateSensor(name="a", mount="cabin", **({"noise_nt_rthz": 0.0} | errors))


FIELDS = np.random.default_rng(0).normal(scale=3e4, size=(50, 3))
WORN = fluxgate(
    offset_nt=(30.0, -20.0, 55.0),
    scale_error=(0.002, -0.003, 0.001),
    nonorthogonality_deg=(0.4, -0.3, 0.2),
    misalignment_deg=(1.0, -2.0, 3.0),
)


def reading(sensor, fields=FIELDS):
    return measure(np.asarray(fields, dtype=float), sensor, 120.0, stream(0, "x"))


def test_a_perfect_one_reads_the_body_axes():
    np.testing.assert_array_equal(reading(fluxgate()), FIELDS)


def test_there_and_back():
    np.testing.assert_allclose(correct(reading(WORN), WORN), FIELDS, rtol=0, atol=1e-9)
    assert np.abs(reading(WORN) - FIELDS).max() > 500.0


def test_each_error_alone():
    np.testing.assert_allclose(reading(fluxgate(offset_nt=(1.0, 2.0, 3.0))), FIELDS + np.array([1.0, 2.0, 3.0]))
    np.testing.assert_allclose(reading(fluxgate(scale_error=(0.1, 0.0, -0.1))), FIELDS * [1.1, 1.0, 0.9])


@pytest.mark.parametrize(
    ("misalignment", "field_b", "wanted"),
    [
        ((0.0, 0.0, 90.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)),  # yawed to the right: x looks to starboard
        ((0.0, 90.0, 0.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0)),  # pitched up: x looks up
        ((90.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),  # rolled right: y looks down
    ],
)
def test_sign_of_the_mounting_angles(misalignment, field_b, wanted):
    np.testing.assert_allclose(reading(fluxgate(misalignment_deg=misalignment), [field_b]), [wanted], atol=1e-15)


def test_mounting_is_an_attitude_in_the_body():
    angles = (4.0, -7.0, 20.0)
    rot_bs = rot_nb_from_attitude(np.radians(angles))
    np.testing.assert_allclose(reading(fluxgate(misalignment_deg=angles)), FIELDS @ rot_bs, atol=1e-9)


@pytest.mark.parametrize("angles", [(0.0, 0.0, 0.0), (0.4, -0.3, 0.2), (5.0, 0.0, 0.0), (-3.0, 8.0, 12.0)])
def test_sensing_axes_have_their_angles(angles):
    axes = sensing_axes(angles)
    np.testing.assert_allclose(np.linalg.norm(axes, axis=1), 1.0)
    for (i, j), beyond in zip(((0, 1), (0, 2), (1, 2)), angles, strict=True):
        assert np.degrees(np.arccos(axes[i] @ axes[j])) == pytest.approx(90.0 + beyond, abs=1e-9)
    assert np.linalg.det(axes) > 0.0
    np.testing.assert_array_equal(axes, np.tril(axes))


@pytest.mark.parametrize("angles", [(90.0, 0.0, 0.0), (40.0, 40.0, 40.0)])
def test_impossible_axes(angles):
    with pytest.raises(ValueError, match="no three axes can be"):
        sensing_axes(angles)


def test_order_of_the_errors():
    """Scale outermost, then the angles, then the mounting."""
    rot_sb = rot_nb_from_attitude(np.radians(WORN.misalignment_deg)).T
    wanted = np.diag(1.0 + np.array(WORN.scale_error)) @ sensing_axes(WORN.nonorthogonality_deg) @ rot_sb
    np.testing.assert_allclose(response(WORN), wanted, atol=1e-15)


def test_columns(make_truth, acquisition):
    truth = make_truth(earth=lambda t: (30e3 + 50 * np.sin(t), 10.0, 40e3), induced=lambda t: (3.0, 4 * np.cos(t), 5.0))
    out = fluxgate_columns(WORN, truth, acquisition, 3)
    flux = np.stack([out[f"flux_a_{axis}_nt"] for axis in "xyz"], axis=1)
    parts = [np.stack([out[f"{part}_a_{axis}_nt"] for axis in "xyz"], axis=1) for part in ("earth", "induced")]
    # The instrument is linear: it commutes with the filter.
    np.testing.assert_allclose(flux, reading(WORN, parts[0] + parts[1]), rtol=0, atol=1e-8)
    error = np.stack([out[f"fluxerror_a_{axis}_nt"] for axis in "xyz"], axis=1)
    np.testing.assert_allclose(parts[0] + parts[1] + error, flux, rtol=0, atol=1e-9)
    assert len(out) == 12


def test_the_error_is_all_that_differs_from_the_field_in_body_axes(make_truth, acquisition):
    """Mounting, clock and steps too; none in an ideal instrument."""
    truth = make_truth(earth=lambda t: (30e3 + 50 * np.sin(t), 10.0, 40e3))
    out = fluxgate_columns(fluxgate(), truth, acquisition, 3)
    for axis in "xyz":
        np.testing.assert_array_equal(out[f"fluxerror_a_{axis}_nt"], 0.0)
    turned = fluxgate_columns(fluxgate(misalignment_deg=(0.0, 0.0, 90.0)), truth, acquisition, 3)
    np.testing.assert_allclose(turned["fluxerror_a_x_nt"], 10.0 - out["earth_a_x_nt"], rtol=0, atol=1e-9)
    coarse = fluxgate_columns(fluxgate(step_nt=0.5, skew_s=0.1), truth, acquisition, 3)
    late = 50.0 * np.sin(acquisition.time_s - 0.1) - 50.0 * np.sin(acquisition.time_s)
    np.testing.assert_allclose(coarse["fluxerror_a_x_nt"], late, rtol=0, atol=0.26)
    np.testing.assert_allclose(coarse["fluxerror_a_x_nt"].std(), late.std(), rtol=0.01)


def test_noise_on_each_axis(make_truth, acquisition):
    truth = make_truth(earth=lambda t: (1e4, 2e4, 3e4))
    noisy = fluxgate(noise_nt_rthz=0.2)
    out = [fluxgate_columns(noisy, truth, acquisition, seed) for seed in range(30)]
    wanted = 0.2 * np.sqrt(np.sum(acquisition.decimator.taps**2) * 60.0)
    columns = [[run[f"flux_a_{axis}_nt"] for run in out] for axis in "xyz"]
    for column, mean in zip(columns, (1e4, 2e4, 3e4), strict=True):
        assert np.std(np.array(column) - mean) == pytest.approx(wanted, rel=0.05)
    assert abs(np.corrcoef(np.ravel(columns[0]), np.ravel(columns[1]))[0, 1]) < 0.1

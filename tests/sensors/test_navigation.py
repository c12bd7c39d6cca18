import numpy as np
import pytest

from magsim import columns
from magsim.earth import ecef_from_geodetic, rot_ne_at
from magsim.scenario import Ins
from magsim.sensors.navigation import ins_columns
from magsim.sensors.true_motion import compass, true_columns
from magsim.trajectory import Trajectory
from tests.support.allan import allan, gauss_markov_allan

ROWS = 6000


def trajectory(n=ROWS, heading=1.0, lon=1.9):
    t = np.arange(n) / 10.0
    zero = np.zeros(n)
    attitude = np.stack([0.1 * np.sin(t), 0.02 + zero, heading + 1e-3 * t], axis=1)
    velocity = np.stack([70.0 + zero, 5.0 + zero, -1.0 + zero], axis=1)
    rate = np.stack([zero, 0.1 + zero, zero], axis=1)
    return Trajectory(t, 0.3 + 1e-5 * t, lon + 1e-5 * t, 3000.0 + zero, velocity, attitude, rate)


def errors_of(ins, seed=0, n=ROWS):
    path = trajectory(n)
    out, true = ins_columns(ins, path, 10.0, seed), true_columns(path)
    return {name: out[name] - true[name.replace("ins_", "true_")] for name in out}


def test_a_perfect_one_tells_the_truth():
    for name, error in errors_of(Ins()).items():
        np.testing.assert_allclose(error, 0.0, atol=1e-8 if name == "ins_alt_m" else 1e-13, err_msg=name)


def test_units_and_names():
    out = true_columns(trajectory())
    assert out["true_roll_deg"].max() == pytest.approx(np.degrees(0.1), rel=1e-3)
    assert out["true_rate_y_dps"][0] == pytest.approx(np.degrees(0.1))
    assert out["true_lat_deg"][0] == pytest.approx(np.degrees(0.3))
    assert out["true_vd_mps"][0] == -1.0
    assert out["true_alt_m"][0] == 3000.0
    assert all(columns.find(name).role == "truth" for name in out)
    assert all(columns.find(name).role == "input" for name in ins_columns(Ins(), trajectory(), 10.0, 0))


@pytest.mark.parametrize(("angle", "wanted"), [(-10.0, 350.0), (725.0, 5.0), (360.0, 0.0), (-1e-20, 0.0), (0.0, 0.0)])
def test_compass(angle, wanted):
    assert compass(np.array([angle]))[0] == pytest.approx(wanted)
    assert 0.0 <= compass(np.array([angle]))[0] < 360.0


def test_angles_are_brought_home():
    out = true_columns(trajectory(heading=-0.01 + 4 * np.pi, lon=np.pi - 1e-3))
    assert out["true_heading_deg"][0] == pytest.approx(360.0 - np.degrees(0.01))
    assert out["true_heading_deg"][-1] == pytest.approx(np.degrees(-0.01 + 0.5999))
    assert out["true_lon_deg"][0] > 179.0
    assert out["true_lon_deg"][-1] < -179.0


def test_bias():
    errors = errors_of(Ins(attitude_bias_deg=(0.1, -0.2, 0.3)))
    for angle, bias in zip(("roll", "pitch", "heading"), (0.1, -0.2, 0.3), strict=True):
        np.testing.assert_allclose(errors[f"ins_{angle}_deg"], bias, atol=1e-12)


def test_white_noise():
    errors = errors_of(Ins(attitude_noise_deg=0.02, heading_factor=3.0, velocity_noise_mps=0.05))
    # 6000 rows: 1 % for a standard deviation.
    for name, sigma in (("roll_deg", 0.02), ("pitch_deg", 0.02), ("heading_deg", 0.06), ("ve_mps", 0.05)):
        error = errors[f"ins_{name}"]
        assert error.std() == pytest.approx(sigma, rel=0.04)
        assert abs(np.corrcoef(error[1:], error[:-1])[0, 1]) < 0.06
    assert abs(np.corrcoef(errors["ins_roll_deg"], errors["ins_pitch_deg"])[0, 1]) < 0.06


def test_drift():
    ins = Ins(attitude_drift_deg=0.1, heading_factor=2.0, correlation_s=5.0)
    runs = [errors_of(ins, seed, 600) for seed in range(60)]
    roll = np.array([run["ins_roll_deg"] for run in runs])
    heading = np.array([run["ins_heading_deg"] for run in runs])
    # 60 runs of 60 s with 5 s of correlation: about 360 independent values, 4 %.
    assert roll.std() == pytest.approx(0.1, rel=0.15)
    assert heading.std() == pytest.approx(0.2, rel=0.15)
    covariance = np.mean(roll[:, :-50] * roll[:, 50:])
    assert covariance / roll.var() == pytest.approx(np.exp(-1.0), abs=0.12)


def offset_n(ins, rows, seed=1):
    """Position errors north, east, down [m]."""
    path = trajectory(rows)
    out = ins_columns(ins, path, 10.0, seed)
    read_e = ecef_from_geodetic(np.radians(out["ins_lat_deg"]), np.radians(out["ins_lon_deg"]), out["ins_alt_m"])
    true = ecef_from_geodetic(path.lat_rad, path.lon_rad, path.alt_m)
    return np.einsum("nij,nj->ni", rot_ne_at(path.lat_rad, path.lon_rad), read_e - true)


def test_drift_of_position_and_velocity():
    """Gauss-Markov by its Allan deviation, each direction by itself."""
    ins = Ins(position_drift_m=2.0, velocity_drift_mps=0.05, correlation_s=4.0)
    rows = 100_000
    place = offset_n(ins, rows)
    velocity = np.stack([errors_of(ins, 1, rows)[f"ins_v{axis}_mps"] for axis in "ned"], axis=1)
    for error, sigma in ((place, 2.0), (velocity, 0.05)):
        for k in range(3):
            for window in (0.5, 4.0, 20.0):
                wanted = gauss_markov_allan(sigma, 4.0, window)
                assert allan(error[:, k], 10.0, window) == pytest.approx(wanted, rel=0.12)  # 500 windows of 20 s: 4 %
        assert np.abs(np.corrcoef(error.T) - np.eye(3)).max() < 0.12  # 1250 independent values


def test_position_errors_are_meters_in_local_axes():
    path = trajectory()
    out = ins_columns(Ins(position_noise_m=3.0), path, 10.0, 1)
    read_e = ecef_from_geodetic(np.radians(out["ins_lat_deg"]), np.radians(out["ins_lon_deg"]), out["ins_alt_m"])
    true = ecef_from_geodetic(path.lat_rad, path.lon_rad, path.alt_m)
    offset = np.einsum("nij,nj->ni", rot_ne_at(path.lat_rad, path.lon_rad), read_e - true)
    np.testing.assert_allclose(offset.std(axis=0), 3.0, rtol=0.04)
    # Down is the third channel of the same numbers.
    np.testing.assert_allclose(-(out["ins_alt_m"] - 3000.0), offset[:, 2], atol=1e-4)


def test_one_setting_does_not_change_the_numbers_of_another():
    alone = errors_of(Ins(attitude_noise_deg=0.1))["ins_roll_deg"]
    both = errors_of(Ins(attitude_noise_deg=0.1, attitude_bias_deg=(1.0, 0.0, 0.0), velocity_noise_mps=1.0))
    np.testing.assert_allclose(both["ins_roll_deg"] - 1.0, alone, atol=1e-12)

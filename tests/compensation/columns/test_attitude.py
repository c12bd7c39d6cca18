"""Attitude as columns."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.compensation.columns import AngleColumns, AttitudeColumns, AttitudeRateColumns, CoupledColumns, GyroColumns
from magsim.errors import RequestError
from magsim.frames import rot_nb_from_attitude
from tests.support.worlds import VECTOR, calibration


def test_columns_are_roll_pitch_and_the_direction_of_the_heading():
    r = calibration(VECTOR)
    design = AttitudeColumns()(r)
    roll, pitch, heading = (np.radians(r[f"ins_{angle}_deg"]) for angle in ("roll", "pitch", "heading"))
    np.testing.assert_array_equal(design.matrix, np.column_stack([roll, pitch, np.sin(heading), np.cos(heading)]))
    assert design.names == ("roll", "pitch", "sin heading", "cos heading")
    assert design.units == ("rad", "rad", "1", "1")


def test_angles_are_those_of_the_ins():
    r = calibration(VECTOR)
    design = AngleColumns()(r)
    np.testing.assert_array_equal(
        design.matrix, np.radians(r.stack([f"ins_{angle}_deg" for angle in ("roll", "pitch", "heading")]))
    )
    assert design.names == ("roll", "pitch", "heading")


def test_columns_do_not_jump_where_the_heading_wraps():
    r = calibration(VECTOR)
    assert np.abs(np.diff(r["ins_heading_deg"])).max() > 300.0
    assert np.abs(np.diff(AngleColumns()(r).matrix, axis=0)).max() > 6.0
    assert np.abs(np.diff(AttitudeColumns()(r).matrix, axis=0)).max() < 0.1


def test_only_the_attitude_of_the_ins_is_read():
    r = calibration(VECTOR)
    made = AttitudeColumns()
    np.testing.assert_array_equal(made(r.blind(made.reads)).matrix, made(r).matrix)
    without = replace(r, data={k: v for k, v in r.data.items() if k not in ("ins_roll_deg", "ins_heading_deg")})
    with pytest.raises(RequestError, match="recording 'world' has no column ins_roll_deg, ins_heading_deg"):
        made(without)


def test_rates_from_the_attitude_are_the_rates_of_the_rotation_matrix():
    """In the limit of a small step: the skew part of R' dR/dt, by differences of the matrices themselves."""
    r = calibration(VECTOR).take(slice(0, 3000))
    angles = np.radians(r.stack(["ins_roll_deg", "ins_pitch_deg", "ins_heading_deg"]))
    rot = rot_nb_from_attitude(angles)
    skew = np.einsum("nji,njk->nik", rot[1:-1], (rot[2:] - rot[:-2]) * 5.0)
    expected = np.column_stack(
        [skew[:, 2, 1] - skew[:, 1, 2], skew[:, 0, 2] - skew[:, 2, 0], skew[:, 1, 0] - skew[:, 0, 1]]
    )
    got = AttitudeRateColumns()(r)
    np.testing.assert_allclose(got.matrix[1:-1], 0.5 * expected, rtol=0, atol=2e-4)
    assert np.abs(expected).max() > 0.3
    assert got.names == GyroColumns.names == ("rate x", "rate y", "rate z")


def test_coupled_columns_are_the_products_of_attitude_and_rates():
    r = calibration(VECTOR).take(slice(0, 3000))
    design, attitude, rates = (made(r) for made in (CoupledColumns(), AttitudeColumns(), AttitudeRateColumns()))
    assert len(set(design.names)) == design.matrix.shape[1] == 12
    for i, angle in enumerate(attitude.names):
        for j, rate in enumerate(rates.names):
            place = design.names.index(f"{angle} {rate}")
            np.testing.assert_array_equal(design.matrix[:, place], attitude.matrix[:, i] * rates.matrix[:, j])
            assert design.units[place] == ("rad2/s" if attitude.units[i] == "rad" else "rad/s")
    assert CoupledColumns().reads == AttitudeColumns().reads

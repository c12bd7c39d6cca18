from dataclasses import replace

import numpy as np
import pytest
from magsim.compensation.features import Inputs, Standardizer, attitude, design, spans, time_derivative, tolles_lawson

from magsim.errors import DataError, RequestError
from tests.support.worlds import VECTOR, calibration

INPUTS = Inputs("cabin")


def test_sixteen_columns_as_paper_000_prints_them():
    r = calibration(VECTOR)
    f = np.column_stack([r[f"flux_cabin_{axis}_nt"] for axis in "xyz"])
    b = np.linalg.norm(f, axis=1)
    u = f / b[:, None]
    d = np.gradient(u, 0.1, axis=0)
    (u1, u2, u3), (d1, d2, d3) = u.T, d.T
    induced = [u1 * u1, u1 * u2, u1 * u3, u2 * u3, u3 * u3]
    eddy = [u1 * d1, u2 * d1, u3 * d1, u1 * d3, u2 * d3, u3 * d3, u1 * d2, u3 * d2]
    expected = np.column_stack([u1, u2, u3, *(b * x for x in induced), *(b * x for x in eddy)])
    got = tolles_lawson(r, INPUTS, 16)
    scale = np.abs(expected).max(axis=0)
    np.testing.assert_allclose(got.matrix / scale, expected / scale, rtol=0, atol=1e-9)
    assert got.names[8:] == tuple(
        f"B {w}'" for w in ("u1 u1", "u2 u1", "u3 u1", "u1 u3", "u2 u3", "u3 u3", "u1 u2", "u3 u2")
    )
    assert got.units == ("nT",) * 3 + ("1",) * 5 + ("s",) * 8


def test_eighteen_columns_add_the_two_that_follow_from_the_others():
    r = calibration(VECTOR)
    sixteen, eighteen = tolles_lawson(r, INPUTS, 16), tolles_lawson(r, INPUTS, 18)
    extra = [name for name in eighteen.names if name not in sixteen.names]
    assert extra == ["B u2 u2", "B u2 u2'"]
    column = dict(zip(eighteen.names, eighteen.matrix.T, strict=True))
    strength = np.linalg.norm(np.column_stack([r[f"flux_cabin_{axis}_nt"] for axis in "xyz"]), axis=1)
    squares = column["B u1 u1"] + column["B u2 u2"] + column["B u3 u3"]
    np.testing.assert_allclose(squares, strength, rtol=1e-12)
    slopes = column["B u1 u1'"] + column["B u2 u2'"] + column["B u3 u3'"]
    # not zero, since differences do not obey the product rule
    assert np.abs(slopes).max() < 0.02 * np.abs(column["B u1 u1'"]).max()


def test_constant_strength_replaces_the_length():
    r = calibration(VECTOR)
    sample, constant = tolles_lawson(r, INPUTS, 16), tolles_lawson(r, replace(INPUTS, strength_nt=45000.0), 16)
    np.testing.assert_array_equal(sample.matrix[:, :3], constant.matrix[:, :3])
    ratio = sample.matrix[:, 3] / constant.matrix[:, 3]
    strength = np.linalg.norm(np.column_stack([r[f"flux_cabin_{axis}_nt"] for axis in "xyz"]), axis=1)
    np.testing.assert_allclose(ratio, strength / 45000.0, rtol=1e-12)


@pytest.mark.parametrize(("method", "relative"), [("central", 0.024), ("spline", 2e-4)])
def test_derivative_is_per_second(method, relative):
    """At 0.6 Hz and 10 Hz sampling central differences are sinc(2 f / fs) = 2.3 % low."""
    time_s = np.arange(600) / 10.0
    omega = 2.0 * np.pi * 0.6
    got = time_derivative(np.sin(omega * time_s), time_s, method)[50:-50]
    exact = omega * np.cos(omega * time_s)[50:-50]
    error = np.abs(got - exact).max() / omega
    assert error < relative
    assert method == "spline" or error > 0.02


def test_derivative_stops_at_a_gap():
    time_s = np.concatenate([np.arange(50), np.arange(80, 120), [200.0]]) / 10.0
    values = np.where(time_s < 6.0, 3.0 * time_s, 1000.0 - 2.0 * time_s)
    assert [s.stop - s.start for s in spans(time_s)] == [50, 40, 1]
    for method in ("central", "spline"):
        slope = time_derivative(values, time_s, method)
        np.testing.assert_allclose(slope[:50], 3.0, rtol=1e-9)
        np.testing.assert_allclose(slope[50:90], -2.0, rtol=1e-9)
        assert slope[90] == 0.0


def test_attitude_does_not_jump_where_the_heading_wraps():
    r = calibration(VECTOR)
    assert np.abs(np.diff(r["ins_heading_deg"])).max() > 300.0
    assert np.abs(np.diff(attitude(r, INPUTS).matrix, axis=0)).max() < 0.1


def test_standardizer_knows_only_its_rows():
    matrix = np.random.default_rng(0).normal(5.0, 3.0, (500, 2)) * [1.0, 1e-6] + [0.0, 1.0]
    matrix = np.column_stack([matrix, np.full(500, 7.0)])
    scaled = Standardizer.of([matrix[:200], matrix[200:]])(matrix)
    np.testing.assert_allclose(scaled.mean(axis=0), 0.0, atol=1e-6)
    np.testing.assert_allclose(scaled.std(axis=0), [1.0, 1.0, 0.0], atol=1e-6)


def test_what_is_missing_is_named():
    r = calibration(VECTOR).blind()
    with pytest.raises(RequestError, match="no fluxgate 'wing'; it has cabin"):
        tolles_lawson(r, Inputs("wing"), 16)
    without = replace(r, data={k: v for k, v in r.data.items() if not k.startswith("ins_roll")})
    with pytest.raises(RequestError, match="has no column ins_roll_deg"):
        design(without, INPUTS, ("attitude",))
    broken = r["flux_cabin_y_nt"].copy()
    broken[120] = np.nan
    with pytest.raises(DataError, match="no direction at 12 s"):
        design(replace(r, data={**r.data, "flux_cabin_y_nt": broken}), INPUTS, ("tl16",))

"""Tolles-Lawson columns against those that papers 000 and 001 print."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.compensation.columns import TollesLawsonColumns
from magsim.compensation.columns.tolles_lawson import term_names, term_units, tolles_lawson_columns
from magsim.errors import DataError, RequestError
from magsim.signals import in_band
from tests.support.worlds import VECTOR, calibration

MARKS = ("u1", "u2", "u3")
INDUCED = ("B u1 u1", "B u1 u2", "B u1 u3", "B u2 u2", "B u2 u3", "B u3 u3")
EDDY = tuple(f"B u{i} u{j}'" for j in (1, 3, 2) for i in (1, 2, 3))


def flux(recording):
    return np.column_stack([recording[f"flux_cabin_{axis}_nt"] for axis in "xyz"])


def test_sixteen_columns_as_paper_000_prints_them():
    r = calibration(VECTOR)
    f = flux(r)
    b = np.linalg.norm(f, axis=1)
    u = f / b[:, None]
    d = np.gradient(u, 0.1, axis=0)
    (u1, u2, u3), (d1, d2, d3) = u.T, d.T
    induced = [u1 * u1, u1 * u2, u1 * u3, u2 * u3, u3 * u3]
    eddy = [u1 * d1, u2 * d1, u3 * d1, u1 * d3, u2 * d3, u3 * d3, u1 * d2, u3 * d2]
    expected = np.column_stack([u1, u2, u3, *(b * x for x in induced), *(b * x for x in eddy)])
    got = TollesLawsonColumns(16, "cabin")(r)
    scale = np.abs(expected).max(axis=0)
    np.testing.assert_allclose(got.matrix / scale, expected / scale, rtol=0, atol=1e-9)
    assert got.names[8:] == tuple(
        f"B {w}'" for w in ("u1 u1", "u2 u1", "u3 u1", "u1 u3", "u2 u3", "u3 u3", "u1 u2", "u3 u2")
    )
    assert got.units == ("nT",) * 3 + ("1",) * 5 + ("s",) * 8


@pytest.mark.parametrize(
    ("terms", "names"),
    [
        (3, MARKS),
        (8, MARKS + tuple(name for name in INDUCED if name != "B u2 u2")),
        (9, MARKS + INDUCED),
        (18, MARKS + INDUCED + EDDY),
    ],
)
def test_columns_of_other_numbers_by_their_names(terms, names):
    """Each name is read as a product of B, components of u and their derivatives."""
    rng = np.random.default_rng(0)
    u, rates, strength = rng.normal(size=(50, 3)), rng.normal(size=(50, 3)), rng.uniform(1.0, 2.0, 50)
    factors = {"B": strength}
    factors |= {f"u{i + 1}": u[:, i] for i in range(3)} | {f"u{i + 1}'": rates[:, i] for i in range(3)}
    got = tolles_lawson_columns(u, rates, strength, terms)
    assert term_names(terms) == names
    assert got.shape == (50, terms)
    for name, column in zip(names, got.T, strict=True):
        np.testing.assert_allclose(column, np.prod([factors[word] for word in name.split()], axis=0), rtol=1e-14)
    units = {1: "nT", 3: "1"}
    assert term_units(terms) == tuple("s" if "'" in name else units[len(name.split())] for name in names)


def test_eighteen_columns_add_the_two_that_follow_from_the_others():
    r = calibration(VECTOR)
    sixteen, eighteen = (TollesLawsonColumns(terms, "cabin", strength_nt=45000.0)(r) for terms in (16, 18))
    extra = [name for name in eighteen.names if name not in sixteen.names]
    assert extra == ["B u2 u2", "B u2 u2'"]
    column = dict(zip(eighteen.names, eighteen.matrix.T, strict=True))
    for name, values in zip(sixteen.names, sixteen.matrix.T, strict=True):
        np.testing.assert_array_equal(column[name], values)
    squares = column["B u1 u1"] + column["B u2 u2"] + column["B u3 u3"]
    np.testing.assert_allclose(squares, 45000.0, rtol=1e-12)
    slopes = column["B u1 u1'"] + column["B u2 u2'"] + column["B u3 u3'"]
    # not zero, since differences do not obey the product rule
    assert np.abs(slopes).max() < 0.02 * np.abs(column["B u1 u1'"]).max()


@pytest.mark.parametrize("terms", [9, 18])
def test_row_by_row_no_sum_of_columns_is_the_length_of_the_reading(terms):
    """The diagonal columns lose a third of it each, whatever they are called; all others are as published."""
    r = calibration(VECTOR)
    made = TollesLawsonColumns(terms, "cabin")(r)
    b = np.linalg.norm(flux(r), axis=1)
    u = flux(r) / b[:, None]
    plain = tolles_lawson_columns(u, np.gradient(u, 0.1, axis=0), b, terms)
    diagonal = [term_names(terms).index(f"B u{i} u{i}") for i in (1, 2, 3)]
    for i, column in enumerate(diagonal):
        np.testing.assert_allclose(made.matrix[:, column], b * (u[:, i] ** 2 - 1.0 / 3.0), atol=1e-9 * b.max())
        assert made.names[column] == f"B (u{i + 1} u{i + 1} - 1/3)"
    others = [c for c in range(terms) if c not in diagonal]
    np.testing.assert_allclose(made.matrix[:, others], plain[:, others], rtol=1e-9, atol=1e-8)
    table = in_band(np.column_stack([made.matrix, b]), r.time_s)
    scaled = table / table.std(axis=0)
    left = scaled[:, -1] - scaled[:, :-1] @ np.linalg.lstsq(scaled[:, :-1], scaled[:, -1], rcond=1e-9)[0]
    assert left.std() > 1e-3


@pytest.mark.parametrize("strength_nt", [None, 45_000.0])
def test_eddy_columns_of_the_field_are_products_of_the_direction_and_its_derivative(strength_nt):
    """u_i dB_j/dt, whatever the field strength of the other columns; it differs from B u_i u_j' by u_i u_j dB/dt."""
    r = calibration(VECTOR)
    b = np.linalg.norm(flux(r), axis=1)
    u, rate = flux(r) / b[:, None], np.gradient(flux(r), 0.1, axis=0)
    made = TollesLawsonColumns(16, "cabin", strength_nt=strength_nt, eddy="field")(r)
    pairs = [(0, 0), (1, 0), (2, 0), (0, 2), (1, 2), (2, 2), (0, 1), (2, 1)]
    assert made.names[8:] == tuple(f"u{i + 1} B{j + 1}'" for i, j in pairs)
    expected = np.column_stack([u[:, i] * rate[:, j] for i, j in pairs])
    np.testing.assert_allclose(made.matrix[:, 8:], expected, rtol=1e-9, atol=1e-6)
    plain = TollesLawsonColumns(16, "cabin", strength_nt=strength_nt)(r)
    np.testing.assert_array_equal(made.matrix[:, :8], plain.matrix[:, :8])
    if strength_nt is None:
        slope = np.gradient(b, 0.1)
        apart = np.column_stack([u[:, i] * u[:, j] * slope for i, j in pairs])
        left = made.matrix[:, 8:] - plain.matrix[:, 8:] - apart
        assert np.std(left) < 0.1 * np.std(apart)


def test_constant_strength_replaces_the_length():
    r = calibration(VECTOR)
    sample, constant = (TollesLawsonColumns(16, "cabin", strength_nt=value)(r) for value in (None, 45000.0))
    np.testing.assert_array_equal(sample.matrix[:, :3], constant.matrix[:, :3])
    ratio = sample.matrix[:, 3] / constant.matrix[:, 3]
    np.testing.assert_allclose(ratio, np.linalg.norm(flux(r), axis=1) / 45000.0, rtol=1e-12)


def test_only_the_fluxgate_is_read():
    r = calibration(VECTOR)
    made = TollesLawsonColumns(16, "cabin")
    assert made.reads == ("flux_{sensor}_{axis}_nt",)
    np.testing.assert_array_equal(made(r.blind(made.reads)).matrix, made(r).matrix)


def test_missing_fluxgates_and_readings_without_direction_are_refused():
    r = calibration(VECTOR).blind()
    with pytest.raises(RequestError, match="no fluxgate 'wing'; it has cabin"):
        TollesLawsonColumns(16, "wing")(r)
    for value in (np.nan, np.inf):
        broken = r["flux_cabin_y_nt"].copy()
        broken[120] = value
        with pytest.raises(DataError, match="fluxgate 'cabin' has no direction at 12 s"):
            TollesLawsonColumns(16, "cabin")(replace(r, data={**r.data, "flux_cabin_y_nt": broken}))
    zeros = {name: np.where(np.arange(len(r)) == 120, 0.0, r[name]) for name in r.data if name.startswith("flux")}
    with pytest.raises(DataError, match="fluxgate 'cabin' has no direction at 12 s"):
        TollesLawsonColumns(16, "cabin")(replace(r, data={**r.data, **zeros}))
